"""Report of an estimate as one page: first the ice, then the evidence."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from curling_env.ice import write_cells
from curling_env.infrastructure.files.schema import FileFormat
from curling_env.infrastructure.files.storage import write_json, write_table
from curling_env.infrastructure.files.writing import current_path
from curling_env.physics.effects import catalogue
from curling_env.units import Units, length
from friction_estimation.estimation.estimate import Estimate
from friction_estimation.estimation.paper_method import estimate_by_paper
from friction_estimation.reports.draw_weight import draw_facts
from friction_estimation.reports.estimate_figures import per_cent, write_pictures
from friction_estimation.reports.html import facts, picture, table, write_page
from friction_estimation.reports.throws_section import Notes, throws_section, write_measures
from friction_estimation.tracks.plausible_friction import FRICTION_OF_ICE
from friction_estimation.tracks.throw_list import NO_NOTES
from friction_estimation.tracks.throw_table import throw_table

SUMMARY_FORMAT = FileFormat(name="curling-estimate/1", what="an estimate")
KEEN_BELOW, HEAVY_ABOVE = 0.0075, 0.0095
"""Frictions between which ice is of usual speed."""


@dataclass(frozen=True, kw_only=True)
class Still:
    """Frame of a film with the tracked stone drawn into it.

    Parameters
    ----------
    film : name of the file
    t : time since its first frame [s]
    jpeg : the picture as JPEG
    """

    film: str
    t: float
    jpeg: bytes

    @classmethod
    def of(cls, film: str, t: float, image: NDArray[np.uint8]) -> Still:
        """Return a still of a picture, (height, width, 3) BGR."""
        import cv2

        return cls(film=film, t=t, jpeg=cv2.imencode(".jpg", image)[1].tobytes())


CAPTIONS = {
    "map.png": "The ice as a curler reads it: blue is keen, red is heavy, and ice on which no "
    "stone ran is pale. Below: the standard error of each place, and the measured paths.",
    "profile.png": "Friction along the sheet with its uncertainty. The dots are the paper's "
    "method: differentiate the track and average in each cell.",
    "motion.png": "Speed over time, and deceleration over distance, smoothed over two seconds.",
    "camera.png": "The same displacement for every throw; the map is corrected for it. The band "
    "holds it with 95 % probability.",
    "residuals.png": "What the fit does not explain. It should look like noise around zero, and "
    "its correlation should fall off within a few frames.",
}
TITLES = {
    "map.png": "Keen and heavy ice",
    "profile.png": "Along the sheet",
    "motion.png": "Deceleration of the stones",
    "camera.png": "Bias of the camera",
    "residuals.png": "Residuals of the fit",
}


def write_report(
    found: Estimate,
    folder: Path,
    stills: Sequence[Still] = (),
    *,
    reload: float | None = None,
    provenance: Mapping[str, Any] | None = None,
    units: Units = Units.METRES,
    notes: Notes = NO_NOTES,
) -> list[str]:
    """Write all figures and tables of an estimate, and the page `report.html`.

    Parameters
    ----------
    found : the estimate
    folder : existing folder to write to
    stills : frames of the films, where there are films
    reload : time after which the browser loads the page again, while more is measured [s]; None for
        a page that stays as it is
    provenance : where the estimate comes from, where that is known
    units : what the page tells lengths in; tables and JSON are in metres
    notes : what a coach noted of the throws

    Returns
    -------
    names of the files written
    """
    plain = None
    if found.method == "trajectory":
        plain = estimate_by_paper(found.tracks, start=found.ice, uniform=found.uniform)
    pictures = write_pictures(found, plain, folder, units)
    write_cells(folder / "cells.csv", found.ice)
    write_table(folder / "rows.csv", row_table(found))
    origin = {"provenance": dict(provenance)} if provenance else {}
    write_json(
        folder / "estimate.json", {"format": SUMMARY_FORMAT.name, **found.summary(), **origin}
    )
    measured = throw_table(found.tracks)
    write_measures(folder / "throw_table.csv", measured, notes)
    throws = throws_section(measured, units, notes) if measured else ""
    write_page(
        folder / "report.html",
        "Friction of the ice",
        list(_sections(found, plain, folder, pictures, stills, throws, units)),
        reload=reload,
        provenance=provenance,
    )
    return ["report.html", "throw_table.csv", *pictures, "cells.csv", "rows.csv", "estimate.json"]


def _sections(
    found: Estimate,
    plain: Estimate | None,
    folder: Path,
    pictures: Sequence[str],
    stills: Sequence[Still],
    throws: str,
    units: Units,
) -> Iterator[str]:
    """Yield the sections of the page as HTML."""
    yield f"<h1>{escape(headline(found))}</h1>{facts(_facts(found, units))}{_remarks(found)}"
    if "map.png" in pictures and not found.uniform:
        yield _picture_section(folder, "map.png")
    if throws:
        yield throws
    if found.ice.effects:
        yield f"<h2>Other effects on the stones</h2>{_effects(found)}"
    if stills:
        named = [(still.jpeg, f"{still.film}, {still.t:.1f} s") for still in stills]
        shown = "".join(picture(jpeg, name, kind="jpeg", caption=name) for jpeg, name in named)
        yield (
            "<h2>Film and track</h2><p class=faint>The outline shows the measured stone, the line "
            f"its path.</p><div class=stills>{shown}</div>"
        )
    yield from (_picture_section(folder, name) for name in pictures if name != "map.png")
    if plain is not None:
        yield f"<h2>Comparison with the paper's method</h2>{_beside(found, plain)}"
    yield f"<h2>Fit of each throw</h2>{_throws(found)}"


def _picture_section(folder: Path, name: str) -> str:
    content = current_path(folder / name).read_bytes()
    return f"<h2>{TITLES[name]}</h2>{picture(content, TITLES[name], caption=CAPTIONS[name])}"


def row_table(found: Estimate) -> dict[str, ArrayLike]:
    """Return every row of every track with its use, as columns for `write_table`.

    `use` is ``used``, ``before`` or ``after`` a free slide, ``wild``, a jump,
    ``unlike`` the fit, or ``between`` rows that carry the same information, in smoothed tracks or
    those of a fast camera. `left_m` is the residual of the fit along the travel [m].
    """
    columns: dict[str, list[NDArray[Any]]] = {
        name: [] for name in ("throw", "t", "x", "y", "use", "left_m")
    }
    travel_residuals = found.travel_residuals
    for track in found.tracks:
        use = np.full(len(track), "before", dtype=object)
        residual = np.full(len(track), np.nan)
        for part in (slide for slide in found.slides if slide.track is track):
            use[part.rows[0] :] = "wild"
            use[part.rows[-1] + 1 :] = "after"
            use[part.rows] = "used"
            which = found.place(part)
            if found.fit is not None and which is not None:
                t, left = travel_residuals[which]
                begin = float(found.fit.session.clocks[which] - track.clock)
                rows = np.searchsorted(track.t, t + begin - 1e-6)
                thinned = np.diff(rows).min() > 1 if len(rows) > 1 else False
                use[part.rows] = "between" if thinned else "unlike"
                use[rows], residual[rows] = "used", left
        own = (np.full(len(track), track.throw), track.t, *track.xy.T, use, residual)
        for name, values in zip(columns, own, strict=True):
            columns[name].append(values)
    return {name: np.concatenate(parts) for name, parts in columns.items()}


def headline(found: Estimate) -> str:
    """Return the ice in one sentence."""
    low, high = found.interval
    if low < KEEN_BELOW and high > HEAVY_ABOVE:
        return (
            f"The friction of this ice is hardly known: μ is {max(low, 0):.4f} to {high:.4f} with "
            "95 % probability; more throws, or longer ones, would narrow that."
        )
    speed = _speed_in_words(found.mu)
    seen = found.ice.friction.observed
    if found.uniform or found.mu <= 0 or not seen.any():
        return f"This ice is {speed}: μ = {found.mu:.5f}{_by_speed(found)}."
    mu = found.ice.friction.mu[seen]
    low, high = np.percentile(mu, [2, 98])
    return (
        f"This ice is {speed}: μ = {found.mu:.5f}, and {per_cent(low / found.mu - 1)} to "
        f"{per_cent(high / found.mu - 1)} of that in 96 % of the cells that stones crossed."
    )


def _by_speed(found: Estimate) -> str:
    """Errors of one friction and of its dependence on speed; empty where that was not measured."""
    effect = found.ice.effect("speed_dependent_friction")
    if effect is None or "exponent" not in effect.sigma or "exponent" in effect.believed:
        return ""
    value, sigma = effect.parameters["exponent"], effect.sigma["exponent"]
    power = f"v^({-value:.2f} ± {sigma:.2f})".replace("-", "−")
    return f" ± {found.sigma:.5f} at 1 m/s, and friction goes with the speed as {power}"


def _speed_in_words(mu: float) -> str:
    least, most = FRICTION_OF_ICE
    if mu < least or mu > most:
        return f"{'keener' if mu < least else 'heavier'} than any curling ice"
    return "keen" if mu < KEEN_BELOW else "heavy" if mu > HEAVY_ABOVE else "of usual speed"


def _facts(found: Estimate, units: Units) -> list[tuple[str, str]]:
    low, high = found.interval
    known = f"95 %: {low:.5f} to {high:.5f}"
    if found.mu > 0:
        known = f"known to ± {50 * (high - low) / found.mu:.2g} %"
    if not np.isfinite(found.sigma):
        known = "its error is unknown (lost to rounding)"
    pairs = [(f"{found.mu:.5f}", f"friction μ, {known}")]
    pairs += draw_facts(found.ice, found.mu, units)
    pairs.append((str(found.throws), "throws measured"))
    if found.resolution is not None:
        pairs.append((length(found.resolution, units), "finest resolved detail"))
    if found.noise is not None:
        pairs.append((f"{1000 * found.noise.total:.1f} mm", "noise of a measured position"))
    bias = found.camera_bias
    if bias is not None and bias.found:
        pairs.append((f"{1000 * bias.size:.1f} mm", "bias of the camera, corrected"))
    return pairs


def _remarks(found: Estimate) -> str:
    remarks = ""
    bias = found.camera_bias
    if bias is not None and not bias.found:
        remarks = f"<p class=faint>{escape(bias.words.capitalize())}.</p>"
    remarks += "".join(f"<p class=faint>{escape(remark)}</p>" for remark in found.remarks)
    if found.skipped:
        items = "".join(f"<li>{escape(reason)}</li>" for reason in found.skipped)
        remarks += f"<p class=faint>Excluded:</p><ul class=faint>{items}</ul>"
    return remarks


def _effects(found: Estimate) -> str:
    """Return the effects of the ice with their parameters; the map's μ is the friction at 1 m/s."""
    cards = catalogue()
    rows: list[list[str]] = []
    for effect in found.ice.effects:
        name = cards[effect.name].title if effect.name in cards else effect.name
        for parameter, value in effect.parameters.items():
            sigma = effect.sigma.get(parameter)
            if not sigma:
                continue
            how = "assumed" if parameter in effect.believed else "measured"
            unit = cards[effect.name].parameter(parameter).unit if effect.name in cards else ""
            unit = "" if unit == "1" else f" {unit}"
            words = parameter.replace("_", " ")
            value = value if abs(value) > 1e-3 * sigma else 0.0
            rows.append([name, words, f"{value:.4g}{unit}", f"{sigma:.2g}", how])
            name = ""
    if not rows:
        return "<p>The effects of the given ice are unchanged.</p>"
    head = ["", "", "value", "standard error", ""]
    return table(head, rows, numeric={2, 3}) + (
        "<p class=faint>Map and effects are fitted together. If friction depends on speed, the "
        "map is the friction at 1 m/s. Assumed values are those of all rinks, with the spread "
        "among rinks as standard error.</p>"
    )


