// An emulated chip whose serial port one can pull and plug in, on whose pins touches are played.
import { spawn } from "node:child_process";
import { readFileSync, writeFileSync } from "node:fs";
import { connect, createServer } from "node:net";
import { dirname, join } from "node:path";
import { createInterface } from "node:readline";
import { fileURLToPath } from "node:url";

const ROOT = join(dirname(fileURLToPath(import.meta.url)), "../.."), DATA = join(ROOT, "tests/data/port");
const PLAYER = join(process.env.PALPATE_BIN ?? join(ROOT, "target/release"), "player");
const IMAGE = join(ROOT, "onboard/firmware/target/thumbv7em-none-eabihf/release/gpio");
const lines = (file) => readFileSync(file, "utf8").replace(/\n$/, "").split("\n");
const touches = (part) => join(DATA, `touches-${part}.txt`);
const recorded = (session) => join(DATA, `recorded-${session}.bin`);

// Starts the chip. Returns what its trial is given, the answers to the page, and what ends the chip. With `isNew`, a recording is made of
// what the chip says and what the page shows.
export async function openChip(says, isNew) {
  const free = createServer().listen(0, "127.0.0.1");
  const port = await new Promise((resolve) => free.on("listening", () => resolve(free.address().port)));
  await new Promise((resolve) => free.close(resolve));
  const player = spawn(PLAYER, [IMAGE, `127.0.0.1:${port}`], { stdio: ["pipe", "pipe", "inherit"] }).on("error", () => {});
  const played = createInterface(player.stdout)[Symbol.asyncIterator]();
  if ((await played.next()).done) throw new Error(`${PLAYER} does not start`);
  const sessions = [];
  let line = null;
  const answers = {
    open: (_, happens) => new Promise((resolve) => {
      const said = [];
      sessions.push(said);
      line = connect(port, "127.0.0.1", resolve);
      line.on("data", (bytes) => {
        said.push(...bytes);
        happens("heard", [...bytes]);
      });
      line.on("error", () => {}).on("close", () => happens("closed"));
    }),
    write: (bytes) => { line.write(Uint8Array.from(bytes)); },
    pull: () => { line.destroy(); },
    touch: async (part) => {
      player.stdin.write(`${touches(part)}\n`);
      await played.next();
    },
    keep: (shown) => {
      if (!isNew) return;
      writeFileSync(join(DATA, "shown.json"), `${JSON.stringify(shown)}\n`);
      sessions.forEach((said, index) => writeFileSync(recorded(index + 1), Uint8Array.from(said)));
    },
  };
  const shown = isNew ? [] : JSON.parse(readFileSync(join(DATA, "shown.json"), "utf8"));
  const given = { trial: "chip", isNew, shown, parts: [1, 2, 3].map((part) => lines(touches(part))), says: lines(says) };
  return { given, answers, end: () => player.stdin.end() };
}
