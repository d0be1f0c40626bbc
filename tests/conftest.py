"""Fixtures and settings that the tests of all three packages share."""

from __future__ import annotations

import json
import os
import re
import shutil
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

# Before NumPy and OpenCV are imported: tests run side by side, each on one core.
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ.setdefault(_name, "1")
# Pictures are drawn to files only, and a window never opens.
os.environ.setdefault("MPLBACKEND", "Agg")
os.environ.setdefault("SDL_VIDEODRIVER", "dummy")
# An internal error fails a test with its traceback, instead of becoming one line.
os.environ.setdefault("CURLING_TRACEBACK", "1")

import numpy as np
import pytest
from hypothesis import settings

# `make test` tries the same examples in every run; `make soak` draws new ones from its seed. No
# profile has a deadline: a busy machine must not fail a property.
settings.register_profile("repeatable", deadline=None, derandomize=True, max_examples=50)
# Both set `derandomize`, because Hypothesis's default differs where the variable CI is set.
settings.register_profile(
    "soak", deadline=None, derandomize=False, max_examples=1000, print_blob=True
)
settings.load_profile(os.environ.get("CURLING_HYPOTHESIS", "repeatable"))


def pytest_terminal_summary(terminalreporter: Any) -> None:
    """List in one line the tests that could not run on this machine, and why."""
    skipped = terminalreporter.stats.get("skipped", [])
    reasons = Counter(report.longrepr[2].removeprefix("Skipped: ") for report in skipped)
    if reasons:
        counts = "; ".join(f"{n}: {reason}" for reason, n in reasons.most_common())
        terminalreporter.write_line(f"not run: {len(skipped)} tests ({counts})")


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """The exit status of a run of `curling`, and what it wrote to stdout and stderr."""

    status: int
    out: str
    err: str

    def json(self) -> Any:
        return json.loads(self.out)

    @property
    def complaint(self) -> str:
        """The one line on stderr that refuses bad input; fails if the input was not refused."""
        assert self.status == 2, (self.status, self.err)
        lines = self.err.strip().splitlines()
        assert len(lines) == 1, self.err
        assert lines[0].startswith("curling: "), self.err
        return lines[0].removeprefix("curling: ")


@cache
def schema_validator(name: str) -> Any:
    """Return the validator of documents by docs/schemas/NAME.schema.json."""
    from jsonschema import Draft202012Validator

    folder = Path(__file__).parents[1] / "docs" / "schemas"
    schema = json.loads((folder / f"{name}.schema.json").read_text(encoding="utf-8"))
    Draft202012Validator.check_schema(schema)
    return Draft202012Validator(schema)


@pytest.fixture
def must_fit() -> Callable[..., None]:
    """Check a JSON file, or each line of a file of JSON lines, against its published schema."""

    def hold(path: Path, schema: str) -> None:
        text = path.read_text(encoding="utf-8")
        for line in text.splitlines() if path.suffix == ".jsonl" else [text]:
            schema_validator(schema).validate(json.loads(line))

    return hold


@pytest.fixture
def unchanged(request: pytest.FixtureRequest) -> Any:
    """Hold all of a result against what it was; see `snapshots`."""
    from tests.snapshots import Snapshots

    name = re.sub(r"\W+", "-", request.node.name.removeprefix("test_")).strip("-")
    return Snapshots(folder=request.path.parent / "snapshots" / request.path.stem, name=name)


@pytest.fixture
def as_filmed() -> Callable[..., Any]:
    """Give exact tracks the errors of filmed ones; the amounts were measured on films.

    Each track has smooth errors that last for seconds: 0.5 mm across the sheet, 1.5 mm along it and
    0.03 rad in heading. All tracks share an error of 2 mm that depends on the place only. The
    tracks state σ as 2.3 mm and 0.05 rad.
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
    """A random generator that gives the same numbers in every run."""
    return np.random.default_rng(20261121)


PATIENCE = 120_000
"""Timeout of a page on a busy machine [ms]."""


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    """The Chromium or Chrome of this machine without a window, driven by Playwright.

    Its pages wait up to two minutes for what a test expects. The test is skipped where the machine
    has neither.
    """
    names = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
    program = next(filter(None, map(shutil.which, names)), None)
    if program is None:
        pytest.skip("no Chromium or Chrome on this machine")
    from playwright.sync_api import sync_playwright

    with sync_playwright() as driver:
        opened = driver.chromium.launch(executable_path=program, args=["--no-sandbox"])
        for name in ("new_context", "new_page"):
            setattr(opened, name, _patient(getattr(opened, name)))
        yield opened
        opened.close()


def _patient(make: Callable[..., Any]) -> Callable[..., Any]:
    """Wrap the maker of pages, so that they have the timeout of the tests."""

    def made(**about: Any) -> Any:
        new = make(**about)
        new.set_default_timeout(PATIENCE)
        return new

    return made


@pytest.fixture
def page(browser: Any) -> Iterator[Any]:
    """A new page of that browser; the test fails if the page reports an error."""
    # The pages' own policy forbids the evaluation of text, by which Playwright waits for things.
    opened = browser.new_page(viewport={"width": 1280, "height": 800}, bypass_csp=True)
    errors: list[str] = []
    opened.on("pageerror", lambda error: errors.append(str(error)))
    opened.on(
        "console", lambda message: errors.append(message.text) if message.type == "error" else None
    )
    yield opened
    opened.close()
    assert errors == []
