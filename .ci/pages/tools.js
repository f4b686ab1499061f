// Before each script that is put into a page, where `given` is there, and `fault`, which enters what is wrong. A script has a
// function `visit`, which is called once the page is loaded and may return a note.
const expect = (holds, what) => { if (!holds) fault(what); };
const pause = (ms = 50) => new Promise((resume) => setTimeout(resume, ms));
const waitFor = async (holds, what, seconds = 60) => {
  for (const end = performance.now() + 1000 * seconds; !holds() && performance.now() < end;) await pause(20);
  expect(holds(), what);
};
const element = (id) => document.getElementById(id);
const text = (id) => element(id).textContent;
// Lets a drawing be read after it was shown, and made-up pointers be followed.
const { getContext } = HTMLCanvasElement.prototype;
HTMLCanvasElement.prototype.getContext = function (kind, options) {
  return getContext.call(this, kind, { ...options, preserveDrawingBuffer: true });
};
Element.prototype.setPointerCapture = Element.prototype.releasePointerCapture = () => {};
const stage = () => document.querySelector("#stage canvas");
const pixels = () => {
  const copy = Object.assign(document.createElement("canvas"), { width: stage().width, height: stage().height });
  const flat = getContext.call(copy, "2d");
  flat.drawImage(stage(), 0, 0);
  return flat.getImageData(0, 0, copy.width, copy.height).data;
};
// Share of a picture's pixels that pass a test.
const share = (data, test) => {
  let count = 0;
  for (let i = 0; i < data.length; i += 4) if (test(data[i], data[i + 1], data[i + 2])) count += 1;
  return count * 4 / data.length;
};
const drawnOn = (least) => {
  const data = pixels();
  const drawn = share(data, (r, g, b) => Math.abs(r - data[0]) + Math.abs(g - data[1]) + Math.abs(b - data[2]) > 12);
  expect(drawn > least, `only ${(100 * drawn).toFixed(1)} % of the picture is drawn on`);
  return data;
};
const does = async (what, act) => {
  const differs = (before) => pixels().some((value, i) => Math.abs(value - before[i]) > 8);
  let before;
  // Waits until nothing moves by itself.
  do {
    before = pixels();
    await pause(100);
  } while (differs(before));
  act();
  await waitFor(() => differs(before), `${what} changes nothing in the picture`, 20);
};
const point = (type, x, y, buttons) => stage().dispatchEvent(new PointerEvent(type, {
  clientX: x, clientY: y, pointerId: 1, pointerType: "mouse", button: type === "pointermove" ? -1 : 0, buttons, bubbles: true,
}));
const press = (key) => stage().dispatchEvent(new KeyboardEvent("keydown", { key, bubbles: true }));
