#!/usr/bin/env node
// Opens pages in one headless Chromium and uses them as a visitor would. Fails on a script error, a request, a broken link,
// a missing figure, a text that cannot be read, anything axe-core finds, a control that does nothing, and a page that disagrees
// with the program. The scripts beside this one are put into the pages.
//
//   .ci/pages/visit.mjs PAGES                    the pages that .ci/steps/pages made
//   .ci/pages/visit.mjs PAGES view port          only these trials: look, faults, play, view, port, or chip
//   .ci/pages/visit.mjs PAGES chip --record      makes the recording in tests/data/port again
//   .ci/pages/visit.mjs report.html play.html    only looks, at any pages
import { execFileSync, spawn } from "node:child_process";
import { existsSync, mkdtempSync, readFileSync, rmSync, statSync } from "node:fs";
import { tmpdir } from "node:os";
import { dirname, join } from "node:path";
import { fileURLToPath, pathToFileURL } from "node:url";
import { openChip } from "./chip.mjs";

const HERE = dirname(fileURLToPath(import.meta.url)), ROOT = join(HERE, "../..");
const AXE = "axe-core@4.14.1", AT_ONCE = 3;
const FLAGS = ["--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
  "--disable-component-update", "--disable-sync", "--disable-dev-shm-usage", "--disable-background-timer-throttling",
  "--disable-backgrounding-occluded-windows", "--disable-renderer-backgrounding", "--enable-unsafe-swiftshader", "--use-gl=angle",
  "--use-angle=swiftshader", "--remote-debugging-pipe"];
const read = (file) => readFileSync(file, "utf8");

// A trial has a page, the script that is put into it, and what the script is given; `open` makes that when the trial begins.
const WIDE = [1400, 900], PHONE = [400, 844], SMALL = [900, 700];
const looks = (page) => [[WIDE, "light"], [WIDE, "dark"], [PHONE, "light"]].map(([size, theme]) => (
  { name: "look", page, script: "look.js", size, theme, given: { theme } }));
// faults.html has these faults, and each must be seen.
const FAULTS = [
  /^script error: .*undefinedName/, /^script error: .*rejected/, /^console: said/, /^request: http:..127.0.0.1/,
  /^console: .*Content Security Policy/, /^links to missing.html/, /^figure empty is missing/, /^figure chart: "over" covers "under"/,
  /^figure chart: "cut" is cut off/, /^figure chart: "small" is only/, /^color-contrast/, /^image-alt/, /pixels wider than/,
];
function trials(pages, isNew) {
  const at = (page) => join(pages, page);
  const data = join(ROOT, "tests/data/port");
  const [first, second] = [1, 2].map((session) => [...readFileSync(join(data, `recorded-${session}.bin`))]);
  const recorded = { first, second, shown: JSON.parse(read(join(data, "shown.json"))) };
  const port = (page, given) => ({ name: "port", page: at(page), script: "port.js", size: WIDE, given: { ...recorded, ...given } });
  const play = (page, more) => ({ name: "play", page: at(page), script: "play.js", size: SMALL, most: 3e6, seconds: 300, ...more });
  const view = (page, given) => ({ name: "view", page: at(page), script: "view.js", size: SMALL, given });
  return [
    { name: "chip", page: at("port.html"), script: "port.js", size: WIDE, seconds: 300, open: () => openChip(at("says.txt"), isNew) },
    play("game.html", { open: () => ({ given: { trial: "game", trace: read(at("trace.txt")) } }) }),
    play("table.html", { given: { trial: "table" }, still: true }), // many ghosts in each picture
    view("bowl.html", { inside: false }), view("inverted.html", { inside: true }),
    ...["cuts", "none", "cancelled", "busy", "silent", "whole", "bytes", "sevens", "garbage", "changed", "hiccups", "pulled", "seldom"]
      .map((trial) => port("plain.html", { trial })),
    port("port.html", { trial: "thresholds" }), port("other.html", { trial: "other" }),
    ...["report.html", "evaluation/index.html", "bowl.html", "port.html", "shape.html", "game.html", "table.html"].flatMap((page) => looks(at(page))),
    { ...looks(join(HERE, "faults.html"))[2], name: "faults", faults: FAULTS },
  ];
}

