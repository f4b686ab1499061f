// Uses a page of `palpate watch`: stands in for `navigator.serial`, with a visitor for each case. A trial begins before the
// page's own scripts. `given.first` and `given.second` hold a chip's bytes in two sessions, `given.shown` what the page showed
// after each.
const loaded = new Promise((resume) => addEventListener("load", resume));
const first = Uint8Array.from(given.first ?? []), second = Uint8Array.from(given.second ?? []);

// A port as browsers have it: a fatal error takes its streams away, another one leaves a new one.
class StubPort {
  constructor(plug, product = 1) { Object.assign(this, { plug, product, readable: null, writable: null }); }
  getInfo() { return { usbVendorId: 0x403, usbProductId: this.product }; }
  async open({ baudRate }) {
    if (this.readable) throw new DOMException("The port is already open.", "InvalidStateError");
    if (this.plug.refuses > 0) this.plug.refuses -= 1;
    else this.isReady = true;
    if (!this.isReady) throw new DOMException("Failed to open serial port.", "NetworkError");
    this.baudRate = baudRate;
    this.writable = new WritableStream({ write: (bytes) => this.plug.write?.(bytes, this) });
    this.stream();
    this.plug.sessions = (this.plug.sessions ?? 0) + 1;
    await this.plug.opened?.(this);
  }
  stream() { this.readable = new ReadableStream({ start: (controller) => { this.controller = controller; }, cancel: () => this.plug.cancelled?.() }); }
  push(bytes) { this.controller.enqueue(bytes); }
  hiccup() {
    const { controller } = this;
    this.stream();
    controller.error(new DOMException("Framing error.", "FramingError"));
  }
  pull() {
    [this.readable, this.writable] = [null, null];
    this.controller.error(new DOMException("The device has been lost.", "NetworkError"));
  }
  async close() {
    if (this.readable?.locked || this.writable?.locked) throw new TypeError("A stream of the port is locked.");
    [this.readable, this.writable] = [null, null];
  }
}
const plugIn = (plug) => {
  const port = new StubPort(plug), listeners = [];
  let sessions = 0;
  crypto.getRandomValues = (array) => array.fill(0x5eed0001 + sessions++);
  const serial = {
    requestPort: async () => {
      if (plug.cancels) throw new DOMException("No port selected by the user.", "NotFoundError");
      return port;
    },
    addEventListener: (kind, listener) => { if (kind === "connect") listeners.push(listener); },
  };
  Object.defineProperty(navigator, "serial", { value: serial });
  return { port, connect: (target = port) => listeners.forEach((listener) => listener({ target })) };
};

const cells = (id) => [...element(id).tBodies[0].rows].map((row) => [...row.cells].map((cell) => cell.textContent));
const shown = () => ({
  chip: text("chip"), verdict: text("verdict"), scale: text("scale"), bars: cells("bars").map(([name, , share]) => [name, share]),
  touches: cells("touches"),
});
const LINE = /^The line: (?:(\d+) reports? of the chip w\w+ lost on the way)?(?:; )?(?:(\d+) frames? failed \w+ checksums? and w\w+ dropped)?\.$/;
const line = () => (LINE.exec(text("line")) ?? [0, 0, 0]).slice(1).map((count) => Number(count ?? 0));

const pieces = (bytes, size) => Array.from({ length: Math.ceil(bytes.length / size) }, (_, at) => bytes.slice(at * size, (at + 1) * size));
// Tells a recording once it is asked.
const replay = (chunks) => {
  let told = false;
  return { write: (_, port) => { if (!told) chunks.forEach((chunk) => port.push(chunk)); told = true; } };
};
const same = (own, other, what) => {
  for (const key of Object.keys(other)) {
    const [a, b] = [own[key], other[key]].map((value) => JSON.stringify(value));
    if (a !== b) fault(`${what}: ${key} is ${a}, not ${b}`);
  }
};
// The chip's first session, however its bytes come: the page must show the same.
const shows = async (chunks) => {
  const { port } = plugIn(replay(chunks));
  await loaded;
  element("connect").click();
  await waitFor(() => JSON.stringify(shown()) === JSON.stringify(given.shown[0]), "it does not show what was recorded");
  same(shown(), given.shown[0], "recorded");
  expect(port.baudRate === 115200, "another baud rate");
  expect(text("state") === "Connected." && text("connect") === "Disconnect", `the state is "${text("state")}"`);
  return port;
};
const frames = (bytes) => {
  const all = [];
  for (let at = 0; at < bytes.length;) {
    const end = bytes.indexOf(0, at);
    if (end < 0) break;
    if (end > at) all.push([at, end]);
    at = end + 1;
  }
  return all;
};
// COBS.
const decoded = (frame) => {
  const bytes = [];
  for (let at = 0; at < frame.length;) {
    const code = frame[at];
    bytes.push(...frame.subarray(at + 1, at + code));
    if ((at += code) < frame.length && code < 255) bytes.push(0);
  }
  return bytes;
};
const joined = (...parts) => Uint8Array.from(parts.flatMap((part) => [...part]));

