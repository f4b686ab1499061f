// Put into a copy of a page of `palpate view --play` by .ci/play: plays as a visitor would, compares what the page computes with
// what the program computed (lines in the element "trace"), and leaves a verdict in the title.
(() => {
  const wrong = [];
  addEventListener("error", (event) => wrong.push(`script error: ${event.message}`));
  addEventListener("securitypolicyviolation", (event) => wrong.push(`refused by policy: ${event.blockedURI || event.violatedDirective}`));
  const context = HTMLCanvasElement.prototype.getContext;
  HTMLCanvasElement.prototype.getContext = function (kind, options) {
    return context.call(this, kind, { ...options, preserveDrawingBuffer: true });
  };
  Element.prototype.setPointerCapture = Element.prototype.releasePointerCapture = () => {};
  // Headless Chromium's virtual time waits for timers, not for frames.
  window.requestAnimationFrame = (act) => setTimeout(() => act(performance.now()), 16);

  const pause = (ms = 50) => new Promise((resume) => setTimeout(resume, ms));
  const element = (id) => document.getElementById(id);
  const text = (id) => element(id).textContent;
  const expect = (holds, what) => { if (!holds) wrong.push(what); };
  const waitFor = async (holds, what) => {
    for (let tries = 0; tries < 2000 && !holds(); tries += 1) await pause();
    expect(holds(), what);
  };
  const choose = (select, value) => {
    select.value = value;
    select.dispatchEvent(new Event("change"));
  };
  const slide = (id, value) => {
    element(id).value = value;
    element(id).dispatchEvent(new Event("input"));
  };
  const rows = (id) => [...element(id).tBodies[0].rows];
  const pixels = () => {
    const canvas = document.querySelector("#stage canvas");
    const copy = Object.assign(document.createElement("canvas"), { width: canvas.width, height: canvas.height });
    const flat = context.call(copy, "2d");
    flat.drawImage(canvas, 0, 0);
    return flat.getImageData(0, 0, copy.width, copy.height).data;
  };
  const differs = (before) => {
    const after = pixels();
    return before.some((value, i) => Math.abs(value - after[i]) > 8);
  };
  const does = async (what, act) => {
    const before = pixels();
    act();
    for (let tries = 0; tries < 40 && !differs(before); tries += 1) await pause();
    expect(differs(before), `${what} changes nothing in the picture`);
  };

  const compare = () => {
    const data = JSON.parse(text("data"));
    const game = openGame(data);
    const lines = text("trace").trim().split("\n");
    const codes = ["undecided", "recognized", "unknown", "gave up"];
    let round = "", differing = 0;
    for (const line of lines) {
      const [object, seed, index] = line.split(" ", 3);
      if (round !== `${object} ${seed}`) game.begin(Number(object), Number(seed));
      round = `${object} ${seed}`;
      const { times } = game.touchAtRandom();
      const parts = [object, seed, index, ...times.map((micros) => micros ?? "-")];
      data.models.forEach((_, model) => {
        const { verdict, best, touches } = game.player(model);
        parts.push(codes.indexOf(verdict), best, touches, game.evidence(model).join(","));
      });
      const own = parts.join(" ");
      if (own !== line && (differing += 1) === 1) wrong.push(`the page computes "${own}", the program "${line}"`);
    }
    expect(differing === 0, `${differing} of ${lines.length} touches differ from the program's`);
    expect(lines.length >= 10000, `only ${lines.length} touches were compared`);
    return `${lines.length} touches and what ${data.models.length} models make of them are the program's.`;
  };

  const opens = () => {
    expect(text("failure") === "", `it says ${text("failure")}`);
    const first = pixels();
    let drawn = 0;
    for (let i = 0; i < first.length; i += 4) drawn += Math.abs(first[i] - first[0]) + Math.abs(first[i + 1] - first[1]) > 12;
    expect(drawn * 4 / first.length > 0.02, "hardly anything is drawn");
  };
  const click = (x, y) => {
    const canvas = document.querySelector("#stage canvas"), box = canvas.getBoundingClientRect();
    for (const type of ["pointerdown", "pointerup"]) {
      canvas.dispatchEvent(new PointerEvent(type, {
        clientX: box.left + x * box.width, clientY: box.top + y * box.height, pointerId: 1, pointerType: "mouse", button: 0,
        buttons: type === "pointerdown" ? 1 : 0, bubbles: true,
      }));
    }
  };
  // The page of a table.
  const press = async () => {
    opens();
    await does("the choice", () => element("next").click());
    expect(rows("touches").length === 1 && rows("ghosts").length > 0, "an approach enters no list, or nothing is believed");
    await does("a click on the table", () => click(0.5, 0.5));
    expect(rows("touches").length === 2, "a click on the table is no approach");
    await does("the key R", () => document.querySelector("#stage canvas").dispatchEvent(new KeyboardEvent("keydown", { key: "r" })));
    await does("a slider", () => slide("x", 20));
    element("there").click();
    expect(rows("touches")[0].cells[1].textContent === "20.0", "the hand is not where the slider says");
    for (let tries = 0; tries < 30 && element("verdict").dataset.verdict === "undecided"; tries += 1) {
      element("next").click();
      await pause();
    }
    expect(element("verdict").dataset.verdict === "recognized", `it says "${text("verdict")}"`);
    const verdict = text("verdict");
    await does("to reveal", () => element("reveal").click());
    expect(/^It is the .* yaw/.test(text("answer")), `it reveals "${text("answer")}"`);
    element("again").click();
    expect(rows("touches").length === 0 && rows("ghosts").length === 0 && text("answer") === "", "another object has the approaches of the one before");
    element("until").click();
    await waitFor(() => element("verdict").dataset.verdict !== "undecided" && text("until") !== "Stop", "there is no verdict");
    return verdict;
  };

  const play = async () => {
    opens();
    await does("touching at random", () => element("touch").click());
    expect(rows("touches").length === 1, "a touch does not enter the list");
    for (const key of ["ArrowLeft", "ArrowUp", "+"]) {
      await does(`the key ${key}`, () => document.querySelector("#stage canvas").dispatchEvent(new KeyboardEvent("keydown", { key })));
    }
    // In the middle of the picture there is the object.
    await does("a click on the surface", () => click(0.5, 0.5));
    expect(rows("touches").length === 2, "a click on the surface is no touch");
    click(0.005, 0.005);
    expect(rows("touches").length === 2, "a click beside the object is a touch");
    element("until").click();
    await waitFor(() => element("verdict").dataset.verdict !== "undecided", "there is no verdict");
    expect(text("until") === "Touch until sure", "it does not stop with the verdict");
    const verdict = text("verdict");
    for (const row of rows("bars")) {
      const [bar, line] = row.querySelectorAll(".bar, .line");
      expect(bar.style.width.endsWith("%") && parseFloat(line.style.left) > 50, "a bar has no length or no threshold");
    }
    const { length } = element("object").options;
    await does("another object", () => choose(element("object"), 1));
    expect(rows("touches").length === 0, "another object has the touches of the one before");
    element("secret").click();
    expect(element("object").value === "secret" && !element("guesses").hidden, "no secret object can be guessed");
    expect(!text("verdict").includes(element("object").options[0].text), "the secret is out");
    for (let i = 0; i < 5; i += 1) element("touch").click();
    document.querySelector("[data-guess]").click();
    expect(/^(Right|Wrong): it is /.test(text("answer")), `a guess gets the answer "${text("answer")}"`);
    expect(element("object").value !== "secret" && length > 2, "the secret stays one after the guess");
    const models = element("model");
    if (models) {
      for (const option of [...models.options].reverse()) {
        choose(models, option.value);
        expect(rows("bars").length >= 2, `model ${option.text} has no bars`);
      }
    }
    if (element("where")) {
      await does("the plan", () => element("where").click());
      expect(text("proposal").includes("pose"), "the plan proposes nothing");
      const before = rows("touches").length;
      element("planned").click();
      expect(rows("touches").length === before + 1, "no approach is where planned");
    }
    element("series").click();
    await waitFor(() => text("series") !== "Stop", "the rounds do not end");
    expect(text("rounds") === "100 rounds played.", `it says "${text("rounds")}"`);
    for (const row of rows("models")) {
      // Within a factor of two: a hundred rounds.
      const [mean, expected] = [5, 6].map((column) => parseFloat(row.cells[column].textContent.replaceAll(",", "")));
      expect(mean > expected / 2 && mean < expected * 2, `${row.cells[0].textContent} needs ${mean} approaches, expected ${expected}`);
    }
    slide("noise", 20);
    expect(text("rounds") === "" && text("condition").includes("other settings"), "more noise does not begin another series");
    slide("bent2", -4);
    expect(document.querySelectorAll(".slider output")[2].textContent === "4.0 ms late", "a slider does not say where it is");
    return verdict;
  };

  addEventListener("load", async () => {
    let done = "";
    try {
      await pause(200);
      // A trace that was changed is only to be seen.
      const { expect: kind } = document.documentElement.dataset;
      done = kind === "table" ? await press() : `${kind === "wrong" ? "" : await play()} ${compare()}`;
    } catch (error) {
      wrong.push(`${error} ${error.stack?.split("\n")[1] ?? ""}`);
    }
    for (const entry of performance.getEntriesByType("resource")) {
      if (!/^(data|blob|about):/.test(entry.name)) wrong.push(`request: ${entry.name}`);
    }
    document.title = wrong.length ? `WRONG ${wrong.join(" | ").replaceAll("<", "")}` : `RIGHT ${done}`;
  });
})();
