// Looks at a page: figures, texts, tables, and what axe-core says of names, contrasts, headings and landmarks.
const looksRight = () => {
  const local = (url) => /^(data|blob|about):/.test(url) || url === location.href;
  for (const part of document.querySelectorAll("[src], link[href]")) {
    const url = part.src || part.href;
    if (url && !local(url)) fault(`refers to ${url}`);
  }
  const textsOf = (drawing, name) => {
    const whole = drawing.getBoundingClientRect();
    const texts = [...drawing.querySelectorAll("text")].map((text) => [text.lastChild.textContent.trim(), text.getBoundingClientRect(), text]);
    texts.forEach(([said, box, text], index) => {
      if (box.left < whole.left - 1 || box.right > whole.right + 1 || box.top < whole.top - 1 || box.bottom > whole.bottom + 1) {
        fault(`figure ${name}: "${said}" is cut off`);
      }
      // Shown at the size that it has on a screen of this many pixels.
      const size = parseFloat(getComputedStyle(text).fontSize) * whole.width / drawing.viewBox.baseVal.width;
      if (size < 11) fault(`figure ${name}: "${said}" is only ${size.toFixed(1)} pixels high`);
      // Boxes are as high as the font wants, which some do generously: three pixels are no letters.
      for (const [other, its] of texts.slice(0, index)) {
        const across = Math.min(box.right, its.right) - Math.max(box.left, its.left);
        const down = Math.min(box.bottom, its.bottom) - Math.max(box.top, its.top);
        if (across > 1 && down > 3) fault(`figure ${name}: "${said}" covers "${other}"`);
      }
    });
  };
  const drawn = (element) => { const box = element.getBoundingClientRect(); return box.width >= 100 && box.height >= 60; };
  for (const figure of document.querySelectorAll("figure")) {
    const name = figure.id || "without a name";
    const drawings = [...figure.querySelectorAll("svg, canvas, img")];
    const rows = figure.querySelectorAll("tbody tr").length;
    if (drawings.length === 0 && rows === 0) fault(`figure ${name} is missing: it has neither a drawing nor rows`);
    // One of the drawings of a panel is for a phone: one of the two is shown.
    for (const panel of figure.querySelectorAll(".panel")) {
      const shown = [...panel.querySelectorAll("svg")].filter((drawing) => drawing.checkVisibility());
      if (shown.length !== 1) fault(`a panel of figure ${name} shows ${shown.length} drawings`);
      for (const drawing of shown) textsOf(drawing, name);
    }
    for (const drawing of drawings.filter((drawing) => drawing.checkVisibility())) {
      if (!drawn(drawing)) fault(`figure ${name} has a drawing without size`);
      if (drawing.localName === "svg" && drawing.childElementCount < 5) fault(`figure ${name} has an empty drawing`);
      if (/NaN|Infinity|undefined/.test(drawing.outerHTML)) fault(`figure ${name} has a place that is no number`);
    }
    if (!figure.querySelector("figcaption")?.textContent.trim()) fault(`figure ${name} has no caption`);
  }
  for (const picture of document.images) if (!picture.naturalWidth) fault(`picture ${picture.alt} does not show`);
  const pictures = document.querySelectorAll("figure, canvas, img").length;
  if (pictures === 0) fault("the page has neither figure nor picture");
  const overflow = Math.max(document.documentElement.scrollWidth - innerWidth, document.body.scrollWidth - document.body.clientWidth);
  if (overflow > 1) fault(`the page is ${overflow} pixels wider than a window of ${innerWidth}`);
  for (const scroll of document.querySelectorAll("figure .scroll")) {
    const isWider = scroll.scrollWidth > scroll.clientWidth + 1;
    const said = !!scroll.previousElementSibling?.classList.contains("more");
    if (isWider !== said) fault(`table ${scroll.parentElement.id} ${isWider ? "does not say that it scrolls" : "says that it scrolls, and does not"}`);
  }
  // Sort every table by every column, both ways: it must keep its rows, and numbers must rise, then fall.
  for (const table of document.querySelectorAll("table")) {
    const rows = table.tBodies[0].rows.length;
    table.querySelectorAll("th button").forEach((button, column) => {
      for (const sign of [1, -1]) {
        button.click();
        const cells = [...table.tBodies[0].rows].map((row) => row.cells[column]);
        const values = cells.filter((cell) => cell.dataset.value !== undefined).map((cell) => sign * cell.dataset.value);
        const numeric = button.parentElement.classList.contains("number");
        if (numeric && values.some((value, k) => k > 0 && value < values[k - 1])) fault(`column ${button.textContent} does not sort`);
        if (cells.length !== rows) fault(`column ${button.textContent} loses rows when sorted`);
      }
    });
  }
  return pictures;
};
const isAccessible = async () => {
  const { passes, violations } = await axe.run(document, { resultTypes: ["violations"] });
  for (const { id, help, nodes } of violations) {
    const [one] = nodes;
    const [why = ""] = [...one.any, ...one.all, ...one.none].map(({ message }) => message);
    fault(`${id}: ${help}: ${nodes.length} times, first ${one.target.join(" ")}: ${why}`);
  }
  expect(passes.length >= 10, `only ${passes.length} of axe-core's rules were looked at`);
  return passes.length;
};
const visit = async () => {
  const theme = matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light";
  expect(theme === given.theme, `the browser shows the ${theme} theme`);
  // Sizes are observed once a frame is drawn, and what follows from them is done in a task after it.
  for (let frames = 0; frames < 2; frames += 1) await new Promise((resume) => requestAnimationFrame(resume));
  await pause(100);
  const pictures = looksRight();
  return `${pictures} figures and pictures${typeof axe === "object" ? `, ${await isAccessible()} rules` : ""}`;
};
