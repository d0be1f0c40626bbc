"""How far tracks from film lie from the truth, over cameras, lenses, clicks and people.

python scripts/tracking_accuracy.py
python scripts/tracking_accuracy.py --cameras end,side --clicks 3 --films 2 --workers 2
python scripts/tracking_accuracy.py --films-in DIR
python scripts/tracking_accuracy.py --films-in DIR --balanced    films of scripts/other_films.py

Films of known throws are rendered (once), or taken from a folder that holds for each camera
NAME.scene.json and NAME.truth.json and for each film NAME-K.mp4 and NAME-K.truth.csv. Each is
tracked with the lens given and unknown, with the points marked exactly and some pixels off. Only
the scoring reads the truth. A call that was stopped goes on where it was: what stands in cases.csv
is not tracked again. `--balanced` tracks each film in one way only, so that every camera, size and
rate meets both lenses and both kinds of points about equally often, and with `--turn` in another
one; the smallest pictures come first.
"""

from __future__ import annotations

import csv
import re
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import cv2
import numpy as np
import typer

from curling_env.commands.cli import progress_bar, say
from curling_env.errors import CurlingError
from curling_env.ice import Ice
from curling_env.infrastructure.executor import executor
from curling_env.infrastructure.files.storage import (
    make_directory,
    read_json,
    read_table,
    write_table,
)
from curling_env.physics import slide
from curling_env.sheet import Direction
from curling_env.throw import Throw
from curling_env.typing import Floats, with_progress
from friction_estimation import estimate_ice
from friction_estimation.camera.pose import camera_from_scene
from friction_estimation.camera.scene import Scene, load_scene
from friction_estimation.synthetic import CAMERAS, FilmSpec, render_films
from friction_estimation.tracking import track_film
from friction_estimation.tracking.films.film_track import FilmTrack

CAMERAS_TOLD = "end,gantry,side,ceiling,ceiling_home,ceiling_middle"
OUT_OF_HAND = 1.0
"""Rows from this long after the release are scored: before it the thrower is in the way [s]."""
LEAST_SLIDE = 8.0
"""One throw must be seen for so long to tell a friction worth scoring [s]."""
RESTS = 0.02
"""A slower stone lies still [m/s]."""
NORMAL_95 = 1.96
TRUTH = ("t", "x", "y", "theta")
COLUMNS = ("camera", "film", "lens", "clicks", "rows", "rms_mm", "worst_mm", "sigma_mm",
           "camera_mm", "within_95", "rms_sigmas", "worst_sigmas", "heading_rad",
           "mu_error_percent", "mu_sigmas", "short_s", "cpu_s", "said")  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Case:
    """One film to be tracked in one way.

    Parameters
    ----------
    film : FOLDER/NAME-K.mp4
    lens : whether it is given
    click_px : standard error of each marked coordinate
    seed : of the clicks
    """

    film: Path
    lens: bool
    click_px: float
    seed: int

    @property
    def camera(self) -> str:
        """Name of the camera."""
        return self.film.stem.rpartition("-")[0]

    @property
    def key(self) -> tuple[str, str, str]:
        """What tells it from other cases in the table."""
        lens = "given" if self.lens else "unknown"
        off = f"{self.click_px:g} px ({self.seed})" if self.click_px else "exact"
        return self.film.stem, lens, off

    def beside(self, suffix: str) -> Path:
        """A file of the film's camera."""
        return self.film.with_name(self.camera + suffix)

    def scene(self) -> Scene:
        """What a user would give."""
        scene = load_scene(self.beside(".scene.json"))
        px = scene.points_px
        if self.click_px:
            rng = np.random.default_rng([self.seed, len(px)])
            px = px + rng.normal(0.0, self.click_px, px.shape)
            reader = cv2.VideoCapture(str(self.film))
            size = [reader.get(c) for c in (cv2.CAP_PROP_FRAME_WIDTH, cv2.CAP_PROP_FRAME_HEIGHT)]
            reader.release()
            px = np.clip(px, 0.0, np.array(size) - 1.0)
        scene = replace(scene, points_px=px)
        return scene if self.lens else replace(scene, camera_matrix=None, distortion=None)


