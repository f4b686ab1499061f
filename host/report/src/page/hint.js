"use strict";
// A table that is wider than its place says that there is more of it to the right.
(() => {
  const hint = (scroll) => {
    const isWider = scroll.scrollWidth > scroll.clientWidth + 1;
    const said = scroll.previousElementSibling?.classList.contains("more");
    if (isWider && !said) {
      const more = document.createElement("p");
      more.className = "more";
      more.textContent = "Scroll sideways for more columns \u2192";
      scroll.before(more);
    } else if (!isWider && said) {
      scroll.previousElementSibling.remove();
    }
  };
  // Afterward: what a hint moves would be seen as a change of size while sizes are observed.
  const all = () => setTimeout(() => document.querySelectorAll(".scroll").forEach(hint));
  const watch = new ResizeObserver(all);
  // Whichever of the two changes its size.
  document.querySelectorAll(".scroll, .scroll > table").forEach((part) => watch.observe(part));
})();
