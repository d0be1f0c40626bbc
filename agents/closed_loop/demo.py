"""Demo: film throws on hidden ice, track them, estimate the ice, plan on it, and test the plan.

At the end the curl is removed from the model, and discovery has to find it.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from agents.closed_loop import demo_figures, demo_page
from agents.closed_loop.demo_findings import ComparedDraw, Findings
from agents.closed_loop.filming import FPS, film_throws
from agents.closed_loop.patches import patchy_ice
from agents.closed_loop.practice import draw_practice
from agents.learning.evaluation import rest_in_env
from agents.planning import Plan, plan_throw
from curling_env.errors import OutputError
from curling_env.ice import Ice, save_ice
from curling_env.infrastructure.files.kinds import kind_of
from curling_env.infrastructure.files.schema import FileFormat
from curling_env.infrastructure.files.storage import write_json
from curling_env.infrastructure.files.writing import folder_of_drafts, make_directory
from curling_env.infrastructure.provenance import provenance
from curling_env.sheet import TEE_Y
from curling_env.throw import write_releases
from curling_env.trajectory import Trajectory, write_tracks
from curling_env.typing import Floats, Progress, no_progress, part_of_progress, with_progress
from curling_env.units import Units
from friction_estimation.discovery.discover import discover
from friction_estimation.discovery.evidence.next_throws import next_throws
from friction_estimation.discovery.report import write_files
from friction_estimation.estimation.whole_ice import estimate_ice
from friction_estimation.reports.discovery_page import write_report_page

BUTTON = np.array([0.0, TEE_Y])
HOUSE_TARGETS = tuple(
    np.array([x, TEE_Y + y])
    for x, y in (
        *((0.0, 0.0), (0.9, 0.0), (-0.9, 0.0), (0.0, 1.1), (0.0, -1.1)),
        *((0.7, -0.8), (-0.7, -0.8), (0.6, 0.8), (-0.6, 0.8), (0.35, -2.6)),
    )
)
"""Typical targets of a skip: button, wings, back and front of the house, a guard [m]."""
ASSUMED_FRICTION = 0.0082
"""Uniform friction with which the estimation starts."""
FINDINGS = "findings.json"
FINDINGS_FORMAT = FileFormat(name="curling-findings/1", what="the findings of a demo")
"""Format of the file, with numbers of the demo only, that identifies the folder of an earlier
demo.
"""
RESULTS = (
    *("true-ice.json", "releases.csv", "tracks.csv", "ice.json", "index.html", "page.png"),
    *("films", "discovery", "overlay.mp4", "overlay.png", FINDINGS),
    *("maps.png", "house.png", "draws.png", "missing.png"),
)
"""Files in the folder of a demo."""


def run_demo(
    directory: str | Path,
    *,
    seed: int = 0,
    throws: int = 8,
    fps: float = FPS,
    frame_size: tuple[int, int] | None = None,
    draws: int = len(HOUSE_TARGETS),
    workers: int = 2,
    units: Units = Units.METRES,
    progress: Progress = no_progress,
) -> Findings:
    """Run the whole loop and leave films, overlay, tables, ice files and a page in a folder.

    They appear together when all is done, and replace those of an earlier demo.

    Parameters
    ----------
    directory : folder for the results; made if missing
    seed : seed of the hidden ice, the throws and the films
    throws : number of practice throws to film; six or more give a useful map
    fps : frame rate of the films [1/s]
    frame_size : width and height of the films [px]; the camera's own by default
    draws : number of draws that compare the map with its average
    workers : number of parallel processes that film and track
    units : units of lengths in sentences, page and pictures
    progress : called with shares of the whole

    Raises
    ------
    OutputError : a file cannot be written, or the folder has files of these names that are not from
        an earlier demo
    """
    _refuse_a_folder_of_other_files(Path(directory))
    with folder_of_drafts(directory) as folder:
        return _run_in(folder, seed, throws, fps, frame_size, draws, workers, units, progress)


def _refuse_a_folder_of_other_files(folder: Path) -> None:
    there = next((name for name in RESULTS if (folder / name).exists()), None)
    if there is not None and kind_of(folder / FINDINGS) != "findings":
        raise OutputError(
            f"{folder}: has {there}, not from an earlier demo; expected a separate folder"
        )


def _run_in(
    folder: Path,
    seed: int,
    throws: int,
    fps: float,
    frame_size: tuple[int, int] | None,
    draws: int,
    workers: int,
    units: Units,
    progress: Progress,
) -> Findings:
    """Run the whole loop, with the parameters of `run_demo`."""
    began = time.monotonic()
    rng = np.random.default_rng(seed)
    truth = patchy_ice(rng)
    releases = draw_practice(throws, rng)
    origin = provenance(seed=seed)
    save_ice(truth, folder / "true-ice.json", provenance=origin)
    write_releases(folder / "releases.csv", releases)

    films = film_throws(
        folder,
        truth,
        releases,
        seed=seed,
        fps=fps,
        frame_size=frame_size,
        workers=workers,
        progress=part_of_progress(progress, 0.0, 0.75),
    )
    write_tracks(folder / "tracks.csv", films.tracks)

    progress("estimating the ice from the tracks", 0.77)
    estimated = estimate_ice(films.tracks, seed=seed).ice
    # The average ice gets the law of the ice, but not its heavy and keen areas.
    even = np.full(truth.sheet.shape, ASSUMED_FRICTION)
    law = replace(truth, friction=replace(truth.friction, mu=even))
    average = estimate_ice(films.tracks, start=law, uniform=True).ice
    save_ice(estimated, folder / "ice.json", provenance=origin)

    progress("planning a draw", 0.84)
    best = plan_throw(estimated, BUTTON, skill="elite", seed=seed)
    on_average = plan_throw(_certain(average), BUTTON, skill="elite", seed=seed)
    tested = ComparedDraw(
        target=best.target, rest=_rest(truth, best), other=_rest(truth, on_average)
    )

    targets = with_progress(
        HOUSE_TARGETS[:draws], "throwing more draws", part_of_progress(progress, 0.87, 0.95), draws
    )
    more = [_compare(truth, target, estimated, average) for target in targets]

    progress("removing the curl, and finding it", 0.95)
    without_curl = replace(law, effects=tuple(e for e in law.effects if e.name != "curl"))
    missing, named = find_missing_effect(
        folder / "discovery", truth, films.tracks, without_curl, BUTTON, seed=seed, units=units
    )

    found = Findings(
        true_ice=truth,
        estimated_ice=estimated,
        average_ice=average,
        tracks=films.tracks,
        track_errors=films.errors,
        plan=best,
        average_plan=on_average,
        on_estimated=_rest(estimated, best),
        tested=tested,
        draws=more,
        missing=missing,
        named=named,
        film_frames=films.frames,
        film_size=films.size,
        seconds=time.monotonic() - began,
        units=units,
    )
    progress("drawing the page", 0.98)
    demo_figures.draw_all(found, folder)
    demo_page.write_demo_page(found, folder, film_still=films.still)
    write_json(
        folder / FINDINGS,
        {"format": FINDINGS_FORMAT.name, **found.as_dict(), "provenance": origin},
    )
    progress("done", 1.0)
    return found


def find_missing_effect(
    folder: Path,
    truth: Ice,
    tracks: Sequence[Trajectory],
    start: Ice,
    target: Floats,
    *,
    seed: int,
    units: Units = Units.METRES,
) -> tuple[ComparedDraw, list[str]]:
    """Read tracks with a model that lacks an effect, discover it, and plan a draw with and without.

    Parameters
    ----------
    folder : directory for discovery's report and ice files
    truth : the filmed ice; only the draws are thrown on it
    tracks : measured tracks
    start : ice whose law lacks the effect
    target : (2,) target of the draw, sheet frame [m]
    seed : seed of the discovery
    units : units of lengths in the report

    Returns
    -------
    the draw, planned with and without the discovered effects, and the names of these effects

    Raises
    ------
    OutputError : a file cannot be written
    """
    folder = make_directory(folder)
    found = discover(
        list(tracks), estimate_ice(list(tracks), effects="none", start=start).ice, seed=seed
    )
    following = next_throws(found.final)
    report = write_files(found, folder, following=following, provenance=provenance(seed=seed))
    write_report_page(found, report, folder / "report.html", units=units)
    draw = _compare(truth, target, found.improved_ice(), found.baseline_ice())
    return draw, [effect.label for effect in found.effects]


def _compare(truth: Ice, target: Floats, ice: Ice, other: Ice) -> ComparedDraw:
    """Plan a draw for an exact player on two ices and throw both on the hidden one."""
    rest, other_rest = (
        _rest(truth, plan_throw(_certain(assumed), target, skill="none"))
        for assumed in (ice, other)
    )
    return ComparedDraw(target=target, rest=rest, other=other_rest)


def _certain(ice: Ice) -> Ice:
    """Return the same ice without standard errors, so that the planner tries only one ice."""
    return replace(ice, friction=replace(ice.friction, sigma=np.zeros(ice.sheet.shape)))


def _rest(ice: Ice, made: Plan) -> Floats:
    """Return the place of rest of a plan's best throw in `CurlingSheet-v0` on an ice, sheet frame
    [m].
    """
    return rest_in_env(ice, made.best.throw, made.target)
