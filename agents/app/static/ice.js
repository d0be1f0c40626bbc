// The screen "Ice": draws the map; every number stands on the page without it.

import { Sheet, viewButtons } from "./sheet.js";

const $ = (id) => document.getElementById(id);
const { sheet, radius, cells, change } = JSON.parse($("picture").textContent);
const shown = change ?? cells;
// One odd cell must not pale all others.
const sizes = shown.relative.flat().filter((value) => value !== null).map(Math.abs).sort((a, b) => a - b);
const most = Math.max(0.005, sizes[Math.floor(0.98 * (sizes.length - 1))] ?? 0);
$("strongest").textContent = `strongest colour: ${(100 * most).toFixed(1)} % and more`;

// A sheet is ten times as long as wide: it is drawn wider, so that lanes can be told apart.
const picture = new Sheet($("map"), { ...sheet, radius, view: "whole", stretch: [1.7, 2.6], editable: false });
picture.map(shown, most);
viewButtons(picture, $("views"), [["whole", "Whole sheet"], ["house", "House of the away end"]]);

$("print").addEventListener("click", () => print());
$("against")?.addEventListener("change", () => {
  const address = new URL(location.href);
  if ($("against").value) address.searchParams.set("against", $("against").value);
  else address.searchParams.delete("against");
  location.href = address;
});

// On paper the sheet lies along the page, on whatever it is shown.
const onPaper = (printing) => {
  picture.printing = printing;
  picture.zoomed = false;
  picture.fit();
};
addEventListener("beforeprint", () => onPaper(true));
addEventListener("afterprint", () => onPaper(false));
matchMedia("print").addEventListener("change", (event) => onPaper(event.matches));
