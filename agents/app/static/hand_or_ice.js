// "Hand or ice?": the way from the target to where the stone came to rest, cause by cause.

import { Sheet } from "./sheet.js";

const { steps, target, rest } = JSON.parse(document.getElementById("steps").textContent);
const picture = new Sheet(document.getElementById("picture"), { editable: false });
picture.aim(target);
const spot = picture.layers.target.firstElementChild;
for (const name of ["tabindex", "aria-roledescription", "aria-label"]) spot.removeAttribute(name);
spot.setAttribute("role", "presentation");
picture.ghost(rest, "home");
picture.trace(steps);
// The paths lie above target and stone, so that short ones are seen.
picture.world.append(picture.layers.paths);
