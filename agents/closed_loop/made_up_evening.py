"""A made-up evening of practice in files: three athletes, eight stones, forty throws.

Everything is measured as on a real evening: only the throws, the camera and the coach are made up.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from agents.closed_loop.patches import patchy_ice
from curling_env.ice import ActiveEffect, Ice, save_ice
from curling_env.infrastructure.files.storage import write_table
from curling_env.infrastructure.files.writing import make_directory
from curling_env.infrastructure.provenance import provenance
from curling_env.physics.aim import Aim
from curling_env.physics.slides import play_bounds, slide
from curling_env.sheet import HOG_LINE_Y, HOG_TO_TEE, TEE_Y, Direction, to_delivery
from curling_env.throw import Throw
from curling_env.trajectory import Trajectory, read_tracks, write_tracks
from curling_env.typing import Progress, no_progress, part_of_progress, with_progress
from friction_estimation.camera.scene import save_scene
from friction_estimation.estimation.whole_ice import estimate_ice
from friction_estimation.synthetic import FilmSpec, render_film, scene_of

SCENE = "gantry.scene.json"
THROWS, FILMED, STONES = 40, 3, 8
BETWEEN = 75.0
"""Time from one throw to the next [s]."""
FPS, CAMERA_NOISE = 15.0, 0.004
"""Frame rate of the tracks [1/s], and standard deviation of their coordinates [m]."""
SEEN_BEFORE = 4.2
"""Time before the hog line from which the camera sees a stone [s]."""
FILM = FilmSpec(
    camera="gantry", size=(800, 450), fps=10.0, noise=1.0, people=False, lead_in=0.5, tail=0.5
)
ODD = {2: (1.03, 1.0), 5: (1.0, 0.88)}
"""Factors of friction and curl of the set's two odd stones: one is heavy, one curls less."""
OWN_FRICTION, OWN_CURL = 0.006, 0.03
"""Relative spread of friction and curl among throws of one stone: frost, hair, dust."""
CALLS = (
    ("draw button", 0.0, 0.0),
    ("draw top four", 0.0, -0.38),
    ("guard centre guard", 0.0, -3.2),
    ("draw 0.6,0.3", 0.6, 0.3),
    ("draw -0.6,0.3", -0.6, 0.3),
)
"""Calls, and their targets: right of the centre line and past the tee [m]."""


@dataclass(frozen=True, kw_only=True)
class AthleteHand:
    """Execution error of an athlete.

    Parameters
    ----------
    speed, angle, spin : bias and standard deviation of each at the release [m/s, rad, rad/s]
    """

    name: str
    hand: str
    speed: tuple[float, float]
    angle: tuple[float, float]
    spin: tuple[float, float]


ATHLETES = (
    AthleteHand(name="Anna", hand="right", speed=(0.012, 0.02), angle=(0, 0.004), spin=(0, 0.12)),
    AthleteHand(
        name="Ben", hand="left", speed=(-0.02, 0.03), angle=(0.005, 0.006), spin=(0.1, 0.2)
    ),
    AthleteHand(
        name="Clara", hand="right", speed=(0, 0.035), angle=(-0.004, 0.007), spin=(0, 0.15)
    ),
)


def write_evening(folder: Path, *, seed: int = 0, progress: Progress = no_progress) -> Ice:
    """Write the tracks, notes, films, scene and ice of a made-up evening; return the ice believed.

    Parameters
    ----------
    folder : for `tracks.csv`, `throws.csv`, `athletes.csv`, `ice.json` and `films`
    seed : of the ice, the throws and the films
    progress : called as it advances

    Returns
    -------
    the ice that the team took it for: of the same level everywhere
    """
    rng = np.random.default_rng(seed)
    truth = patchy_ice(rng)
    # The skip takes the ice for even.
    even = np.full_like(truth.friction.mu, np.median(truth.friction.mu))
    believed = replace(truth, friction=replace(truth.friction, mu=even))
    paths: list[Trajectory] = []
    columns: dict[str, list[str]] = {"throw": [], "athlete": [], "stone": [], "called": []}
    for k in range(THROWS):
        athlete = ATHLETES[k % len(ATHLETES)]
        path, called = _throw(_ice_of_throw(truth, k % STONES, rng), believed, k, athlete, rng)
        paths.append(path)
        noted = (str(k), athlete.name, f"red {path.stone + 1}", called)
        for column, value in zip(columns.values(), noted, strict=True):
            column.append(value)
    films = make_directory(folder / "films")
    save_scene(scene_of(FILM.resolved(), sheet=truth.sheet, stone=truth.stone), films / SCENE)
    jobs = [
        _Job(path=films / f"evening-{k}.mp4", track=paths[k], ice=truth, spec=FILM)
        for k in range(THROWS - FILMED, THROWS)
    ]
    filming = part_of_progress(progress, 0.0, 0.6)
    done = map(_film, jobs)
    filmed = list(with_progress(done, "filming the last throws", filming, len(jobs)))
    shown = [_before(path) for path in paths[: THROWS - FILMED]] + filmed
    write_tracks(folder / "tracks.csv", [_seen(path, rng) for path in shown])
    write_table(folder / "throws.csv", columns)
    write_table(
        folder / "athletes.csv",
        {"athlete": [a.name for a in ATHLETES], "hand": [a.hand for a in ATHLETES]},
    )
    # A quick estimate, of the map alone: the law of this ice is known.
    tracks = read_tracks(folder / "tracks.csv")
    estimating = part_of_progress(progress, 0.6, 1.0)
    ice = estimate_ice(tracks, effects="none", start=believed, progress=estimating).ice
    save_ice(ice, folder / "ice.json", provenance=provenance(seed=seed))
    return believed