def rendered(
    folder: Path, camera: str, count: int, *, people: bool, width: int, fps: float
) -> list[Path]:
    """Films of one camera, taken from the folder where they are there already."""
    name = f"{camera}-people" if people else camera
    films = [folder / f"{name}-{k}.mp4" for k in range(count)]
    if all(film.exists() for film in films):
        return films
    ice = Ice.uniform(0.0085)
    paths = []
    for k in range(count):
        rng = np.random.default_rng([2026, k])
        throw = Throw(
            speed=float(rng.uniform(1.9, 2.25)),
            angle=float(rng.uniform(-0.025, 0.025)),
            spin=float(rng.choice([-1.0, 1.0]) * rng.uniform(0.8, 1.6)),
        )
        way = Direction.AWAY if k % 2 == 0 else Direction.HOME
        path = slide(ice, throw.release(way), fps=4 * fps).trajectory
        assert path is not None
        # Somebody sweeps for a while in the second half.
        swept = (path.t > 0.5 * path.t[-1]) & (path.t < 0.8 * path.t[-1])
        paths.append(replace(path, throw=k, swept=swept.astype(float)))
    full = CAMERAS[camera].size
    spec = FilmSpec(
        camera=camera, people=people, fps=fps, size=(width, width * full[1] // full[0]), seed=7
    )
    with progress_bar("frame") as shown:
        return render_films(folder, paths, spec, name=name, notes={"mu": 0.0085}, progress=shown)


def score(case: Case) -> dict[str, Any]:
    """One case's row of the table."""
    import time

    cv2.setNumThreads(1)
    row: dict[str, Any] = dict.fromkeys(COLUMNS[4:-1], np.nan)
    film, lens, clicks = case.key
    row |= {"camera": case.camera, "film": film, "lens": lens, "clicks": clicks, "said": ""}
    began = time.process_time()
    try:
        track = track_film(case.film, case.scene())
    except CurlingError as error:
        return row | {"said": str(error).removeprefix(f"{case.film}: "), "rows": 0,
                      "cpu_s": time.process_time() - began}  # fmt: skip
    row["cpu_s"] = time.process_time() - began
    table = read_table(case.film.with_suffix(".truth.csv"), required=TRUTH)
    truth = {name: table.numbers(name) for name in TRUTH}
    about = read_json(case.beside(".truth.json"))
    released = about.get("released_at_s", about.get("throws", [{}])[0].get("released_at_s", 0.0))
    path = track.trajectory
    scored = path.t >= released + OUT_OF_HAND
    if not scored.any():
        return row | {"rows": 0, "said": "seen in the thrower's hand only"}
    t = path.t[scored]
    there = np.column_stack([np.interp(t, truth["t"], truth[axis]) for axis in ("x", "y")])
    off, sigma = path.xy[scored] - there, path.sigma_xy[scored]
    away = np.linalg.norm(off, axis=1)
    turned = path.theta[scored] - np.interp(t, truth["t"], truth["theta"])
    miss = np.angle(np.exp(1j * turned[np.isfinite(turned)]))
    row |= {
        "rows": int(scored.sum()),
        "rms_mm": 1e3 * float(np.sqrt(np.mean(away**2))),
        "worst_mm": 1e3 * float(away.max()),
        "sigma_mm": 1e3 * float(np.sqrt(2 * np.mean(sigma**2))),
        "camera_mm": 1e3 * float(np.sqrt(np.mean(np.sum(camera_error(case, track) ** 2, axis=1)))),
        "within_95": float(np.mean(np.abs(off) <= NORMAL_95 * sigma[:, None])),
        "rms_sigmas": float(np.sqrt(np.mean((off / sigma[:, None]) ** 2))),
        "worst_sigmas": float(np.max(np.abs(off) / sigma[:, None])),
        "heading_rad": float(np.sqrt(np.mean(miss**2))) if len(miss) else np.nan,
        "short_s": max(rest_of(truth) - float(t[-1]), 0.0),
    }
    if t[-1] - t[0] >= LEAST_SLIDE:
        try:
            estimate = estimate_ice([path], uniform=True)
            row["mu_error_percent"] = 100 * (estimate.mu / about["mu"] - 1)
            row["mu_sigmas"] = (estimate.mu - about["mu"]) / estimate.sigma
        except CurlingError as error:
            row["said"] = str(error)
    return row


def rest_of(truth: dict[str, Floats]) -> float:
    """Return the time from which the stone lies still, or that of the last frame [s]."""
    paces = np.hypot(np.diff(truth["x"]), np.diff(truth["y"])) / np.diff(truth["t"])
    return float(truth["t"][1:][paces > RESTS].max(initial=truth["t"][0]))


def camera_error(case: Case, track: FilmTrack) -> Floats:
    """How far the camera alone misplaces the stone along its path, (n, 2) [m]."""
    true = camera_from_scene(load_scene(case.beside(".scene.json")), track.camera.size)
    xy, middle = track.trajectory.xy, track.appearance.model.height / 2
    px = track.camera.project(np.column_stack([xy, np.full(len(xy), middle)]))
    return xy - true.on_plane(px, middle)


def summary(rows: list[dict[str, Any]]) -> str:
    """The table by camera, people, lens and clicks: the middle and the worst of each."""
    lines = [
        "| camera | lens | clicks | films | rms mm, middle (worst) | expected by σ mm | in 95 % "
        "intervals | worst miss in σ | heading rad | μ error %, middle (worst) | μ within 95 % | "
        "not tracked |",
        "|---|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    groups: dict[tuple[str, str, str], list[dict[str, Any]]] = {}
    for row in rows:
        groups.setdefault((row["camera"], row["lens"], row["clicks"].split(" (")[0]), []).append(
            row
        )
    for (camera, lens, clicks), group in groups.items():
        tracked = [row for row in group if row["rows"]]
        text = f"| {camera} | {lens} | {clicks} | {len(group)} | "
        if tracked:
            text += (
                f"{_middle(tracked, 'rms_mm'):.1f} ({_most(tracked, 'rms_mm'):.1f}) | "
                f"{_middle(tracked, 'sigma_mm'):.1f} | "
                f"{100 * np.mean([row['within_95'] for row in tracked]):.0f} % | "
                f"{_most(tracked, 'worst_sigmas'):.1f} | {_middle(tracked, 'heading_rad'):.2f} | "
                f"{_middle(tracked, 'mu_error_percent'):.2f} "
                f"({_most(tracked, 'mu_error_percent'):.2f}) | "
                f"{_mu_held(tracked)} | "
            )
        else:
            text += " | | | | | | | "
        lines.append(text + f"{len(group) - len(tracked)} |")
    return "\n".join(lines)


def _middle(rows: list[dict[str, Any]], column: str) -> float:
    values = _known(rows, column)
    return float(np.median(values)) if len(values) else np.nan


def _most(rows: list[dict[str, Any]], column: str) -> float:
    values = _known(rows, column)
    return float(values.max()) if len(values) else np.nan


def _mu_held(rows: list[dict[str, Any]]) -> str:
    """In how many of the cases the interval of μ holds the truth."""
    away = _known(rows, "mu_sigmas")
    return f"{np.sum(away <= NORMAL_95)} of {len(away)}"


def _known(rows: list[dict[str, Any]], column: str) -> Floats:
    values = np.abs([float(row[column]) for row in rows])
    return values[np.isfinite(values)]


def cases(films: list[Path], lenses: tuple[bool, ...], clicks: int, px: float) -> Iterator[Case]:
    """Every way in which every film is tracked."""
    for film in films:
        for lens in lenses:
            yield Case(film=film, lens=lens, click_px=0.0, seed=0)
            for seed in range(clicks):
                yield Case(film=film, lens=lens, click_px=px, seed=seed)


NAMES = re.compile(r"(?P<camera>[a-z_]+)(?P<lines>[0-9]+)f(?P<rate>[0-9]+)-[0-9]+")
"""Of films by `other_films.py`."""


def balanced(films: list[Path], px: float, turn: int = 0) -> list[Case]:
    """One way for each film; see the top of this file.

    Parameters
    ----------
    px : error of points that are off
    turn : 0 to 3; another one gives every film another way
    """
    about = [(film, match) for film in films if (match := NAMES.fullmatch(film.stem))]
    ranks = [
        {value: k for k, value in enumerate(sorted({match[part] for _, match in about}))}
        for part in ("camera", "lines", "rate")
    ]
    chosen: list[tuple[int, Case]] = []
    for film, match in about:
        way = sum(rank[value] for rank, value in zip(ranks, match.groups(), strict=True))
        way = (way + turn) % 4
        case = Case(film=film, lens=way < 2, click_px=px if way % 2 else 0.0, seed=0)
        chosen.append((int(match["lines"]), case))
    return [case for _, case in sorted(chosen, key=lambda one: (one[0], one[1].film.stem))]


def margins(rows: list[dict[str, Any]]) -> str:
    """The table by one thing at a time: how often intervals hold, of places and of μ.

    The rows of one film err together, so that its intervals hold all of them or few. Whether σ is
    right shows over films: the root mean square of error over σ.
    """

    def named(part: str) -> Callable[[dict[str, Any]], str]:
        return lambda row: NAMES.sub(rf"\g<{part}>", row["film"])

    parts: dict[str, Callable[[dict[str, Any]], str]] = {
        "camera": named("camera"),
        "lines": named("lines"),
        "frames/s": named("rate"),
        "lens": lambda row: row["lens"],
        "points": lambda row: row["clicks"].split(" (")[0],
        "all": lambda row: "",
    }
    lines = [
        "| | films | rms mm, middle (worst) | of the camera | expected by σ mm | error / σ, "
        "rms | in 95 % intervals | films below 90 % | above 98 % | μ within 95 % | not tracked |",
        "|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    for name, part in parts.items():
        for value in sorted({part(row) for row in rows}):
            group = [row for row in rows if part(row) == value]
            tracked = [row for row in group if row["rows"]]
            held = _known(tracked, "within_95")
            ratio = _known(tracked, "rms_sigmas")
            lines.append(
                f"| {name} {value} | {len(group)} | {_middle(tracked, 'rms_mm'):.1f} "
                f"({_most(tracked, 'rms_mm'):.1f}) | {_middle(tracked, 'camera_mm'):.1f} | "
                f"{_middle(tracked, 'sigma_mm'):.1f} | "
                f"{np.sqrt(np.mean(ratio**2)) if len(ratio) else np.nan:.2f} | "
                f"{100 * np.mean(held) if len(held) else np.nan:.0f} % | {np.sum(held < 0.9)} | "
                f"{np.sum(held > 0.98)} | {_mu_held(tracked)} | {len(group) - len(tracked)} |"
            )
    return "\n".join(lines)


def main(
    output: Annotated[Path, typer.Option("-o", "--output", metavar="DIR")] = Path(
        "runs/tracking_accuracy"
    ),
    films_in: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Films with truth, instead of rendered ones.")
    ] = None,
    cameras: Annotated[str, typer.Option(help="Names, with commas.")] = CAMERAS_TOLD,
    films: Annotated[int, typer.Option(min=1, help="Of each camera, without and with people.")] = 1,
    people: Annotated[str, typer.Option(help="no, yes or both.")] = "both",
    lens: Annotated[str, typer.Option(help="given, unknown or both.")] = "both",
    clicks: Annotated[int, typer.Option(min=0, help="Sets of clicks that are off.")] = 2,
    click_px: Annotated[float, typer.Option(help="By how much, a coordinate [px].")] = 3.0,
    width: Annotated[int, typer.Option(help="Of rendered films [px].")] = 1920,
    fps: Annotated[float, typer.Option(help="Of rendered films.")] = 15.0,
    workers: Annotated[int, typer.Option(min=1)] = 1,
    one_way_each: Annotated[
        bool, typer.Option("--balanced", help="All films there are, each in one way.")
    ] = False,
    turn: Annotated[
        int, typer.Option(min=0, max=3, help="Of --balanced: other ways for all films.")
    ] = 0,
) -> None:
    """Track films whose truth is known, in every way, and tell how far off the tracks are."""
    folder = make_directory(output)
    chosen: list[Path] = []
    if one_way_each:
        if films_in is None:
            raise typer.BadParameter("--balanced needs --films-in")
        films_there = sorted(films_in.glob("*-[0-9]*.mp4"))
        chosen = [film for film in films_there if film.with_suffix(".truth.csv").exists()]
    for camera in () if one_way_each else cameras.split(","):
        if films_in is not None:
            chosen += sorted(films_in.glob(f"{camera}-[0-9]*.mp4"))
            continue
        for with_people in {"no": (False,), "yes": (True,), "both": (False, True)}[people]:
            chosen += rendered(
                make_directory(folder / "films"), camera, films, people=with_people, width=width,
                fps=fps,
            )  # fmt: skip
    lenses = {"given": (True,), "unknown": (False,), "both": (True, False)}[lens]
    todo = list(cases(chosen, lenses, clicks, click_px))
    if one_way_each:
        todo = balanced(chosen, click_px, turn)
    done = _done(folder / "cases.csv")
    todo = [case for case in todo if case.key not in done]
    rows = list(done.values())
    with executor(workers) as work, progress_bar("film") as progress:
        for row in with_progress(work.map(score, todo), "tracking", progress, len(todo)):
            rows.append(row)
            print(_line(row), file=sys.stderr, flush=True)
            write_table(
                folder / "cases.csv", {name: [row[name] for row in rows] for name in COLUMNS}
            )
    print(margins(rows) if one_way_each else summary(rows))
    say(f"every case in {folder / 'cases.csv'}")


def _done(path: Path) -> dict[tuple[str, str, str], dict[str, Any]]:
    """The rows that an earlier call has written."""
    if not path.exists():
        return {}
    with path.open(newline="") as file:
        rows: list[dict[str, Any]] = list(csv.DictReader(file))
    for row in rows:
        row |= {name: float(row.get(name) or "nan") for name in COLUMNS[4:-1]}
    return {(row["film"], row["lens"], row["clicks"]): row for row in rows}


def _line(row: dict[str, Any]) -> str:
    return (
        f"{row['film']}, lens {row['lens']}, clicks {row['clicks']}: "
        f"rms {row['rms_mm']:.1f} mm, σ {row['sigma_mm']:.1f}, worst {row['worst_mm']:.0f} mm = "
        f"{row['worst_sigmas']:.1f} σ, 95 %: {row['within_95']:.2f}, "
        f"heading {row['heading_rad']:.2f}, μ {row['mu_error_percent']:+.2f} % = "
        f"{row['mu_sigmas']:+.1f} σ, "
        f"{row['cpu_s']:.0f} s CPU {row['said']}"
    )


if __name__ == "__main__":
    try:
        typer.run(main)
    except CurlingError as error:
        sys.exit(f"tracking_accuracy: {error}")