// Chromium behind two pipes: messages are JSON, each with a zero byte after it.
function openBrowser(program, profile) {
  const child = spawn(program, [...FLAGS, `--user-data-dir=${profile}`], { stdio: ["ignore", "ignore", "pipe", "pipe", "pipe"], detached: true });
  const waiting = new Map(), tabs = new Map();
  let log = "", heard = "", count = 0;
  child.stderr.on("data", (text) => { log = `${log}${text}`.slice(-2000); });
  child.on("exit", () => waiting.forEach(({ reject }) => reject(new Error(`the browser ended: ${log}`))));
  child.stdio[3].on("error", () => {});
  child.stdio[4].setEncoding("utf8").on("data", (text) => {
    const messages = (heard + text).split("\0");
    heard = messages.pop();
    for (const { id, method, params, sessionId, result, error } of messages.map((text) => JSON.parse(text))) {
      if (method) tabs.get(sessionId)?.(method, params);
      else if (error) waiting.get(id).reject(new Error(error.message));
      else waiting.get(id).resolve(result);
      waiting.delete(id);
    }
  });
  const send = (method, params = {}, sessionId = undefined) => new Promise((resolve, reject) => {
    if (child.exitCode !== null) throw new Error(`the browser ended: ${log}`);
    waiting.set(count += 1, { resolve, reject });
    child.stdio[3].write(`${JSON.stringify({ id: count, method, params, sessionId })}\0`);
  });
  return { child, tabs, send };
}

// Opens a trial's page in a tab of its own. Returns what is wrong, and the script's note.
async function visit({ tabs, send }, { page, script, size: [width, height], theme = "light", still, given, seconds = 180, answers }, axe) {
  const wrong = [], address = pathToFileURL(page).href;
  const { targetId } = await send("Target.createTarget", { url: "about:blank" });
  const { sessionId } = await send("Target.attachToTarget", { targetId, flatten: true });
  const tab = (method, params) => send(method, params, sessionId);
  const call = (expression) => tab("Runtime.evaluate", { expression, awaitPromise: true, returnByValue: true });
  const tell = (what, value) => call(`${what}(${JSON.stringify(value)})`).catch(() => {}); // the tab may be closed
  let timer;
  const verdict = new Promise((resolve, reject) => {
    timer = setTimeout(() => reject(new Error(`there is no verdict after ${seconds} s`)), 1000 * seconds);
    const HAPPENS = {
      "Page.loadEventFired": () => call("visit()").then(resolve, reject),
      "Inspector.targetCrashed": () => reject(new Error("the tab crashed")),
      "Runtime.exceptionThrown": ({ exceptionDetails: { text, exception } }) => wrong.push(`script error: ${text} ${exception?.description ?? exception?.value}`),
      "Runtime.consoleAPICalled": ({ type, args }) => {
        if (["error", "assert"].includes(type)) wrong.push(`console: ${args.map(({ value, description }) => value ?? description).join(" ")}`);
      },
      "Runtime.bindingCalled": async ({ name, payload }) => {
        if (name === "fault") return wrong.push(payload);
        const { id, what, value } = JSON.parse(payload);
        tell("answered", [id, await answers[what](value, (...event) => tell("happens", event))]);
      },
      "Log.entryAdded": ({ entry: { level, text, url } }) => { if (level === "error") wrong.push(`console: ${text} ${url ?? ""}`); },
      "Network.requestWillBeSent": ({ request: { url } }) => { if (url !== address && !/^(data|blob):/.test(url)) wrong.push(`request: ${url}`); },
      "Network.webSocketCreated": ({ url }) => wrong.push(`request: ${url}`),
    };
    tabs.set(sessionId, (method, params) => HAPPENS[method]?.(params));
  });
  const features = [{ name: "prefers-color-scheme", value: theme }, { name: "prefers-reduced-motion", value: still ? "reduce" : "" }];
  const source = `(() => { const given = ${JSON.stringify(given)};\n${read(join(HERE, "tools.js"))}\n${read(join(HERE, script))}
    globalThis.visit = visit; })()`;
  try {
    await Promise.all([
      ...["Page", "Runtime", "Log", "Network"].map((domain) => tab(`${domain}.enable`)),
      tab("Emulation.setDeviceMetricsOverride", { width, height, deviceScaleFactor: 1, mobile: false }),
      tab("Emulation.setEmulatedMedia", { features }),
      tab("Emulation.setFocusEmulationEnabled", { enabled: true }), // or a tab behind another draws no frames
      ...["fault", "ask"].map((name) => tab("Runtime.addBinding", { name })),
      tab("Page.addScriptToEvaluateOnNewDocument", { source: script === "look.js" ? `${axe};${source}` : source }),
    ]);
    const [{ result, exceptionDetails }] = await Promise.all([verdict, tab("Page.navigate", { url: address })]);
    if (exceptionDetails) wrong.push(exceptionDetails.exception?.description ?? exceptionDetails.text);
    return { wrong, note: result.value };
  } catch (error) {
    return { wrong: [...wrong, error.message] };
  } finally {
    clearTimeout(timer);
    await send("Target.closeTarget", { targetId }).catch(() => {});
  }
}

