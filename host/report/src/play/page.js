"use strict";
(() => {
  const { data, game } = openPage();
  if (!game) return;
  const element = (id) => document.getElementById(id);
  const noise = structuredClone(data.noise);
  const random = (below) => Math.floor(Math.random() * below);
  const milliseconds = (micros) => (micros === null ? "–" : (micros / 1000).toFixed(1));
  const fill = (row, texts) => texts.forEach((text, column) => { row.cells[column].textContent = text; });

  // What is on the table.
  let object = 0, secret = false, model = 0, approaches = 0;
  const name = () => data.objects[object].name;
  const picture = openPicture(data, (point, direction) => {
    play(() => game.touchAlong(point, direction, Math.random() * Math.PI));
  });
  const shapes = data.objects.map(() => null);
  const shape = () => (shapes[object] ??= [game.vertices(object), game.triangles(object)]);

  // One bar for each object that the shown model can name.
  let bars;
  const showModel = () => {
    const { objects, known } = data.models[model];
    bars = openBars(objects.slice(0, known));
  };
  const said = ({ verdict, best }, index) => {
    if (verdict === "recognized") return data.models[index].objects[best];
    return verdict === "unknown" ? "no object it knows" : verdict;
  };
  const showBars = () => {
    const player = game.player(model);
    const { objects } = data.models[model];
    bars(player.posteriors, player.thresholds, player.touches > 0 ? player.best : null, player.verdict === "recognized");
    const count = `${player.approaches} approach${player.approaches === 1 ? "" : "es"}, ${player.touches} of them evidence`;
    element("verdict").textContent = {
      undecided: player.touches === 0 ? `Undecided: nothing is known yet. ${count}.`
        : `Undecided after ${count}: ${objects[player.best]} leads with ${percent(player.posteriors[player.best])} %.`,
      recognized: `Recognized: ${objects[player.best]}, after ${count}.`
        + (secret ? "" : objects[player.best] === name() ? " Right." : ` Wrong: it is ${name()}.`),
      unknown: `It is no object that the model knows, says the model after ${count}.`,
      "gave up": `The model gave up after ${count}.`,
    }[player.verdict];
    element("verdict").dataset.verdict = player.verdict;
  };
  const tables = [...element("models").tBodies[0].rows];
  const showModels = () => tables.forEach((row, index) => {
    const player = game.player(index);
    const leads = player.touches === 0 ? "nothing yet" : `${data.models[index].objects[player.best]}?`;
    row.cells[1].textContent = player.verdict === "undecided" ? leads : said(player, index);
    const right = player.verdict === "recognized" && data.models[index].objects[player.best] === name();
    row.cells[1].className = player.verdict === "undecided" ? "" : right && !secret ? "right" : secret ? "done" : "miss";
    row.cells[2].textContent = `${percent(player.posteriors[player.best])} %`;
    row.cells[3].textContent = player.approaches;
    row.cells[4].textContent = player.touches;
  });
  const showProposal = () => {
    if (!element("where")) return;
    const planner = data.models[model].plan ? model : data.models.findIndex(({ plan }) => plan);
    const proposal = element("where").checked ? game.propose(planner) : null;
    picture.propose(proposal);
    const from = (direction) => {
      const sides = [["left", "right"], ["front", "back"], ["below", "above"]];
      const words = direction.map((part, axis) => (Math.abs(part) < 0.3 ? "" : sides[axis][part > 0 ? 0 : 1])).filter(Boolean);
      return words.join(" and ");
    };
    element("proposal").textContent = proposal
      ? `Plan of \u201c${data.models[planner].name}\u201d: approach from ${from(proposal.direction)} (pose ${proposal.pose}). It separates the remaining objects by ${proposal.score.toFixed(2)} (1 = fully).`
      : "";
  };
  const MOST_ROWS = 200;
  // Which fingers had the object in their way, and the hand stopped before: after the first contact, or before any.
  const because = (unreached) => ["stroke", "travel"].map((reason) => {
    const fingers = [1, 2, 3].filter((finger) => unreached[finger - 1] === reason);
    return fingers.length ? `; finger ${fingers.join(" and ")} beyond the ${reason}` : "";
  }).join("");
  const list = ({ times, pattern, unreached }) => {
    // A pattern stays on one line, so that rows are as high as each other.
    const row = rowOf([approaches, ...times.map(milliseconds), pattern.replaceAll(" ", "\u00a0") + because(unreached)], 0);
    [0, 1, 2, 3].forEach((column) => row.cells[column].classList.add("number"));
    const body = element("touches").tBodies[0];
    body.prepend(row);
    if (body.rows.length > MOST_ROWS) body.lastElementChild.remove();
  };
  const update = () => {
    showBars();
    showModels();
    showProposal();
  };
  // Makes one approach, or says that there was none.
  const play = (act, atOnce = false) => {
    const approached = act();
    if (!approached) return false;
    approaches += 1;
    list(approached);
    picture.approach(approached, atOnce);
    update();
    return true;
  };
  const isDone = () => game.player(model).verdict !== "undecided";

  const begin = () => {
    stop();
    game.begin(object, random(2 ** 31));
    approaches = 0;
    element("touches").tBodies[0].replaceChildren();
    element("answer").textContent = "";
    element("guesses").hidden = !secret;
    element("object").value = secret ? "secret" : object;
    picture.clear();
    picture.show(...shape(), secret);
    update();
  };
  element("object").addEventListener("change", ({ target }) => {
    secret = target.value === "secret";
    object = secret ? random(data.objects.length) : Number(target.value);
    begin();
  });
  element("secret").addEventListener("click", () => {
    secret = true;
    object = random(data.objects.length);
    begin();
    element("answer").textContent = "An object was picked. Touch it, and guess.";
  });
  for (const button of document.querySelectorAll("[data-guess]")) {
    button.addEventListener("click", () => {
      const guess = data.objects[button.dataset.guess].name;
      const player = game.player(model);
      const machine = player.verdict === "undecided" ? "The model does not know yet." : `The model says: ${said(player, model)}, after ${player.approaches}.`;
      const answer = `${guess === name() ? "Right" : "Wrong"}: it is ${name()}. You guessed after ${approaches} approaches. ${machine}`;
      secret = false;
      element("guesses").hidden = true;
      element("object").value = object;
      picture.reveal?.();
      element("answer").textContent = answer;
      update();
    });
  }
  element("again").addEventListener("click", begin);
  element("model")?.addEventListener("change", ({ target }) => {
    model = Number(target.value);
    showModel();
    update();
  });
  element("where")?.addEventListener("change", showProposal);
  element("planned")?.addEventListener("click", () => {
    const planner = data.models[model].plan ? model : data.models.findIndex(({ plan }) => plan);
    play(() => game.touchAsPlanned(planner));
  });

  // Held down, the button goes on.
  let going = null;
  const stop = () => {
    clearInterval(going);
    going = null;
    element("until").textContent = "Touch until sure";
  };
  const touch = element("touch");
  const atRandom = (atOnce) => play(game.touchAtRandom, atOnce);
  touch.addEventListener("click", () => atRandom(false));
  let held = null;
  touch.addEventListener("pointerdown", () => {
    held = setTimeout(() => { going ??= setInterval(() => atRandom(true), 60); }, 400);
  });
  for (const end of ["pointerup", "pointerleave", "pointercancel"]) {
    touch.addEventListener(end, () => {
      clearTimeout(held);
      if (going !== null) stop();
    });
  }
  element("until").addEventListener("click", () => {
    if (going !== null) return stop();
    if (isDone()) begin();
    element("until").textContent = "Stop";
    going = setInterval(() => {
      atRandom(true);
      if (isDone()) stop();
    }, 60);
  });

  // What the sensor adds.
  const showNoise = () => {
    const text = (micros) => `${(Math.abs(micros) / 1000).toFixed(1)} ms`;
    const offset = (early) => (early === 0 ? text(early) : `${text(early)} ${early > 0 ? "early" : "late"}`);
    const outputs = [...document.querySelectorAll(".slider output")];
    outputs[0].textContent = text(noise.deviation.largest);
    noise.bent.forEach((early, finger) => { outputs[finger + 1].textContent = offset(early); });
  };
  ["noise", "bent1", "bent2", "bent3"].forEach((id, index) => element(id).addEventListener("input", ({ target }) => {
    if (index === 0) noise.deviation.largest = 1000 * target.value;
    else noise.bent[index - 1] = 1000 * target.value;
    game.setNoise(noise);
    showNoise();
  }));

  // The model that uses most touches and no pose first: the one to use.
  model = Number(element("model")?.value ?? 0);
  showModel();
  showNoise();
  begin();
})();
