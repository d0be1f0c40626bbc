// The screen "Ice": draws the map; every number stands on the page without it.

import { Sheet, TEE, viewButtons } from "./sheet.js";

const $ = (id) => document.getElementById(id);
const { sheet, radius, cells, change, seconds } = JSON.parse($("picture").textContent);
const shown = change ?? cells;
// One odd cell must not pale all others.
const sizes = shown.relative.flat().filter((value) => value !== null).map(Math.abs).sort((a, b) => a - b);
const most = Math.max(0.005, sizes[Math.floor(0.98 * (sizes.length - 1))] ?? 0);
/** What friction that differs by a share means, in seconds from hog line to hog line. */
const inSeconds = (share, digits = 2) => (seconds ? `${Math.abs(seconds * share).toFixed(digits)} s` : `${Math.abs(100 * share).toFixed(1)} %`);
$("strongest").textContent = `strongest colour: ${inSeconds(most)} and more, hog to hog, if all the way were like that`;

// A sheet is ten times as long as wide: it is drawn wider, so that lanes can be told apart.
const picture = new Sheet($("map"), { ...sheet, radius, view: "whole", stretch: [1.7, 2.6], editable: false });
picture.map(shown, most);
viewButtons(picture, $("views"), [["whole", "Whole sheet"], ["house", "House of the away end"]]);

// A tap reads a place.
$("map").addEventListener("click", (event) => {
  const at = picture.under(event), j = Math.floor((at.x + sheet.width / 2) / shown.size), i = Math.floor((at.y + sheet.length / 2) / shown.size);
  if (shown.relative[i]?.[j] === undefined) return;
  const value = shown.relative[i][j], error = cells.sigma[i][j], end = at.y < 0 ? "home" : "away";
  const where = `${Math.abs(at.x).toFixed(1)} m to the ${at.x < 0 ? "left" : "right"} (looking to the away end), ${Math.abs(TEE - Math.abs(at.y)).toFixed(1)} m ` +
    `${Math.abs(at.y) > TEE ? "behind" : "before"} the ${end} tee`;
  $("reading").textContent = `${where}: ` + (value === null ? "no stone ran there."
    : `${inSeconds(value)} ${value < 0 ? "keener" : "heavier"} than ${change ? "then" : "the sheet"}${change ? "" : `, ± ${inSeconds(2 * error)}`}.`);
});

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
