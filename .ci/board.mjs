// An emulated Raspberry Pi Pico with a board's image: a UART that loses and garbles bytes, fingers that touch, and the host's end
// of the link. For .ci/boards: node board.mjs EMULATOR IMAGE LINK.wasm
import { readFileSync } from "node:fs";
import { pathToFileURL } from "node:url";

const [emulator, imagePath, linkPath] = process.argv.slice(2);
const load = (path) => import(pathToFileURL(`${emulator}/dist/esm/${path}.js`));
const [{ RP2040 }, { BasePeripheral }] = await Promise.all([load("index"), load("peripherals/peripheral")]);

const BYTE = 1e10 / 115200; // nanoseconds of ten bits
const [FRAMING, PARITY, BREAK, OVERRUN] = [0x100, 0x200, 0x400, 0x800];
const [RX, TX, TIMEOUT] = [1 << 4, 1 << 5, 1 << 6];

// The PL011 of the RP2040, as its data sheet says it: queues of 32, interrupts at their levels and after 32 quiet bits, errors
// beside the bytes that have them. The emulator's own UART knows no errors, and sends in no time.
class Uart extends BasePeripheral {
  constructor(chip, irq) {
    super(chip, "UART");
    Object.assign(this, { irq, received: [], waiting: [], raw: 0, mask: 0, levels: 0x12, overrun: 0, sent: [], registers: {} });
    this.quiet = chip.clock.createAlarm(() => this.raise(TIMEOUT));
    this.shift = chip.clock.createAlarm(() => this.out());
  }
  level(at) { return [4, 8, 16, 24, 28][this.levels >> at & 7] ?? 16; }
  update() {
    this.rp2040.setInterrupt(this.irq, (this.raw & this.mask) !== 0);
    // Requests to the DMA, by the data sheet's numbers.
    const { dma } = this.rp2040, wanted = this.registers[0x48] ?? 0;
    if (wanted & 1 && this.received.length) dma.setDREQ(21);
    else dma.clearDREQ(21);
    if (wanted & 2 && this.waiting.length < 32) dma.setDREQ(20);
    else dma.clearDREQ(20);
  }
  raise(bits) {
    this.raw |= bits;
    if (this.raw & this.mask || this.registers[0x48]) this.update();
  }
  // A byte from the line, with the errors that the receiver sees.
  take(byte, errors = 0) {
    this.raw |= errors >> 1 & 0x780;
    // What does not fit is lost, and the next byte says so.
    if (errors & OVERRUN || this.received.length === 32) this.overrun = OVERRUN;
    else {
      this.received.push(byte | errors | this.overrun);
      this.overrun = 0;
    }
    this.quiet.schedule(BYTE * 3.2);
    this.raise(this.received.length >= this.level(3) ? RX : 0);
  }
  out() {
    this.sent.push(this.waiting.shift());
    if (this.waiting.length) this.shift.schedule(BYTE);
    this.raise(this.waiting.length === this.level(0) ? TX : 0);
  }
  readUint32(offset) {
    switch (offset) {
      case 0x00: {
        const value = this.received.shift() ?? 0;
        if (this.received.length < this.level(3)) this.raw &= ~RX;
        if (!this.received.length) {
          this.raw &= ~TIMEOUT;
          this.quiet.cancel();
        }
        this.update();
        return value;
      }
      case 0x04: return this.overrun ? 8 : 0;
      case 0x18: return (this.received.length ? 0 : 1 << 4) | (this.waiting.length < 32 ? 0 : 1 << 5)
        | (this.received.length < 32 ? 0 : 1 << 6) | (this.waiting.length ? 1 << 3 : 1 << 7);
      case 0x34: return this.levels;
      case 0x38: return this.mask;
      case 0x3c: return this.raw;
      case 0x40: return this.raw & this.mask;
      default: return this.registers[offset] ?? 0;
    }
  }
  writeUint32(offset, value) {
    switch (offset) {
      case 0x00:
        this.waiting.push(value & 0xff);
        if (this.waiting.length === 1) this.shift.schedule(BYTE);
        break;
      case 0x04: this.overrun = 0; break;
      case 0x34: this.levels = value; break;
      case 0x38: this.mask = value; break;
      case 0x44: this.raw &= ~this.rawWriteValue; break;
      default: this.registers[offset] = value;
    }
    this.update();
  }
}