def _ice_of_throw(ice: Ice, stone: int, rng: np.random.Generator) -> Ice:
    """Return the ice of one throw, with the deviations of its stone and of the throw."""
    friction, curl = ODD.get(stone, (1.0, 1.0))
    own = {
        "stone": float(stone),
        "factor": friction * float(np.exp(OWN_FRICTION * rng.standard_normal())),
        "curl_factor": curl * float(np.exp(OWN_CURL * rng.standard_normal())),
    }
    return ice.with_effect(ActiveEffect(name="stone_bias", parameters=own))


@dataclass(frozen=True, kw_only=True, eq=False)
class _Job:
    """A film to render."""

    path: Path
    track: Trajectory
    ice: Ice
    spec: FilmSpec


def _film(job: _Job) -> Trajectory:
    spec = replace(job.spec, seed=job.track.throw)
    truth = render_film(job.path, job.track, spec, sheet=job.ice.sheet, stone=job.ice.stone)
    about = {"throw": job.track.throw, "stone": job.track.stone, "clock": job.track.clock}
    return replace(truth, **about)


def _throw(
    truth: Ice, believed: Ice, k: int, athlete: AthleteHand, rng: np.random.Generator
) -> tuple[Trajectory, str]:
    """Return the true path of a throw, and its call, planned on the believed ice."""
    direction = Direction.AWAY if k // STONES % 2 == 0 else Direction.HOME
    what, right, past = CALLS[int(rng.integers(len(CALLS)))]
    inward = bool(rng.random() < 0.5)
    left_hand = athlete.hand == "left"
    spin = 1.25 * (-1.0 if inward != left_hand else 1.0)
    aimed = Aim(believed, direction).draw(right, past, spin)
    assert aimed is not None  # every call is within reach
    thrown = Throw(
        speed=aimed.speed + float(rng.normal(*athlete.speed)),
        angle=aimed.angle + float(rng.normal(*athlete.angle)),
        spin=spin + float(rng.normal(*athlete.spin)),
    )
    order = {"clock": BETWEEN * k, "order": k, "stone": k % STONES}
    release = thrown.release(direction, **order)
    path = slide(truth, release, bounds=play_bounds(truth, direction), fps=60.0, throw=k).trajectory
    assert path is not None  # a rate was given
    bounds = play_bounds(believed, direction)
    meant = slide(believed, aimed.release(direction), bounds=bounds, fps=60.0)
    assert meant.trajectory is not None
    ahead = to_delivery(meant.trajectory.xy, direction)[:, 1]
    weight = float(np.interp(-HOG_TO_TEE, ahead, meant.trajectory.t))
    broom = -(TEE_Y + HOG_LINE_Y) * float(np.tan(aimed.angle))
    side = "right" if broom >= 0 else "left"
    called = f"{what} {'in' if inward else 'out'} broom {abs(broom):.2f} {side} {weight:.1f} s"
    path = replace(path, stone=k % STONES, clock=BETWEEN * k)
    return path, called


def _before(path: Trajectory) -> Trajectory:
    """Return a path with the delivery before the hog line, in a sliding hand."""
    steps = np.arange(-round(SEEN_BEFORE * 60), 0) / 60.0
    v = (path.xy[1] - path.xy[0]) / (path.t[1] - path.t[0])
    turned = path.theta[0] if path.theta.size else 0.0
    t = np.concatenate([steps, path.t - path.t[0]]) + SEEN_BEFORE
    xy = np.concatenate([path.xy[0] + steps[:, None] * v, path.xy])
    theta = np.concatenate([np.full(len(steps), turned), path.theta])
    swept = np.zeros(len(t))
    return replace(path, t=t, xy=xy, theta=theta, swept=swept)


def _seen(path: Trajectory, rng: np.random.Generator) -> Trajectory:
    """Return a path as a camera measures it: at its frame rate, with errors and their sigma."""
    t = np.arange(path.t[0], path.t[-1], 1 / FPS)
    columns = [np.interp(t, path.t, column) for column in (*path.xy.T, path.theta)]
    xy = np.column_stack(columns[:2]) + rng.normal(0.0, CAMERA_NOISE, (len(t), 2))
    theta = columns[2] + rng.normal(0.0, 0.015, len(t))
    return Trajectory(
        t=t,
        xy=xy,
        theta=theta,
        sigma_xy=np.full(len(t), CAMERA_NOISE),
        sigma_theta=np.full(len(t), 0.015),
        throw=path.throw,
        stone=path.stone,
        clock=path.clock,
    )
