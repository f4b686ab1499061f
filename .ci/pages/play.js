// Uses a page of `palpate play`: plays as a visitor would, and compares what the page computes with what the program computed.
const choose = (select, value) => {
  select.value = value;
  select.dispatchEvent(new Event("change"));
};
const slide = (id, value) => {
  element(id).value = value;
  element(id).dispatchEvent(new Event("input"));
};
const rows = (id) => [...element(id).tBodies[0].rows];
const click = (x, y) => {
  const box = stage().getBoundingClientRect(), at = [box.left + x * box.width, box.top + y * box.height];
  point("pointerdown", ...at, 1);
  point("pointerup", ...at, 0);
};
const opens = () => {
  expect(text("failure") === "", `it says ${text("failure")}`);
  drawnOn(0.02);
};

// The page of a table.
const table = async () => {
  opens();
  await does("the choice", () => element("next").click());
  expect(rows("touches").length === 1 && rows("ghosts").length > 0, "an approach enters no list, or nothing is believed");
  await does("a click on the table", () => click(0.5, 0.5));
  expect(rows("touches").length === 2, "a click on the table is no approach");
  await does("the key R", () => press("r"));
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

const game = async () => {
  opens();
  await does("touching at random", () => element("touch").click());
  expect(rows("touches").length === 1, "a touch does not enter the list");
  for (const key of ["ArrowLeft", "ArrowUp", "+"]) {
    await does(`the key ${key}`, () => press(key));
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
  slide("noise", 20);
  slide("bent2", -4);
  expect(document.querySelectorAll(".slider output")[2].textContent === "4.0 ms late", "a slider does not say where it is");
  return verdict;
};

// Lines of a trace that the page computes differently, each with the page's own.
const differing = (lines) => {
  const data = JSON.parse(text("data"));
  const game = openGame(data);
  const codes = ["undecided", "recognized", "unknown", "gave up"];
  let round = "";
  return lines.flatMap((line) => {
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
    return own === line ? [] : [[own, line]];
  });
};
const compare = () => {
  const lines = given.trace.trim().split("\n");
  const others = differing(lines);
  if (others.length) expect(false, `${others.length} of ${lines.length} touches differ: the page computes "${others[0][0]}", the program "${others[0][1]}"`);
  expect(lines.length >= 10000, `only ${lines.length} touches were compared`);
  // One digit changed in a round: a comparison that does not see it is none.
  const [object, seed] = lines[4999].split(" ");
  const round = lines.filter((line) => line.startsWith(`${object} ${seed} `));
  round.push(round.pop().replace(/.$/, "x"));
  expect(differing(round).length === 1, "a touch that differs from the program's is not seen");
  return `${lines.length} touches and what models make of them are the program's`;
};

const visit = async () => (given.trial === "table" ? table() : `${await game()} ${compare()}`);