// The boot ROM's functions for flash and memory, by the names under which the ROM has them.
const FUNCTIONS = ["IF", "EX", "RE", "RP", "FC", "CX", "MS", "S4", "MC", "C4"];

// A chip with the image in its flash, running, all switches open.
const start = () => {
  const chip = new RP2040(), { clock, core } = chip;
  chip.logger = { debug() {}, info() {}, warn() {}, error() {} };
  const elf = readFileSync(imagePath), word = (at) => elf.readUInt32LE(at);
  for (let part = word(28); part < word(28) + elf.readUInt16LE(44) * 32; part += 32) {
    const [kind, from, , to, length] = [0, 4, 8, 12, 16].map((at) => word(part + at));
    if (kind === 1 && to >= 0x10000000 && to < 0x11000000) chip.flash.set(elf.subarray(from, from + length), to - 0x10000000);
  }
  const uart = new Uart(chip, 20);
  chip.uart[0] = chip.peripherals[0x40034] = uart;
  chip.bootrom[5] = 0x40 | 0x50 << 16; // tables of functions and of data
  chip.bootrom[6] = 0x61; // looks up r1 in a table
  const at = (address, half) => { chip.bootrom[address >> 2] |= half << 8 * (address & 2); };
  [...FUNCTIONS, "lookup"].forEach((name, index) => {
    const address = name === "lookup" ? 0x60 : 0x80 + 4 * index;
    at(address, 0xde00 | index); // an undefined instruction, at which the emulator calls onBreak
    at(address + 2, 0x4770); // bx lr
  });
  chip.onBreak = (index) => {
    const { registers } = core, [a, b, c] = registers;
    if (index === FUNCTIONS.length) {
      const name = String.fromCharCode(b & 0xff, b >> 8 & 0xff), found = FUNCTIONS.indexOf(name);
      if (found < 0) throw new Error(`the image asks the boot ROM for ${name}`);
      registers[0] = 0x81 + 4 * found;
    } else if (FUNCTIONS[index] === "RE") {
      chip.flash.fill(0xff, a, a + b);
      clock.tick(45e6);
    } else if (FUNCTIONS[index] === "RP") {
      for (let byte = 0; byte < c; byte += 1) chip.flash[a + byte] &= chip.readUint8(b + byte);
      clock.tick(0.7e6);
    } else if ("MS S4".includes(FUNCTIONS[index])) {
      for (let byte = 0; byte < c; byte += 1) chip.writeUint8(a + byte, b & 0xff);
    } else if ("MC C4".includes(FUNCTIONS[index])) {
      for (let byte = 0; byte < c; byte += 1) chip.writeUint8(a + byte, chip.readUint8(b + byte));
    }
  };
  core.VTOR = 0x10000100;
  core.SP = chip.flashView.getUint32(0x100, true);
  core.PC = chip.flashView.getUint32(0x104, true) & ~1;
  for (const pin of [1, 2, 3, 4, 5]) chip.gpio[pin].setInputValue(true);
  return { chip, clock, core, uart };
};

// The host's end of the link, as the page of `palpate watch` has it.
const openLink = (clock) => {
  const { exports } = new WebAssembly.Instance(new WebAssembly.Module(readFileSync(linkPath)));
  const now = () => clock.nanos / 1000;
  const copy = (at, length) => new Uint8Array(exports.memory.buffer, at, length).slice();
  const done = () => ({
    line: [...copy(exports.line(), exports.line_length())],
    heard: JSON.parse(new TextDecoder().decode(copy(exports.heard(), exports.heard_length()))),
  });
  return {
    connect: () => (exports.connect(0x5eed0001, now()), done()),
    receive: (bytes) => {
      const at = exports.input(bytes.length);
      new Uint8Array(exports.memory.buffer, at, bytes.length).set(bytes);
      exports.receive(now());
      return done();
    },
    tick: () => (exports.tick(now()), done()),
  };
};

