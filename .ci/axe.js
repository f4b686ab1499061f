// Put into a copy of a page by .ci/axe, after axe-core: leaves what it finds in the title. The page's data-theme says
// which theme the browser should show.
addEventListener("load", () => setTimeout(async () => {
  const wrong = [];
  const theme = matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light";
  if (theme !== document.documentElement.dataset.theme) wrong.push(`the browser shows the ${theme} theme`);
  let rules = 0;
  try {
    const found = await axe.run(document);
    rules = found.passes.length;
    for (const { id, help, nodes } of found.violations) {
      const one = nodes[0];
      const why = [...one.any, ...one.all, ...one.none].map(({ message }) => message)[0] ?? "";
      wrong.push(`${id}: ${help}: ${nodes.length} times, first ${one.target.join(" ")}: ${why}`);
    }
    if (rules < 10) wrong.push(`only ${rules} rules were looked at`);
  } catch (error) {
    wrong.push(`axe-core failed: ${error}`);
  }
  document.title = wrong.length ? `WRONG ${wrong.join(" | ").replaceAll("<", "")}` : `RIGHT ${rules} rules`;
}, 500));
