"""What tests of all three packages share."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

# Before NumPy and OpenCV are imported: tests run side by side, each on one core.
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ.setdefault(_name, "1")
# Pictures are drawn to files only, and a window never opens.
os.environ.setdefault("MPLBACKEND", "Agg")
os.environ.setdefault("SDL_VIDEODRIVER", "dummy")

import numpy as np
import pytest
from hypothesis import settings

# A slow or busy machine must not make a property fail, and every run tries the same cases.
settings.register_profile("curling", deadline=None, derandomize=True, max_examples=50)
settings.load_profile("curling")


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """What a run of `curling` left: its exit status, and what it said where."""

    status: int
    out: str
    err: str

    def json(self) -> Any:
        return json.loads(self.out)

    @property
    def complaint(self) -> str:
        """The one line with which bad input is refused; fails if it was not refused so."""
        assert self.status == 2, (self.status, self.err)
        lines = self.err.strip().splitlines()
        assert len(lines) == 1, self.err
        assert lines[0].startswith("curling: "), self.err
        return lines[0].removeprefix("curling: ")


@pytest.fixture
def as_filmed() -> Callable[..., Any]:
    """Make exact tracks err as those from films do, by what was measured of films.

    Smoothly, for seconds, by 0.5 mm across and 1.5 mm along the sheet and 0.03 rad in heading; and,
    all tracks alike, by 2 mm that belong to the place. They claim 2.3 mm and 0.05 rad.
    """
    from dataclasses import replace

    def wander(u: Any, rng: np.random.Generator, *, period: float) -> Any:
        number = 2 * np.pi / (period * rng.uniform(0.5, 4.0, 24))
        return np.cos(u[:, None] * number + rng.uniform(0, 2 * np.pi, 24)).sum(axis=1) / 12**0.5

    def make(tracks: list[Any], seed: int) -> list[Any]:
        out: list[Any] = []
        for track in tracks:
            own = np.random.default_rng([seed, track.throw])
            common = np.random.default_rng(seed)
            n, y = len(track), track.xy[:, 1]
            shared = [wander(y, common, period=20.0) for _ in range(4)]
            error = 0.002 * np.column_stack(
                [shared[k] + shared[k + 2] * track.xy[:, 0] for k in range(2)]
            )
            lasting = [size * wander(track.t, own, period=3.0) for size in (0.0005, 0.0015, 0.03)]
            out.append(
                replace(
                    track,
                    xy=track.xy + error + np.column_stack(lasting[:2]),
                    theta=track.theta + lasting[2],
                    sigma_xy=np.full(n, 0.0023),
                    sigma_theta=np.full(n, 0.05),
                )
            )
        return out

    return make


@pytest.fixture
def curling(capfd: pytest.CaptureFixture[str]) -> Callable[..., Outcome]:
    """Run the `curling` command in this process: ``curling("throw", "--ice", "paper", ...)``."""
    from curling_env.commands.cli import main

    def run(*arguments: object) -> Outcome:
        capfd.readouterr()
        try:
            status = main([str(argument) for argument in arguments])
        except SystemExit as exit:
            status = int(exit.code or 0)
        out, err = capfd.readouterr()
        return Outcome(status=status, out=out, err=err)

    return run


@pytest.fixture
def rng() -> np.random.Generator:
    """Randomness that is the same in every run."""
    return np.random.default_rng(20261121)


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    """A real browser without a window (Playwright's, driving the Chromium or Chrome found here).

    Skips where the machine has none.
    """
    names = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
    program = next(filter(None, map(shutil.which, names)), None)
    if program is None:
        pytest.skip("no Chromium or Chrome on this machine")
    from playwright.sync_api import sync_playwright

    with sync_playwright() as driver:
        opened = driver.chromium.launch(executable_path=program, args=["--no-sandbox"])
        yield opened
        opened.close()


@pytest.fixture
def page(browser: Any) -> Iterator[Any]:
    """A fresh page of that browser; the test fails if the page reports an error of its own."""
    opened = browser.new_page(viewport={"width": 1280, "height": 800})
    errors: list[str] = []
    opened.on("pageerror", lambda error: errors.append(str(error)))
    opened.on("console", lambda said: errors.append(said.text) if said.type == "error" else None)
    yield opened
    opened.close()
    assert errors == []