def _beside(found: Estimate, plain: Estimate) -> str:
    """Compare the joint fit and the paper's method in numbers."""
    rows: list[list[str]] = []
    ways = (
        ("joint fit of all throws", found),
        ("differentiated and averaged, the paper's method", plain),
    )
    for name, way in ways:
        low, high = way.interval
        seen = way.ice.friction.observed
        varies = ""
        if not found.uniform and way.mu > 0:
            mu = way.ice.friction.mu[seen] / way.mu
            varies = per_cent(float(mu.std())).lstrip("+")
        rows.append([name, f"{way.mu:.5f}", f"{low:.5f} to {high:.5f}", varies])
    head = ["", "μ", "95 % interval", "cells differ by"]
    return table(head, rows, numeric={1, 2, 3}) + (
        "<p class=faint>Larger differences between cells in the paper's method are noise of its "
        "derivatives.</p>"
        if not found.uniform
        else ""
    )


def _throws(found: Estimate) -> str:
    rows: list[list[str]] = []
    for entry in found.summary()["each"]:
        own = f"{100 * (entry.get('mu_factor', 1.0) - 1) + 0.0:+.2f}".replace("-0.00", "+0.00")
        rows.append(
            [
                str(entry["throw"]),
                f"{entry['speed']:.2f}" if "speed" in entry else "",
                f"{entry['seconds']:.1f}",
                "yes" if entry["rests"] else "no",
                own if "mu_factor" in entry else "",
                f"{1000 * entry['rms_m']:.1f}" if "rms_m" in entry else "",
                str(entry["wild_rows"]),
            ]
        )
    head = ["throw", "speed at release [m/s]", "seconds measured", "seen to rest"]
    head += ["own friction [%]", "left over [mm]", "wild rows"]
    return table(head, rows, numeric={0, 1, 2, 4, 5, 6})