// A bench: chip, line and time. Bytes for the chip go on the line one after the other.
class Bench {
  constructor() {
    Object.assign(this, start());
    this.awake = 0; // instructions so far
    this.line = [];
    this.wire = this.clock.createAlarm(() => this.pass());
    this.until(300);
  }
  get ms() { return this.clock.nanos / 1e6; }
  // Sends bytes, or [byte, errors] each.
  send(bytes) {
    if (!this.line.length && bytes.length) this.wire.schedule(BYTE);
    this.line.push(...bytes);
  }
  pass() {
    // The start bit's edge, which the pin sees as well.
    this.chip.gpio[1].setInputValue(false);
    this.chip.gpio[1].setInputValue(true);
    this.uart.take(...[this.line.shift()].flat());
    if (this.line.length) this.wire.schedule(BYTE);
  }
  // Lets so many milliseconds pass.
  until(ms) {
    const { clock, core } = this, end = clock.nanos + ms * 1e6;
    while (clock.nanos < end) {
      if (core.waiting) {
        const next = clock.nanosToNextAlarm;
        clock.tick(Math.max(100, Math.min(next > 0 ? next : 1e6, end - clock.nanos)));
        if (core.interruptsUpdated) core.executeInstruction();
      } else {
        clock.tick(core.executeInstruction() * 8);
        this.awake += 1;
      }
    }
  }
  // What the chip has sent.
  sent() { return this.uart.sent.splice(0); }
}

const wrong = [];
const expect = (holds, what) => { if (!holds) wrong.push(what); };
const name = imagePath.split("/").pop();

// Whole frames with the right checksum.
const CRC = (bytes) => ~bytes.reduce((crc, byte) => {
  let all = crc ^ byte;
  for (let bit = 0; bit < 8; bit += 1) all = all >>> 1 ^ (all & 1 ? 0xedb88320 : 0);
  return all;
}, ~0) >>> 0;
const frames = (bytes) => {
  let count = 0;
  for (let at = 0, end; (end = bytes.indexOf(0, at)) >= 0; at = end + 1) {
    const plain = [];
    for (let code = at; code < end; code += bytes[code]) {
      plain.push(...bytes.slice(code + 1, Math.min(code + bytes[code], end)));
      if (code + bytes[code] < end && bytes[code] < 255) plain.push(0);
    }
    const sum = plain.splice(-4);
    if (plain.length && CRC(plain) === (sum[0] | sum[1] << 8 | sum[2] << 16 | sum[3] << 24) >>> 0) count += 1;
  }
  return count;
};

const errors = () => {
  const bench = new Bench();
  const hello = openLink(bench.clock).connect().line;
  expect(frames(bench.sent()) >= 1, "the chip does not say that it has started");
  const answers = (bytes, ms = 12) => {
    bench.send(bytes);
    bench.until(bytes.length * BYTE / 1e6 + ms);
    return frames(bench.sent());
  };
  let asked = 0;
  const isAnswered = (what) => {
    asked += 1;
    // Where the end of one frame and the start of the next are lost, both are, and the host asks again.
    const is = answers(hello) > 0 || answers(hello) > 0;
    expect(is, `${what}: no answer`);
    return is;
  };
  isAnswered("a question on a clean line");
  const KINDS = { "a framing error": FRAMING, "a parity error": PARITY, "a break": BREAK | FRAMING, "a byte that was overrun": OVERRUN };
  for (const [kind, errors] of Object.entries(KINDS)) {
    for (let at = 0; at < hello.length; at += 1) {
      answers(hello.map((byte, index) => (index === at ? [errors & BREAK ? 0 : byte ^ 1, errors] : byte)));
      if (!isAnswered(`after ${kind} at byte ${at}`)) return;
    }
    answers([[0, errors]]);
    isAnswered(`after ${kind} between two questions`);
    // In time for the same read.
    expect(answers([...hello, [0, errors]]) > 0, `a question with ${kind} right behind it has no answer`);
    answers(Array.from({ length: 200 }, (_, at) => [at, at % 3 ? errors : 0]));
    // Noise has begun a frame, which the question ends.
    answers(hello);
    isAnswered(`after 200 bytes, most of them ${kind}`);
  }
  return `${asked} questions answered after errors`;
};

