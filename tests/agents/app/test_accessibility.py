"""Every screen for those who do not see it, or not well: axe-core finds nothing to complain of."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("starlette", reason="the extra `app` is not installed")

from agents.app import SCREENS, Club, keep_target, remove
from agents.app.take_in import take_in
from agents.app.work.causes import prepare
from curling_env.ice import load_ice, save_ice
from curling_env.physics import slide
from curling_env.throw import Throw
from curling_env.trajectory import write_tracks

PATHS = [*(screen.name for screen in SCREENS), "throws/1/1", "no-such-page"]
SIZES = {"laptop": (1366, 768), "phone": (390, 844)}


@pytest.fixture(scope="module")
def address(
    tmp_path_factory: pytest.TempPathFactory,
    work_off: Callable[[Club], list[str]],
    serve_club: Callable[[Club], AbstractContextManager[str]],
) -> Iterator[str]:
    """Address of a club with six throws by two athletes, and their ice."""
    folder: Path = tmp_path_factory.mktemp("evening")
    ice = load_ice("standard")
    rng = np.random.default_rng(3)
    tracks, rows = [], ["throw,athlete,stone,called"]
    for k in range(6):
        throw = Throw(speed=2.08 + rng.normal(0, 0.02), angle=0.05, spin=-1.2)
        path = slide(ice, throw.release(), fps=10.0, throw=k).trajectory
        assert path is not None
        tracks.append(path)
        rows.append(f"{k},{('Anna', 'Ben')[k % 2]},red {k % 3},draw button in broom 1.4 left")
    write_tracks(folder / "tracks.csv", tracks)
    (folder / "throws.csv").write_text("\n".join(rows))
    save_ice(ice, folder / "ice.json")
    club = Club(tmp_path_factory.mktemp("club"))
    session = take_in(club, folder, name="Tuesday", day="2026-11-17", sheet="Sheet 2")
    keep_target(club, "pocket", 0.6, 17.0)
    for _ in range(2):
        other = club.add_session("Wednesday", "2026-11-16", "Sheet 2", None)
        remove(club, "session", other.id)
    remove(club, "throw", club.throws(session)[-1].id)
    prepare(club, session)
    assert work_off(club) == ["causes"]
    with serve_club(club) as address:
        yield address


@pytest.mark.parametrize(("size", "scheme"), [("laptop", "light"), ("phone", "dark")])
def test_every_screen_can_be_used_without_seeing_it(browser, address, size, scheme):
    axe = pytest.importorskip("axe_playwright_python.sync_playwright")
    width, height = SIZES[size]
    context = browser.new_context(
        viewport={"width": width, "height": height},
        color_scheme=scheme,
        reduced_motion="reduce",
        bypass_csp=True,  # axe-core is put into the page as text
    )
    page = context.new_page()
    found: list[str] = []
    for path in PATHS:
        page.goto(address + path, wait_until="load")
        for details in page.locator("details.remove").all():
            details.evaluate("(it) => { it.open = true; }")
        if page.evaluate("document.documentElement.scrollWidth > innerWidth"):
            found.append(f"{path}: wider than the screen")
        for problem in axe.Axe().run(page).response["violations"]:
            nodes = [node["html"][:160] for node in problem["nodes"][:3]]
            found.append(f"{path}: {problem['id']}: {problem['help']}: {nodes}")
    context.close()
    assert found == []
