"use strict";
// The host's end of the link: bytes from the line go in, bytes for the line and what happened come out. The module imports
// nothing, so it can do nothing but compute.
function openLink(wasm) {
  const bytes = Uint8Array.from(atob(wasm), (letter) => letter.charCodeAt(0));
  const { exports } = new WebAssembly.Instance(new WebAssembly.Module(bytes));
  const copy = (at, length) => new Uint8Array(exports.memory.buffer, at, length).slice();
  const now = () => performance.now() * 1000;
  const done = () => ({
    line: copy(exports.line(), exports.line_length()),
    heard: JSON.parse(new TextDecoder().decode(copy(exports.heard(), exports.heard_length()))),
  });
  return {
    connect: (session) => (exports.connect(session, now()), done()),
    receive: (chunk) => {
      // The call may move the memory, so it comes first.
      const at = exports.input(chunk.length);
      new Uint8Array(exports.memory.buffer, at, chunk.length).set(chunk);
      exports.receive(now());
      return done();
    },
    tick: () => (exports.tick(now()), done()),
    reset: () => (exports.reset(now()), done()),
    garbled: () => exports.garbled(),
  };
}