// Touches while the host asks without a pause: the chip tells the times at which the switches closed.
const touches = () => {
  const bench = new Bench(), link = openLink(bench.clock), heard = [], asked = [];
  const talk = (ms) => {
    for (const end = bench.ms + ms; bench.ms < end;) {
      bench.until(2);
      for (const { line, heard: happened } of [link.receive(bench.sent()), link.tick()]) {
        heard.push(...happened);
        bench.send(line);
        if (line.length) asked.push(line);
      }
    }
  };
  bench.send(link.connect().line);
  talk(800);
  expect(heard.some(({ is }) => is === "program"), `the chip does not say what it is: ${JSON.stringify(heard)}`);
  // The last question, for the posteriors, again and again: its answer is repeated. The chip is busy for 100 ms.
  const questions = Array(12).fill(asked[asked.length - 1]).flat();
  let worst = 0, told = 0;
  for (let touch = 0; touch < 4; touch += 1) {
    heard.length = 0;
    bench.send(questions);
    const began = bench.ms + 5 + touch * 3.7, order = [[2, 3, 4], [3, 4, 2], [4, 2, 3]][touch % 3];
    const moves = order.map((pin, index) => [began + [0, 7.3, 31.1][index], pin, false]).concat(order.map((pin) => [began + 60, pin, true]));
    for (const [at, pin, isOpen] of moves) {
      while (bench.ms < at) {
        bench.until(Math.min(1, at - bench.ms));
        heard.push(...link.receive(bench.sent()).heard);
      }
      bench.chip.gpio[pin].setInputValue(isOpen);
    }
    talk(400);
    const { times } = heard.find(({ is }) => is === "touch") ?? {};
    told += times ? 1 : 0;
    expect(times, `touch ${touch} is not told: ${JSON.stringify(heard)}`);
    times?.forEach((time, finger) => { worst = Math.max(worst, Math.abs(time - 1000 * [0, 7.3, 31.1][order.indexOf(finger + 2)])); });
  }
  expect(worst < 100, `contact times are off by up to ${worst} µs while the host asks`);
  return `${told} touches, times off by up to ${worst} µs`;
};

// Instructions that the chip is awake for: while nobody touches or asks, for a touch with its verdict, for a question.
const awake = () => {
  const bench = new Bench(), hello = openLink(bench.clock).connect().line;
  bench.until(2000);
  const count = (act, ms) => {
    const before = bench.awake;
    act();
    bench.until(ms);
    return bench.awake - before;
  };
  const quiet = Math.round(count(() => {}, 10_000) / 10);
  const press = (isOpen) => [2, 3, 4].forEach((pin) => bench.chip.gpio[pin].setInputValue(isOpen));
  const touch = count(() => { press(false); bench.until(60); press(true); }, 940) - quiet;
  bench.sent();
  const question = count(() => bench.send(hello), 1000) - quiet;
  expect(frames(bench.sent()) >= 1, "a question to a chip that sleeps has no answer");
  expect(quiet < 5000, `${quiet} instructions in a second in which nothing happens`);
  return `instructions awake: ${quiet} in a quiet second, ${touch} for a touch, ${question} for a question`;
};

const began = performance.now();
const notes = [errors, touches, awake].map((test) => (wrong.length ? "" : test()));
const seconds = ((performance.now() - began) / 1000).toFixed(1);
console.log(wrong.length ? wrong.map((what) => `WRONG ${name}: ${what}`).join("\n") : `${name}: right, ${seconds} s; ${notes.join("; ")}`);
process.exitCode = wrong.length ? 1 : 0;