const TRIES = {
  none: async () => {
    delete Navigator.prototype.serial;
    await loaded;
    expect(/Chrome, Edge and Opera.*Firefox from version 151/.test(text("failure")), `it says "${text("failure")}"`);
    expect([...document.querySelectorAll("button, input")].every(({ disabled }) => disabled), "a control is not disabled");
  },
  cancelled: async () => {
    plugIn({ cancels: true });
    await loaded;
    element("connect").click();
    await pause(100);
    expect(text("state") === "Not connected." && text("connect") === "Connect", `the state is "${text("state")}"`);
    element("baud").value = "fast";
    element("connect").click();
    expect(text("state").startsWith("The baud rate must be"), "a baud rate that is none is taken");
  },
  busy: async () => {
    plugIn({ refuses: 1 });
    await loaded;
    element("connect").click();
    await waitFor(() => text("state").startsWith("The port cannot be opened (Failed to open serial port)"), "it does not say why");
    expect(!element("connect").disabled && text("connect") === "Connect", "it cannot be tried again");
    element("connect").click();
    await waitFor(() => text("state").startsWith("The port is open"), "it does not open when the port is free");
  },
  silent: async () => {
    const written = [];
    plugIn({ write: (bytes) => written.push(...bytes) });
    await loaded;
    element("connect").click();
    await waitFor(() => text("state").includes("the chip does not answer"), "it does not say that the chip is silent");
    expect(frames(written).length >= 3, "the chip is not asked again");
    element("connect").click();
    await waitFor(() => text("state") === "Not connected.", "it does not disconnect");
  },
  whole: async () => {
    const port = await shows([first]);
    element("connect").click();
    await waitFor(() => text("state") === "Not connected.", "it does not disconnect");
    expect(port.readable === null, "the port is not closed");
  },
  bytes: async () => { await shows(pieces(first, 1)); },
  sevens: async () => { await shows(pieces(first, 7)); },
  thresholds: async () => {
    await shows([first]);
    const lines = [...document.querySelectorAll("#bars .line")].map(({ style }) => parseFloat(style.left));
    expect(lines.length === given.shown[0].bars.length && lines.every((at) => at > 50 && at < 100), `thresholds at ${lines}`);
    expect(text("warning") === "", `it warns: ${text("warning")}`);
  },
  other: async () => {
    await shows([first]);
    expect(text("warning").startsWith("The chip has another model than this page"), `it warns: "${text("warning")}"`);
    expect(!document.querySelector("#bars .line"), "thresholds of another model are drawn");
  },
  garbage: async () => {
    const noise = Array.from({ length: 700 }, (_, at) => (at * 7919 + (at >> 3) * 104729) % 256);
    const [[from, to]] = frames(first).slice(-1);
    // The end of a frame, as of a chip that was speaking already.
    await shows([joined(noise, [0], first.slice((from + to) >> 1, to + 1)), first]);
    expect(line()[1] > 0 && line()[0] === 0, `the line is "${text("line")}"`);
  },
  changed: async () => {
    const expected = given.shown[0].touches.length - 1;
    // Message 2 is an event, after version and session; then comes its number. The chip may have repeated it: all copies are changed.
    const events = frames(first).map(([from, to]) => [decoded(first.subarray(from, to)), to]).filter(([frame]) => frame[5] === 2);
    const [{ 6: number }] = events[events.length >> 1], copies = events.filter(([frame]) => frame[6] === number);
    const bytes = first.slice();
    for (const [, to] of copies) bytes[to - 3] ^= bytes[to - 3] === 1 ? 2 : 1;
    plugIn(replay([bytes]));
    await loaded;
    element("connect").click();
    await waitFor(() => line()[1] === copies.length, "not each frame that fails its checksum is counted");
    await waitFor(() => cells("touches").length === expected, "not one touch is missing");
    expect(line()[0] === 1, `the line is "${text("line")}"`);
    expect(text("failure") === "" && text("state") === "Connected.", "it does not go on");
  },
  hiccups: async () => {
    const { port } = plugIn({ write: () => {} });
    await loaded;
    element("connect").click();
    await waitFor(() => port.readable?.locked, "it does not read");
    for (const chunk of pieces(first, Math.ceil(first.length / 5))) {
      port.push(chunk);
      await pause(30);
      port.hiccup();
      await waitFor(() => port.readable.locked, "it does not go on after a framing error");
    }
    await waitFor(() => JSON.stringify(shown()) === JSON.stringify(given.shown[0]), "it does not show what was recorded");
  },
  pulled: async () => {
    const last = frames(first).slice(-1)[0];
    const plug = { write: (_, port) => {
      if (plug.told === plug.sessions) return;
      plug.told = plug.sessions;
      port.push(plug.sessions === 1 ? first.slice(0, (last[0] + last[1]) >> 1) : second);
    } };
    const { port, connect } = plugIn(plug);
    await loaded;
    element("connect").click();
    await waitFor(() => cells("touches").length === given.shown[0].touches.length, "touches are missing");
    port.pull();
    await waitFor(() => text("state").startsWith("The port is gone (The device has been lost)"), "it does not notice");
    expect(text("connect") === "Connect" && element("reset").disabled, "the buttons do not suit");
    expect(cells("touches").length === given.shown[0].touches.length, "the touches are gone");
    connect(new StubPort({}, 2));
    await pause(50);
    expect(element("state").dataset.state === "lost", "another device is taken for the chip");
    // As where the system takes a moment to let a port be opened.
    plug.refuses = 1;
    connect(new StubPort(plug));
    await waitFor(() => JSON.stringify(shown()) === JSON.stringify(given.shown[1]), "it does not go on where it was");
    same(shown(), given.shown[1], "plugged in again");
    expect(line()[0] === 0, `touches that were made without the cable are lost; the line is "${text("line")}"`);
  },
  cuts: async () => {
    await loaded;
    const { wasm } = JSON.parse(text("data"));
    const module = new WebAssembly.Module(Uint8Array.from(atob(wasm), (letter) => letter.charCodeAt(0)));
    WebAssembly.Module = function () { return module; };
    const heard = (chunks) => {
      const link = openLink(wasm);
      link.connect(0x5eed0001);
      return JSON.stringify(chunks.flatMap((chunk) => link.receive(chunk).heard));
    };
    const whole = heard([first]);
    expect(JSON.parse(whole).filter(({ is }) => is === "touch").length > 5, `only this is heard: ${whole.slice(0, 300)}`);
    let differing = 0;
    for (let at = 1; at < first.length; at += 1) {
      if (heard([first.subarray(0, at), first.subarray(at)]) !== whole && (differing += 1) === 1) fault(`cut at byte ${at}, other things are heard`);
    }
    expect(differing === 0, `${differing} of ${first.length - 1} cuts change what is heard`);
    return `${first.length - 1} cuts`;
  },
  // Instead of frames, the line has JSON.
  seldom: async () => {
    const memory = { buffer: new ArrayBuffer(65536) };
    let length = 0;
    const tell = (heard) => { length = new TextEncoder().encodeInto(heard, new Uint8Array(memory.buffer)).written; };
    WebAssembly.Instance = function () {
      const none = () => 0, nothing = () => tell("[]");
      return { exports: {
        memory, line: none, line_length: none, garbled: none, heard: none, heard_length: () => length, connect: nothing, tick: nothing,
        reset: () => tell('[{"is":"reset"}]'), input: (count) => { length = count; return 0; }, receive: none,
      } };
    };
    const { port } = plugIn({});
    await loaded;
    const say = async (...heard) => {
      port.push(new TextEncoder().encode(JSON.stringify(heard)));
      await pause(50);
    };
    const newest = () => cells("touches")[0].join(" ");
    element("connect").click();
    await waitFor(() => port.readable?.locked, "it does not read");
    const touch = { is: "touch", times: [0, null, 12345], verdict: "undecided", object: 2, touches: 1 };
    await say(touch);
    expect(newest() === "1 0.000 – 12.345 perhaps object 3", `a touch of an unknown model is "${newest()}"`);
    await say({ is: "connected" }, { is: "no-model", why: "the chip has no model: load one" }, { is: "refused", times: [null, 0, null], why: "the chip has no model: load one" });
    expect(text("warning").startsWith("No verdicts: the chip has no model"), `without a model it says "${text("warning")}"`);
    expect(newest().startsWith("2 – 0.000 – not counted"), `a touch without a model is "${newest()}"`);
    await say({ is: "version", theirs: 3, ours: 4 });
    expect(text("warning").startsWith("The chip speaks version 3 of the link, this page version 4"), "another version is not told");
    await say({ is: "fault", finger: 1, what: "stuck closed" });
    expect(newest().trim() === "fault: middle finger: stuck closed", `a fault is "${newest()}"`);
    await say({ is: "started" }, { is: "model", checksum: 7, length: 100, objects: ["<b>cup</b>", "bowl"] }, { is: "missed", count: 1 });
    expect(text("verdict") === "Nothing has been touched yet." && text("warning") === "", "a chip that was started has verdicts");
    expect(text("line") === "The line: 1 report of the chip was lost on the way.", `the line is "${text("line")}"`);
    expect(cells("bars")[0][0] === "<b>cup</b>", "a name is markup");
    await say({ ...touch, verdict: "unknown", touches: 9, object: 1 });
    expect(text("verdict") === "No object that the model knows, after 9 touches.", `unknown is "${text("verdict")}"`);
    await say({ ...touch, verdict: "gave-up", touches: 1, object: 1 });
    expect(newest().endsWith("gave up") && text("verdict") === "Gave up after 1 touch.", `giving up is "${text("verdict")}"`);
    await say({ ...touch, times: [null, null, null] });
    expect(text("scale") === "The last approach touched nothing.", "a miss is drawn");
    element("reset").click();
    await pause(50);
    expect(newest().trim() === "another object", "another object does not begin");
    await say({ is: "silent" });
    expect(text("state").startsWith("The chip has not answered for half a minute"), "silence is not told");
  },
  // Touches are played on an emulated chip's pins; its serial port is passed on.
  chip: async () => {
    const { parts, says, isNew, shown: [before, after] } = given;
    const calls = [];
    globalThis.answered = ([id, answer]) => calls[id](answer);
    const ask = (what, value) => new Promise((resolve) => globalThis.ask(JSON.stringify({ id: calls.push(resolve) - 1, what, value })));
    const { connect, port } = plugIn({ opened: () => ask("open"), write: (bytes) => ask("write", [...bytes]), cancelled: () => ask("pull") });
    globalThis.happens = ([event, bytes]) => {
      if (event === "heard") port.push(Uint8Array.from(bytes));
      else if (port.readable) port.pull();
    };
    await loaded;
    element("connect").click();
    await waitFor(() => element("state").dataset.state === "open" && text("chip").includes("gpio") && text("chip").includes("model"), "the emulated chip does not answer");
    expect(document.querySelectorAll("#bars .line").length === cells("bars").length && text("warning") === "", `it warns: ${text("warning")}`);
    const settled = async (rows, expected, what) => {
      await waitFor(() => cells("touches").length >= rows, `${what}: ${rows} touches do not come`);
      if (!expected) return pause(3000);
      await waitFor(() => JSON.stringify(shown()) === JSON.stringify(expected), what);
      same(shown(), expected, what);
    };
    await ask("touch", 1);
    await settled(parts[0].length, before, "before the cable is pulled");
    const first = shown();
    await ask("pull");
    await waitFor(() => element("state").dataset.state === "lost", "it does not notice that the cable is pulled");
    await ask("touch", 2);
    await pause(1500);
    connect();
    await waitFor(() => element("state").dataset.state === "open", "the chip does not answer again");
    await ask("touch", 3);
    // The chip keeps those that were made without the cable.
    await settled(parts.flat().length, after, "after the cable was pulled");
    const second = shown();
    // What was played, and what the program makes of it.
    const told = (at) => {
      const times = parts.flat()[at].split(" ").map((seconds) => (seconds === "-" ? "–" : (1000 * seconds).toFixed(3)));
      const [, touches, verdict, name] = /^ *(\d+) +(undecided|recognized|not counted.*?) *(?: (\S+) [\d.]+)?$/.exec(says[at]);
      return [...times, { undecided: `perhaps ${name}`, recognized: `recognized ${name} after ${touches} touches` }[verdict] ?? verdict].join(" ");
    };
    second.touches.toReversed().forEach(([, ...own], row) => expect(own.join(" ") === told(row), `touch ${row + 1} is "${own.join(" ")}", the program's "${told(row)}"`));
    const [, name, posterior] = / (\S+) ([\d.]+)$/.exec(says.findLast((line) => line.includes("undecided")));
    const [, bar] = second.bars.find(([label]) => label === name);
    expect(Math.abs(bar - 100 * posterior) < 0.06, `the posterior of ${name} is ${bar} %, the program's ${posterior}`);
    element("reset").click();
    await waitFor(() => cells("touches")[0][4] === "another object" && /^Nothing/.test(text("verdict")), "the chip does not begin another object");
    expect(line()[0] === 0, `touches that were made without the cable are lost; the line is "${text("line")}"`);
    await ask("keep", [first, second]);
    return `${second.touches.length} touches, ${parts[1].length} of them without the cable`;
  },
};
const running = TRIES[given.trial]();
const visit = async () => [await running, text("state"), text("verdict")].filter(Boolean).join("; ");
