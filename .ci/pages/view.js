// Uses a page of `palpate view`. `given.inside` tells whether orange, the inside of the surface, should be seen.
const orange = (r, g, b) => r > 200 && g > 60 && g < 130 && b < 60;
const visit = async () => {
  const inside = share(drawnOn(0.03), orange);
  expect(given.inside ? inside >= 0.02 : inside <= 0.002, `${(100 * inside).toFixed(2)} % of the picture shows the inside of the surface`);
  expect(document.body.textContent.includes("no: inside out") === given.inside, "it is wrong about which side is out");
  const [row, next] = document.querySelectorAll("tbody tr");
  await does("choosing a row", () => row.click());
  expect(row.classList.contains("chosen"), "a row that was chosen does not show it");
  await does("choosing another row", () => next.click());
  expect(!row.classList.contains("chosen"), "a row stays chosen when another is");
  await does("Escape", () => press("Escape"));
  for (const box of document.querySelectorAll("fieldset input")) await does(`the box for ${box.id}`, () => box.click());
  await does("turning", () => { point("pointerdown", 200, 200, 1); point("pointermove", 300, 240, 1); point("pointerup", 300, 240, 0); });
  await does("the wheel", () => stage().dispatchEvent(new WheelEvent("wheel", { deltaY: -300, cancelable: true, bubbles: true })));
  return "drawn, turned, chosen";
};
