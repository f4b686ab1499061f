"use strict";
(() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const checked = (id) => document.getElementById(id).checked;
  const rows = [...document.querySelectorAll("tbody tr")];
  let chosen = null, hovered = null;
  const choose = (index) => {
    chosen = index === chosen ? null : index;
    if (chosen !== null) rows[chosen].scrollIntoView({ block: "nearest" });
    update();
  };
  const hover = (index) => {
    if (index === hovered) return;
    hovered = index;
    update();
  };
  const show = drawScene(data, { hover, choose });
  const update = () => {
    const lines = data.lines.map(({ group }) => {
      const lit = group === hovered || group === chosen;
      const wanted = chosen === null ? checked(data.full[group] ? "touches" : "misses") : group === chosen;
      return { visible: wanted || group === hovered, lit };
    });
    show({ box: checked("box"), edges: checked("edges"), smooth: checked("smooth"), lines });
    rows.forEach((row, index) => {
      row.classList.toggle("chosen", index === chosen);
      row.classList.toggle("hovered", index === hovered);
      row.querySelector("button").setAttribute("aria-pressed", index === chosen);
    });
  };
  rows.forEach((row, index) => {
    row.addEventListener("click", () => choose(index));
    row.addEventListener("pointerenter", () => hover(index));
    row.addEventListener("pointerleave", () => hover(null));
  });
  addEventListener("keydown", (event) => { if (event.key === "Escape" && chosen !== null) choose(chosen); });
  for (const box of document.querySelectorAll("fieldset input")) box.addEventListener("change", update);
  update();
})();
