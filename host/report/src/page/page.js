"use strict";
// A click on a column's heading sorts the table by it: numbers by value, words by alphabet, missing ones last.
for (const table of document.querySelectorAll("table")) {
  const headings = [...table.tHead.rows[0].cells];
  headings.forEach((heading, column) => {
    heading.querySelector("button")?.addEventListener("click", () => {
      const down = heading.getAttribute("aria-sort") === "ascending";
      headings.forEach((other) => other.removeAttribute("aria-sort"));
      heading.setAttribute("aria-sort", down ? "descending" : "ascending");
      const body = table.tBodies[0];
      const key = (row) => row.cells[column].dataset.value;
      const words = (row) => row.cells[column].textContent;
      const rows = [...body.rows].sort((a, b) => {
        const [x, y] = [key(a), key(b)];
        if (heading.classList.contains("number") && (x === undefined) !== (y === undefined)) return x === undefined ? 1 : -1;
        const order = x === undefined || y === undefined ? words(a).localeCompare(words(b)) : x - y;
        return down ? -order : order;
      });
      body.append(...rows);
    });
  });
}