// Finds faults in the file itself: broken links, too many bytes.
function inspect({ page, most = Infinity }) {
  const { size } = statSync(page);
  const links = [...new Set([...read(page).matchAll(/href="([^"#:]+)"/g)].map(([, link]) => link))];
  return [
    ...links.filter((link) => !existsSync(join(dirname(page), link))).map((link) => `links to ${link}, which is not there`),
    ...(size > most ? [`has ${size} bytes, more than ${most}`] : []),
  ];
}

async function tryAll(browser, all, axe) {
  const waiting = [...all];
  let failed = false;
  await Promise.all(Array.from({ length: AT_ONCE }, async () => {
    for (let trial; (trial = waiting.shift());) {
      const began = performance.now(), opened = await trial.open?.();
      const { name, page, size, theme, faults, given } = { ...trial, ...opened };
      const { wrong: found, note } = await visit(browser, { ...trial, given, answers: opened?.answers }, axe);
      opened?.end?.();
      const all = [...inspect(trial), ...found];
      const wrong = faults ? faults.filter((fault) => !all.some((one) => fault.test(one))).map((fault) => `not seen: ${fault}`) : all;
      const what = [given.trial ?? name, size.join(" × "), theme, page].filter(Boolean).join(", ");
      const seconds = ((performance.now() - began) / 1000).toFixed(1);
      console.log(`${what}: ${wrong.length ? "WRONG" : "right"}, ${seconds} s${note ? `; ${note}` : ""}`);
      wrong.forEach((one) => console.log(`  ${one.slice(0, 1000)}`));
      failed ||= wrong.length > 0;
    }
  }));
  return failed;
}

// Fetches axe-core from npm. It is not kept in the repository: it is larger than the pages' own scripts.
function fetchAxe(scratch) {
  try {
    execFileSync("npm", ["pack", "--silent", AXE], { cwd: scratch, stdio: ["ignore", "ignore", "inherit"] });
  } catch (error) {
    if (error.code !== "ENOENT") throw error;
    console.log("SKIPPED: axe-core: no npm here; on Debian: apt-get install npm");
    return "";
  }
  execFileSync("tar", ["-xzf", `${AXE.replace("@", "-")}.tgz`, "package/axe.min.js"], { cwd: scratch });
  return read(join(scratch, "package/axe.min.js"));
}

const program = ["chromium", "chromium-browser", "google-chrome"]
  .flatMap((name) => process.env.PATH.split(":").map((directory) => join(directory, name))).find(existsSync);
if (!program) {
  console.log("SKIPPED: no chromium here; on Debian: apt-get install chromium");
  process.exit();
}
const [pages, ...rest] = process.argv.slice(2), names = rest.filter((name) => name !== "--record");
const scratch = mkdtempSync(join(tmpdir(), "pages-"));
let browser;
try {
  const all = pages.endsWith(".html") ? [pages, ...rest].flatMap(looks)
    : trials(pages, names.length < rest.length).filter(({ name }) => names.length === 0 || names.includes(name));
  const axe = all.some(({ script }) => script === "look.js") ? fetchAxe(scratch) : "";
  browser = openBrowser(program, join(scratch, "profile"));
  process.exitCode = Number(await tryAll(browser, all, axe));
  console.log(`${all.length} trials in one browser, ${Math.round(performance.now() / 1000)} s`);
} finally {
  // Ends all of its processes at once, so that none goes on writing.
  if (browser) process.kill(-browser.child.pid, "SIGKILL");
  rmSync(scratch, { recursive: true, force: true, maxRetries: 5 });
}
