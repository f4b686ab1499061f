// Put into a copy of a page by .ci/browser: collects what goes wrong, and leaves a verdict in the title.
(() => {
  const wrong = [];
  const note = (what) => wrong.push(String(what).slice(0, 300));
  addEventListener("error", (event) => note(`script or resource error: ${event.message || event.target.outerHTML}`), true);
  addEventListener("unhandledrejection", (event) => note(`unhandled rejection: ${event.reason}`));
  addEventListener("securitypolicyviolation", (event) => note(`refused by policy: ${event.blockedURI || event.violatedDirective}`));
  const report = console.error;
  console.error = (...words) => { note(`console.error: ${words.join(" ")}`); report(...words); };

  const local = (url) => /^(data|blob|about):/.test(url) || url === location.href;
  // Chromium's window is never narrower than 500 pixels; a phone's page is.
  const phone = () => innerWidth <= 500 ? 400 : innerWidth;
  const look = () => {
    for (const entry of performance.getEntriesByType("resource")) if (!local(entry.name)) note(`request: ${entry.name}`);
    for (const element of document.querySelectorAll("[src], link[href]")) {
      const url = element.src || element.href;
      if (url && !local(url)) note(`refers to ${url}`);
    }
    const textsOf = (drawing, name) => {
      const whole = drawing.getBoundingClientRect();
      const texts = [...drawing.querySelectorAll("text")].map((text) => [text.lastChild.textContent.trim(), text.getBoundingClientRect(), text]);
      texts.forEach(([said, box, text], index) => {
        if (box.left < whole.left - 1 || box.right > whole.right + 1 || box.top < whole.top - 1 || box.bottom > whole.bottom + 1) {
          note(`figure ${name}: "${said}" is cut off`);
        }
        // Shown at the size that it has on a screen of this many pixels.
        const size = parseFloat(getComputedStyle(text).fontSize) * whole.width / drawing.viewBox.baseVal.width;
        if (size < 11) note(`figure ${name}: "${said}" is only ${size.toFixed(1)} pixels high`);
        // Boxes are as high as the font wants, which some do generously: three pixels are no letters.
        for (const [other, its] of texts.slice(0, index)) {
          const across = Math.min(box.right, its.right) - Math.max(box.left, its.left);
          const down = Math.min(box.bottom, its.bottom) - Math.max(box.top, its.top);
          if (across > 1 && down > 3) note(`figure ${name}: "${said}" covers "${other}"`);
        }
      });
    };
    const drawn = (element) => { const box = element.getBoundingClientRect(); return box.width >= 100 && box.height >= 60; };
    for (const figure of document.querySelectorAll("figure")) {
      const name = figure.id || "without a name";
      const drawings = [...figure.querySelectorAll("svg, canvas, img")];
      const rows = figure.querySelectorAll("tbody tr").length;
      if (drawings.length === 0 && rows === 0) note(`figure ${name} is missing: it has neither a drawing nor rows`);
      // One of the drawings of a panel is for a phone: one of the two is shown.
      for (const panel of figure.querySelectorAll(".panel")) {
        const shown = [...panel.querySelectorAll("svg")].filter((drawing) => drawing.checkVisibility());
        if (shown.length !== 1) note(`a panel of figure ${name} shows ${shown.length} drawings`);
        for (const drawing of shown) textsOf(drawing, name);
      }
      for (const drawing of drawings.filter((drawing) => drawing.checkVisibility())) {
        if (!drawn(drawing)) note(`figure ${name} has a drawing without size`);
        if (drawing.localName === "svg" && drawing.childElementCount < 5) note(`figure ${name} has an empty drawing`);
        if (/NaN|Infinity|undefined/.test(drawing.outerHTML)) note(`figure ${name} has a place that is no number`);
      }
      if (!figure.querySelector("figcaption")?.textContent.trim()) note(`figure ${name} has no caption`);
    }
    for (const picture of document.images) if (!picture.naturalWidth) note(`picture ${picture.alt} does not show`);
    const pictures = document.querySelectorAll("figure, canvas, img").length;
    if (pictures === 0) note("the page has neither figure nor picture");
    const overflow = Math.max(document.documentElement.scrollWidth - innerWidth, document.body.scrollWidth - document.body.clientWidth);
    if (overflow > 1) note(`the page is ${overflow} pixels wider than a window of ${phone()}`);
    for (const scroll of document.querySelectorAll("figure .scroll")) {
      const isWider = scroll.scrollWidth > scroll.clientWidth + 1;
      const said = !!scroll.previousElementSibling?.classList.contains("more");
      if (isWider !== said) note(`table ${scroll.parentElement.id} ${isWider ? "does not say that it scrolls" : "says that it scrolls, and does not"}`);
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
          if (numeric && values.some((value, k) => k > 0 && value < values[k - 1])) note(`column ${button.textContent} does not sort`);
          if (cells.length !== rows) note(`column ${button.textContent} loses rows when sorted`);
        }
      });
    }
    document.title = wrong.length ? `WRONG ${wrong.join(" | ")}` : `RIGHT ${pictures} figures and pictures`;
  };
  addEventListener("load", () => {
    document.body.style.maxWidth = `${phone()}px`;
    dispatchEvent(new Event("resize"));
    setTimeout(look, 500);
  });
})();
