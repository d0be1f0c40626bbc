// The screen "Ice": draws the map; every number stands on the page without it.

import { Sheet, TEE, viewButtons } from "./sheet.js";
import { length } from "./units.js";

const $ = (id) => document.getElementById(id);
const { sheet, radius, cells, change, seconds, curl } = JSON.parse($("picture").textContent);
let shown = change ?? cells;
// One odd cell must not pale all others.
const strongest = ({ relative }) => {
  const sizes = relative.flat().filter((value) => value !== null).map(Math.abs).sort((a, b) => a - b);
  return Math.max(0.005, sizes[Math.floor(0.98 * (sizes.length - 1))] ?? 0);
};
/** What friction that differs by a share means, in seconds from hog line to hog line. */
const inSeconds = (share, digits = 2) => (seconds ? `${Math.abs(seconds * share).toFixed(digits)} s` : `${Math.abs(100 * share).toFixed(1)} %`);

// A sheet is ten times as long as wide: it is drawn wider, so that lanes can be distinguished.
const picture = new Sheet($("map"), { ...sheet, radius, view: "whole", stretch: [1.7, 2.6], editable: false });

const title = $("map-title").textContent;

/** Draw the map of friction, of its change, or of the curl. */
function draw(what) {
  const curls = what === "curl", most = strongest(shown = curls ? curl : change ?? cells);
  picture.map(shown, most);
  $("map-title").textContent = curls ? "Curl" : title;
  $("keen-word").textContent = curls ? "curls more" : "keener";
  $("heavy-word").textContent = curls ? "straighter" : "heavier";
  $("strongest").textContent = curls ? `strongest colour: ${length(most)}; draws curl ${length(curl.usual)} on average, on each third of the sheet towards the end they were thrown to`
    : `strongest colour: ${inSeconds(most)} and more, hog to hog, if all the way were like that`;
}
draw("friction");
$("what")?.addEventListener("change", ({ target }) => { draw(target.value); $("reading").textContent = "Tap a place to read it."; });

/** What is read where a lane shows its curl. */
function curlAt(i, j) {
  const less = curl.relative[i][j], fall = curl.fall[i][j];
  if (less === null) return "too few draws here.";
  const falls = fall === null ? "" : Math.abs(fall) < 2 * curl.sigma[i][j] ? "; no fall is seen" : `; falls ${length(fall)} to the ${fall > 0 ? "right" : "left"}`;
  return `draws curl ${length(curl.usual - less)}, ${length(less)} ${less > 0 ? "less" : "more"} than on average, ± ${length(2 * curl.sigma[i][j])}${falls}.`;
}
viewButtons(picture, $("views"), [["whole", "Whole sheet"], ["house", "House of the away end"]]);

// A tap reads a place.
$("map").addEventListener("click", (event) => {
  const at = picture.under(event), j = Math.floor((at.x + sheet.width / 2) / shown.size), i = Math.floor((at.y + sheet.length / 2) / shown.size);
  if (shown.relative[i]?.[j] === undefined) return;
  const value = shown.relative[i][j], error = cells.sigma[i][j], end = at.y < 0 ? "home" : "away";
  const where = `${length(at.x)} to the ${at.x < 0 ? "left" : "right"} (looking to the away end), ${length(TEE - Math.abs(at.y))} ` +
    `${Math.abs(at.y) > TEE ? "behind" : "before"} the ${end} tee`;
  $("reading").textContent = `${where}: ` + (shown === curl ? curlAt(i, j) : value === null ? "no stone ran there."
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
