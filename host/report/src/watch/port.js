"use strict";
// A serial port and what is on it. `heard` gets what happened on the chip, `became` each change of the port: "opening", "open",
// "closed", or "lost" or "refused" with the reason.
function openCable(link, heard, became) {
  const TICK = 100;
  let port = null, baudRate = 0, writer = null, reader = null;
  // Whether the port is to be open, and whether it was until it went away.
  let wanted = false, isLost = false;

  // A line that takes no bytes is a line that is gone.
  const act = ({ line, heard: happened }) => {
    if (line.length) writer?.write(line).catch(() => reader?.cancel().catch(() => {}));
    happened.forEach(heard);
  };
  const read = async () => {
    // An error that is not the end of the port (a framing error, a full buffer) leaves another stream to read from.
    let reason = null;
    while (wanted && port.readable) {
      reader = port.readable.getReader();
      try {
        for (;;) {
          const { value, done } = await reader.read();
          if (done) return reason;
          act(link.receive(value));
        }
      } catch (error) {
        reason = error;
      } finally {
        reader.releaseLock();
        reader = null;
      }
    }
    return reason;
  };
  const run = async (tries) => {
    for (;;) {
      became("opening");
      try {
        await port.open({ baudRate, bufferSize: 4096 });
        break;
      } catch (error) {
        // Just plugged in, a port may not be ready yet.
        if (!wanted) return became("closed");
        if ((tries -= 1) <= 0) {
          wanted = false;
          return became("refused", error);
        }
        await new Promise((resume) => setTimeout(resume, 500));
      }
    }
    writer = port.writable.getWriter();
    became("open");
    // A number that no other host takes.
    act(link.connect(crypto.getRandomValues(new Uint32Array(1))[0]));
    const ticking = setInterval(() => act(link.tick()), TICK);
    const reason = await read();
    clearInterval(ticking);
    writer.releaseLock();
    writer = null;
    // A port that is gone is closed.
    await port.close().catch(() => {});
    isLost = wanted;
    wanted = false;
    became(isLost ? "lost" : "closed", reason);
  };
  const begin = (tries) => {
    [wanted, isLost] = [true, false];
    return run(tries);
  };
  // A cable that is plugged in again: the same kind of port, which for some browsers is another object.
  const kind = (one) => JSON.stringify(one.getInfo());
  navigator.serial.addEventListener("connect", ({ target }) => {
    if (!isLost || kind(target) !== kind(port)) return;
    port = target;
    begin(6);
  });
  return {
    // To be called by a visitor's click, as browsers want it.
    connect: async (baud) => {
      try {
        port = await navigator.serial.requestPort();
      } catch (error) {
        // Nothing was chosen: nothing happens.
        if (error.name !== "NotFoundError") became("refused", error);
        return;
      }
      baudRate = baud;
      await begin(1);
    },
    disconnect: async () => {
      wanted = false;
      await reader?.cancel().catch(() => {});
    },
    reset: () => act(link.reset()),
    get isOpen() { return wanted; },
  };
}
