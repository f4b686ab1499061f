"use strict";
(() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const element = (id) => document.getElementById(id);
  const fail = (why) => {
    element("failure").textContent = why;
    for (const control of document.querySelectorAll("button, input")) control.disabled = true;
    for (const part of document.querySelectorAll("#state, .knowledge, .felt")) part.hidden = true;
  };
  if (!("serial" in navigator)) {
    return fail("This browser offers no Web Serial, so it cannot reach a chip. On a computer, Chrome, Edge and Opera do, and "
      + "Firefox from version 151; on Android, Chrome from 148. Safari does not. Or use the program: palpate link PORT.");
  }
  let link;
  try {
    link = openLink(data.wasm);
  } catch (error) {
    return fail(`This browser offers no WebAssembly, which the page needs: ${error.message}.`);
  }

  const percent = (share) => (100 * share).toFixed(share > 0.9995 ? 2 : 1);
  const milliseconds = (micros) => (micros === null ? "–" : (micros / 1000).toFixed(3));
  const counted = (count, what, many = `${what}s`) => `${count} ${count === 1 ? what : many}`;
  const cell = (kind, text) => Object.assign(document.createElement(kind), { textContent: text });

  // What is known of the chip.
  let objects = data.model?.objects ?? [], isOurs = data.model !== null, bars = [], last = null, missed = 0, count = 0;
  const name = (object) => objects[object] ?? `object ${object + 1}`;

  const showModel = () => {
    bars = objects.map((label, index) => {
      const row = document.createElement("tr");
      const track = Object.assign(document.createElement("div"), { className: "track" });
      const bar = Object.assign(document.createElement("div"), { className: "bar" });
      track.setAttribute("aria-hidden", "true");
      track.append(bar);
      if (isOurs && index < data.model.thresholds.length) {
        const line = Object.assign(document.createElement("div"), { className: "line" });
        line.style.left = `${100 * data.model.thresholds[index]}%`;
        track.append(line);
      }
      const heading = Object.assign(cell("th", label), { scope: "row" });
      const drawn = document.createElement("td");
      drawn.append(track);
      row.append(heading, drawn, Object.assign(cell("td", "–"), { className: "number" }));
      return { row, bar };
    });
    element("bars").tBodies[0].replaceChildren(...bars.map(({ row }) => row));
    element("bars").hidden = bars.length === 0;
  };
  const showPosteriors = (of) => {
    const best = of.indexOf(Math.max(...of));
    bars.forEach(({ row, bar }, index) => {
      bar.style.width = `${100 * (of[index] ?? 0)}%`;
      row.cells[2].textContent = of[index] === undefined ? "–" : percent(of[index]);
      row.classList.toggle("leads", last !== null && index === best);
    });
  };
  const showVerdict = () => {
    const verdict = last?.verdict ?? "undecided";
    const after = last && `after ${counted(last.touches, "touch", "touches")}`;
    element("verdict").textContent = last === null ? "Nothing has been touched yet." : {
      undecided: `Undecided ${after}: perhaps ${name(last.object)}.`,
      recognized: `Recognized: ${name(last.object)}, ${after}.`,
      unknown: `No object that the model knows, ${after}.`,
      "gave-up": `Gave up ${after}.`,
    }[verdict];
    element("verdict").dataset.verdict = verdict;
    bars.forEach(({ row }, index) => row.classList.toggle("named", verdict === "recognized" && index === last?.object));
  };
  const showLine = () => {
    const garbled = link.garbled();
    const parts = [
      missed && `${counted(missed, "report")} of the chip ${missed === 1 ? "was" : "were"} lost on the way`,
      garbled && `${counted(garbled, "frame")} failed ${garbled === 1 ? "its" : "their"} checksum and ${garbled === 1 ? "was" : "were"} dropped`,
    ].filter(Boolean);
    element("line").textContent = parts.length ? `The line: ${parts.join("; ")}.` : "";
  };

  const MOST_ROWS = 200;
  const enter = (number, times, says, kind = "") => {
    const row = document.createElement("tr");
    row.className = kind;
    row.append(...[number, ...times].map((text) => Object.assign(cell("td", text), { className: "number" })), cell("td", says));
    const body = element("touches").tBodies[0];
    body.prepend(row);
    if (body.rows.length > MOST_ROWS) body.lastElementChild.remove();
  };
  // Contacts on a common scale, which ends at a round time past the last one.
  const draw = (times) => {
    const latest = Math.max(...times.map((micros) => micros ?? 0));
    const whole = [50, 100, 200, 300, 500, 1000, 2000, 5000].find((ms) => 1000 * ms >= latest) ?? Math.ceil(latest / 1e6) * 1000;
    [...element("fingers").tBodies[0].rows].forEach((row, finger) => {
      const contact = row.querySelector(".contact");
      contact.hidden = times[finger] === null;
      contact.style.left = `${(times[finger] ?? 0) / (10 * whole)}%`;
      row.cells[2].textContent = milliseconds(times[finger]);
    });
    const none = times.every((micros) => micros === null);
    element("scale").textContent = none ? "The last approach touched nothing."
      : `The last touch: when each finger made contact, in ${whole} ms from left to right.`;
  };

  const warn = (text) => { element("warning").textContent = text; };
  const checkModel = ({ checksum, length }) => {
    isOurs = data.model !== null && data.model.checksum === checksum;
    warn(data.model === null || isOurs ? ""
      : `The chip has another model than this page: ${length} bytes with checksum ${hex(checksum)}, the page's has `
        + `${data.model.length} bytes with checksum ${hex(data.model.checksum)}. Names and posteriors are those of the chip; `
        + "thresholds are not drawn.");
  };
  const hex = (checksum) => checksum.toString(16).padStart(8, "0");
  const chip = { program: "", model: "" };
  const showChip = () => { element("chip").textContent = [chip.program, chip.model].filter(Boolean).join("; "); };
  const FINGERS = ["first finger", "middle finger", "last finger"];
  const dashes = ["", "", ""];

  // One for each kind of what happens on a chip.
  const happens = {
    connected: () => say("open", "Connected."),
    silent: () => say("waiting", `The chip has not answered for half a minute. ${HINT}`),
    version: ({ theirs, ours }) => warn(`The chip speaks version ${theirs} of the link, this page version ${ours}: flash the chip `
      + "with a program of this version, or open a page made by the program's version."),
    program: ({ name: program }) => { chip.program = program; },
    model: (model) => {
      objects = model.objects;
      checkModel(model);
      chip.model = `a model of ${model.length} bytes, ${counted(objects.length, "object")}`;
      showModel();
      showVerdict();
    },
    "no-model": ({ why }) => {
      [objects, isOurs, chip.model] = [[], false, "no model"];
      warn(`No verdicts: ${why}. Touches are shown.`);
      showModel();
    },
    posteriors: ({ of }) => showPosteriors(of),
    touch: (touch) => {
      const { times, verdict, object, touches } = touch;
      const says = { undecided: `perhaps ${name(object)}`, unknown: "no object it knows", "gave-up": "gave up" }[verdict]
        ?? `recognized ${name(object)} after ${counted(touches, "touch", "touches")}`;
      enter(count += 1, times.map(milliseconds), says, verdict === "undecided" ? "" : "done");
      last = touch;
      draw(times);
      showVerdict();
    },
    refused: ({ times, why }) => {
      enter(count += 1, times.map(milliseconds), `not counted: ${why}`);
      draw(times);
    },
    fault: ({ finger, what }) => enter("", dashes, `fault: ${finger === null ? "" : `${FINGERS[finger]}: `}${what}`, "fault"),
    started: () => {
      last = null;
      enter("", dashes, "the chip was started", "fault");
      showVerdict();
    },
    reset: () => {
      last = null;
      enter("", dashes, "another object", "done");
      showVerdict();
    },
    missed: ({ count: lost }) => { missed += lost; },
  };

  const HINT = "Is its program flashed, are TX and RX crossed, is the baud rate right?";
  let asking = null;
  const say = (state, text) => {
    clearTimeout(asking);
    element("state").dataset.state = state;
    element("state").textContent = text;
    const isOpen = cable.isOpen;
    element("connect").textContent = isOpen ? "Disconnect" : "Connect";
    element("reset").disabled = state !== "open";
    element("baud").disabled = isOpen;
  };
  const because = (error) => (error?.message ? ` (${error.message.replace(/\.$/, "")})` : "");
  const cable = openCable(link, (happening) => {
    happens[happening.is]?.(happening);
    showChip();
    showLine();
  }, (state, error) => {
    if (state === "open") {
      say("waiting", "The port is open; asking the chip.");
      asking = setTimeout(() => say("waiting", `The port is open, and the chip does not answer. ${HINT}`), 2000);
      return;
    }
    say(state, {
      opening: "Opening the port.",
      closed: "Not connected.",
      lost: `The port is gone${because(error)}: is the cable pulled? Plug it in again, or press Connect.`,
      refused: `The port cannot be opened${because(error)}. Does another program use it, such as palpate link? On Linux, may you `
        + "use it (group dialout)?",
    }[state]);
  });
  element("connect").addEventListener("click", () => {
    if (cable.isOpen) return void cable.disconnect();
    const baud = Number(element("baud").value);
    if (!Number.isInteger(baud) || baud < 300) return say("refused", "The baud rate must be a whole number from 300 on.");
    cable.connect(baud);
  });
  element("reset").addEventListener("click", () => cable.reset());
  showModel();
  showVerdict();
})();
