// Put into a copy of a page of `palpate view` by .ci/view: uses the page as a visitor would, looks at what is drawn, and
// leaves a verdict in the title. The page's data-expect says whether orange, the inside of the surface, should be seen.
(() => {
  const wrong = [];
  addEventListener("error", (event) => wrong.push(`script error: ${event.message}`));
  const report = console.error;
  console.error = (...words) => { wrong.push(`console.error: ${words.join(" ").slice(0, 200)}`); report(...words); };
  // So that the drawing can be read after it was shown, and made-up pointers can be followed.
  const context = HTMLCanvasElement.prototype.getContext;
  HTMLCanvasElement.prototype.getContext = function (kind, options) {
    return context.call(this, kind, { ...options, preserveDrawingBuffer: true });
  };
  Element.prototype.setPointerCapture = Element.prototype.releasePointerCapture = () => {};

  // Headless Chromium's virtual time waits for timers, not for frames.
  window.requestAnimationFrame = (act) => setTimeout(() => act(performance.now()), 16);
  const pause = () => new Promise((resume) => setTimeout(resume, 100));
  const pixels = () => {
    const canvas = document.querySelector("#stage canvas");
    const copy = Object.assign(document.createElement("canvas"), { width: canvas.width, height: canvas.height });
    const flat = context.call(copy, "2d");
    flat.drawImage(canvas, 0, 0);
    return flat.getImageData(0, 0, copy.width, copy.height).data;
  };
  const share = (data, test) => {
    let count = 0;
    for (let i = 0; i < data.length; i += 4) if (test(data[i], data[i + 1], data[i + 2])) count += 1;
    return count * 4 / data.length;
  };
  const orange = (r, g, b) => r > 200 && g > 60 && g < 130 && b < 60;
  const differs = (before) => {
    const after = pixels();
    return before.some((value, i) => Math.abs(value - after[i]) > 8);
  };
  const does = async (what, act) => {
    const before = pixels();
    act();
    for (let tries = 0; tries < 10 && !differs(before); tries += 1) await pause();
    if (!differs(before)) wrong.push(`${what} changes nothing in the picture`);
  };
  const look = async () => {
    await pause();
    const canvas = document.querySelector("#stage canvas");
    if (!canvas) return wrong.push("nothing is drawn");
    const first = pixels();
    const drawn = share(first, (r, g, b) => Math.abs(r - first[0]) + Math.abs(g - first[1]) + Math.abs(b - first[2]) > 12);
    if (drawn < 0.03) wrong.push(`only ${(100 * drawn).toFixed(1)} % of the picture is drawn on`);
    const inside = share(first, orange);
    if (document.body.dataset.expect === "orange" ? inside < 0.02 : inside > 0.002) {
      wrong.push(`${(100 * inside).toFixed(2)} % of the picture shows the inside of the surface`);
    }
    const [row, next] = document.querySelectorAll("tbody tr");
    await does("choosing a row", () => row.click());
    if (!row.classList.contains("chosen")) wrong.push("a row that was chosen does not show it");
    await does("choosing another row", () => next.click());
    if (row.classList.contains("chosen")) wrong.push("a row stays chosen when another is");
    await does("Escape", () => dispatchEvent(new KeyboardEvent("keydown", { key: "Escape" })));
    for (const box of document.querySelectorAll("fieldset input")) await does(`the box for ${box.id}`, () => box.click());
    const at = (type, x, y, buttons) => canvas.dispatchEvent(new PointerEvent(type, {
      clientX: x, clientY: y, pointerId: 1, pointerType: "mouse", button: type === "pointermove" ? -1 : 0, buttons, bubbles: true,
    }));
    await does("turning", () => { at("pointerdown", 200, 200, 1); at("pointermove", 300, 240, 1); at("pointerup", 300, 240, 0); });
    await does("the wheel", () => canvas.dispatchEvent(new WheelEvent("wheel", { deltaY: -300, cancelable: true, bubbles: true })));
  };
  addEventListener("load", () => look().catch((error) => wrong.push(`${error}`)).finally(() => {
    document.title = wrong.length ? `WRONG ${wrong.join(" | ")}` : "RIGHT drawn, turned, chosen";
  }));
})();
