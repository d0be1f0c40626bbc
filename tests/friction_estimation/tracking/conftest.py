"""A practice film: three throws; one stone is slid back and picked up, and one stays."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from curling_env.ice import Ice
from curling_env.physics import slide
from curling_env.throw import Throw
from curling_env.trajectory import Trajectory
from friction_estimation import Scene
from friction_estimation.camera import save_scene
from friction_estimation.synthetic import (
    HANDLE_COLOURS,
    FilmRenderer,
    FilmSpec,
    StoneOnIce,
    on_film,
    scene_of,
    write_film,
)
from tests.friction_estimation.home_half import home_half

FPS = 6.0
SPEC = FilmSpec(camera=home_half((960, 540)), people=False, fps=FPS, lead_in=0.0, tail=0.5)


@dataclass(frozen=True, kw_only=True)
class PracticeFilm:
    """A film of several throws.

    Parameters
    ----------
    path, scene : the film, and its camera's view
    begins : when each stone appears [s]
    truths : where it then is in each frame
    """

    path: Path
    scene: Scene
    begins: tuple[float, ...]
    truths: tuple[Trajectory, ...]


@pytest.fixture(scope="session")
def practice(tmp_path_factory: pytest.TempPathFactory) -> PracticeFilm:
    folder = tmp_path_factory.mktemp("practice")
    ice = Ice.uniform(0.03)
    throws = [
        slide(ice, Throw(speed=speed, angle=angle, spin=1.2).release(), fps=120, throw=k).trajectory
        for k, (speed, angle) in enumerate([(1.9, 0.02), (2.2, -0.02), (2.0, 0.03)])
    ]
    red, yellow, again = (k for k in throws if k is not None)
    yellow = replace(yellow, stone=1)
    t = np.arange(0.0, 9.5, 0.25)
    slides = np.maximum(t - 2.0, 0.0)  # it is pushed for two seconds
    way = 0.55 * np.minimum(t, 2.0) ** 2 + 2.2 * slides - 0.147 * slides**2
    slid_back = Trajectory(
        t=t,
        xy=red.xy[-1] - np.column_stack([0.0 * t, way]),
        theta=np.full(len(t), red.theta[-1]),
    )
    lying = StoneOnIce(
        x=yellow.xy[-1, 0],
        y=yellow.xy[-1, 1],
        theta=float(yellow.theta[-1]),
        vx=0.0,
        vy=0.0,
        colour=HANDLE_COLOURS[1],
    )
    bare = FilmRenderer(SPEC)
    beside = FilmRenderer(SPEC, resting=[lying])
    begins: list[float] = []

    def pictures() -> Iterator[np.ndarray]:
        empty = np.asarray(bare.still, dtype=np.uint8)
        count = 0
        for renderer, path, after, rests in (
            (bare, None, 5.0, False),
            (bare, red, 4.0, True),
            (bare, slid_back, 3.0, False),
            (bare, yellow, 4.0, True),
            (beside, again, 1.0, True),
        ):
            shown = [] if path is None else list(renderer.frames(path, seed=len(begins)))
            if path is not None and path is not slid_back:
                begins.append(count / FPS)
            shown += [shown[-1] if rests else empty] * int(after * FPS)
            count += len(shown)
            yield from shown

    film = folder / "practice.mp4"
    write_film(film, pictures(), FPS)
    truths = tuple(on_film(path, SPEC) for path in (red, yellow, again))
    scene = scene_of(bare.camera)
    save_scene(scene, folder / "scene.json")
    return PracticeFilm(path=film, scene=scene, begins=tuple(begins), truths=truths)
