"""The demo itself: film, track, estimate, plan, throw, tell."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from agents.closed_loop import demo_figures as pictures
from agents.closed_loop import demo_page as page
from agents.closed_loop import filming
from agents.closed_loop.areas import find_areas
from agents.closed_loop.demo_findings import Draw, Findings
from agents.closed_loop.missing_effect import find_what_is_missing
from agents.closed_loop.patchy_ice import hidden_ice, practice_throws
from agents.learning.evaluation import rest_in_env
from agents.planning import Plan, plan
from curling_env.ice import Ice, save_ice
from curling_env.sheet import TEE_Y
from curling_env.storage import make_directory, write_json
from curling_env.throw import write_releases
from curling_env.trajectory import write_tracks
from curling_env.typing import Floats

Tell = Callable[[str, float], None]
"""Called with what is being done and the part of the whole that is done, 0 to 1."""

THROWS = 8
"""Practice throws that are filmed."""
BUTTON = np.array([0.0, TEE_Y])


def run_demo(
    directory: str | Path,
    *,
    seed: int = 0,
    throws: int = THROWS,
    fps: float = filming.FPS,
    draws: int = len(pictures.HOUSE_TARGETS),
    workers: int = 2,
    tell: Tell = lambda what, part: None,
) -> Findings:
    """Run the whole loop and leave films, overlay, tables, ice files and a page in a folder.

    Parameters
    ----------
    directory : made if it is not there
    seed : of the hidden ice, the throws and the films
    throws : practice throws to film, six or more for a map worth having
    fps : frames a second of the films [1/s]
    draws : further draws that compare the map with its average
    workers : processes that film and track side by side
    tell : of the progress

    Raises
    ------
    OutputError : a file cannot be written
    """
    began = time.monotonic()
    folder = make_directory(directory)
    rng = np.random.default_rng(seed)
    truth = hidden_ice(rng)
    releases = practice_throws(throws, rng)
    save_ice(truth, folder / "true-ice.json")
    write_releases(folder / "releases.csv", releases)

    films = filming.film_and_track(
        folder, truth, releases, seed=seed, fps=fps, workers=workers,
        tell=lambda what, part: tell(what, 0.75 * part),
    )  # fmt: skip
    write_tracks(folder / "tracks.csv", films.tracks)

    tell("reading the ice from the tracks", 0.77)
    law = replace(truth, friction=replace(truth.friction, mu=np.full(truth.sheet.shape, 0.0082)))
    estimated = filming.estimate(films.tracks, law)
    average = filming.estimate(films.tracks, law, uniform=True)
    save_ice(estimated, folder / "ice.json")

    tell("planning a draw", 0.84)
    best = plan(estimated, BUTTON, skill="elite", seed=seed)
    on_average = plan(_exactly(average), BUTTON, skill="elite", seed=seed)
    tell("throwing it", 0.87)
    more = _throw_draws(truth, estimated, average, pictures.HOUSE_TARGETS[:draws], tell)

    tell("forgetting the curl, and finding it", 0.95)
    missing = find_what_is_missing(
        folder / "discovery", truth, films.tracks, law, BUTTON, seed=seed
    )

    found = Findings(
        true_ice=truth,
        estimated_ice=estimated,
        average_ice=average,
        tracks=films.tracks,
        track_errors=films.errors,
        plan=best,
        average_plan=on_average,
        on_estimated=_test(estimated, best),
        on_true=_test(truth, best),
        average_on_true=_test(truth, on_average),
        draws=more,
        areas=find_areas(estimated),
        missing=missing,
        film_frames=films.frames,
        film_size=films.size,
        seconds=time.monotonic() - began,
    )
    tell("drawing the page", 0.98)
    pictures.draw_maps(found, folder / "maps.png")
    pictures.draw_house(found, folder / "house.png")
    pictures.draw_draws(found, folder / "draws.png")
    pictures.draw_missing(found, folder / "missing.png")
    pictures.draw_page(found, folder / "page.png")
    files = ["films/", "overlay.mp4", "tracks.csv", "ice.json", "true-ice.json", "page.png"]
    files.append("discovery/report.html")
    page.write_page(found, folder, film_still=films.still, files=files)
    write_json(folder / "findings.json", found.as_dict())
    tell("done", 1.0)
    return found


def _exactly(ice: Ice) -> Ice:
    """The same ice taken as certain: the planner then has one ice to try, not many."""
    return replace(ice, friction=replace(ice.friction, sigma=np.zeros(ice.sheet.shape)))


def _test(ice: Ice, made: Plan) -> Floats:
    """Where the plan's throw rests in `CurlingSheet-v0` on an ice, sheet frame [m]."""
    return rest_in_env(ice, made.best.throw, made.target)


def _throw_draws(
    truth: Ice, estimated: Ice, average: Ice, targets: tuple[Floats, ...], tell: Tell
) -> list[Draw]:
    """Plan a draw to each target on both ices and throw it on the hidden one."""
    draws: list[Draw] = []
    for k, target in enumerate(targets):
        rests = [
            _test(truth, plan(_exactly(ice), target, skill="none")) for ice in (estimated, average)
        ]
        draws.append(Draw(target=target, by_map=rests[0], by_average=rests[1]))
        tell("throwing more draws", 0.87 + 0.08 * (k + 1) / len(targets))
    return draws
