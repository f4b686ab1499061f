"use strict";
// The page's data and game; without a game the page says why.
function openPage() {
  const data = JSON.parse(document.getElementById("data").textContent);
  try {
    return { data, game: openGame(data) };
  } catch (error) {
    document.getElementById("failure").textContent = typeof WebAssembly === "object"
      ? `This page cannot be played here: ${error.message}.`
      : "This browser does not offer WebAssembly, so objects cannot be touched here. Any browser of the last years does.";
    for (const control of document.querySelectorAll("button, select, input")) control.disabled = true;
    return { data };
  }
}
function percent(share) {
  return (100 * share).toFixed(share > 0.9995 ? 2 : 1);
}
// A row of a table, with a heading in one column.
function rowOf(texts, heading, kind = "") {
  const row = document.createElement("tr");
  texts.forEach((text, column) => {
    const cell = document.createElement(heading === column ? "th" : "td");
    if (heading === column) cell.scope = "row";
    cell.textContent = text;
    cell.className = kind;
    row.append(cell);
  });
  return row;
}
// One bar for each label in the table of bars. Returns what shows posteriors, their thresholds, and which leads and is named.
function openBars(labels) {
  const bars = labels.map((label) => {
    const row = rowOf([label, "", ""], 0);
    const track = Object.assign(document.createElement("div"), { className: "track" });
    const bar = Object.assign(document.createElement("div"), { className: "bar" });
    const line = Object.assign(document.createElement("div"), { className: "line" });
    track.setAttribute("aria-hidden", "true");
    track.append(bar, line);
    row.cells[1].append(track);
    row.cells[2].className = "number";
    return { row, bar, line };
  });
  document.getElementById("bars").tBodies[0].replaceChildren(...bars.map(({ row }) => row));
  return (posteriors, thresholds, leader, isNamed) => bars.forEach(({ row, bar, line }, index) => {
    bar.style.width = `${100 * posteriors[index]}%`;
    line.style.left = `${100 * thresholds[index]}%`;
    row.cells[2].textContent = percent(posteriors[index]);
    row.classList.toggle("leads", index === leader);
    row.classList.toggle("named", isNamed && index === leader);
  });
}

// The game of data: compiles the page's WebAssembly, puts objects and models on the table, and returns what can be done.
// The module imports nothing, so it can do nothing but compute.
function openGame(data) {
  const bytes = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const { exports } = new WebAssembly.Instance(new WebAssembly.Module(bytes(data.wasm)));
  const sure = (number, what) => {
    if (number < 0) throw new Error(`${what} cannot be used`);
    return number;
  };
  // What was put out: `count` numbers.
  const taken = (count) => new Float64Array(exports.memory.buffer, exports.output(), count);
  const put = (...parts) => {
    const all = new Uint8Array(parts.reduce((sum, part) => sum + part.length, 0));
    parts.reduce((at, part) => (all.set(part, at), at + part.length), 0);
    // The call may move the memory, so it comes first.
    const at = exports.input(all.length);
    new Uint8Array(exports.memory.buffer, at, all.length).set(all);
  };

  const { radius, spacing, speed, tilt, stroke = 0, travel = 0 } = data.probe;
  sure(exports.start(data.millimeters ? 1 : 0, data.aim, radius, spacing, speed, tilt, stroke, travel), "the probe");
  // An object is put on the table when it is first needed: that takes a while. Its number there.
  const numbers = data.objects.map(() => null);
  const add = ({ name, mesh, length }) => {
    const letters = new TextEncoder().encode(name);
    put(letters, bytes(mesh));
    return sure(exports.add_object(letters.length, length), name);
  };
  const number = (object) => (numbers[object] ??= add(data.objects[object]));
  for (const model of data.models) {
    put(bytes(model.bytes));
    sure(exports.add_model(), model.name);
  }
  const setNoise = (noise) => {
    const { deviation: { least, largest }, timer, debounce, missed, bent, speed, speed_error, speed_bias, pose, pose_bias } = noise;
    const numbers = [Math.min(least, largest), largest, timer, debounce, missed, ...bent, speed, speed_error, speed_bias, pose, pose_bias];
    put(new Uint8Array(Float64Array.from(numbers).buffer));
    sure(exports.set_noise(), "the noise");
  };
  setNoise(data.noise);

  const PATTERNS = ["none", "outer", "middle", "outer and middle", "both outer", "all"];
  // What an approach put out; null where there was none.
  const approached = (done) => {
    if (done < 0) return null;
    const numbers = [...taken(22)];
    const three = (at) => numbers.slice(at, at + 3);
    const some = (at) => three(at).map((number) => (Number.isNaN(number) ? null : number));
    return {
      start: three(0), direction: three(3), alignment: three(6), distances: some(9), exact: some(12), times: some(15),
      pattern: PATTERNS[numbers[18]], unreached: three(19).map((reason) => [null, "stroke", "travel"][reason] ?? null),
    };
  };
  const VERDICTS = ["undecided", "recognized", "unknown", "gave up"];
  return {
    exports, put, bytes, taken, sure, number,
    setNoise,
    vertices: (object) => Float32Array.from(taken(sure(exports.vertices(number(object)), "an object"))),
    triangles: (object) => Uint32Array.from(taken(sure(exports.triangles(number(object)), "an object"))),
    begin: (object, seed) => sure(exports.begin(number(object), seed), "an object"),
    touchAtRandom: () => approached(exports.touch_at_random()),
    touchAsPlanned: (model) => approached(exports.touch_as_planned(model)),
    touchAlong: (point, direction, roll) => approached(exports.touch_along(...point, ...direction, roll)),
    player: (model) => {
      const count = sure(exports.player(model), "a model");
      const [verdict, best, approaches, touches, refused, ...of] = taken(5 + 2 * count);
      return {
        verdict: VERDICTS[verdict], best, approaches, touches, isEvidence: refused === 0,
        posteriors: of.slice(0, count), thresholds: of.slice(count),
      };
    },
    evidence: (model) => [...new BigInt64Array(exports.memory.buffer, exports.evidence(model), data.models[model].objects.length)],
    propose: (model) => {
      if (exports.propose(model) < 0) return null;
      const [pose, score, ...vectors] = taken(8);
      return { pose, score, direction: vectors.slice(0, 3), alignment: vectors.slice(3) };
    },
  };
}
