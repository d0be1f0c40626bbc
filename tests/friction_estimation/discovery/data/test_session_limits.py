"""Tracks that exceed a session's limits are rejected before time and memory are spent."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from curling_env.errors import InputError
from curling_env.ice import Ice
from curling_env.sheet import PAPER_SHEET
from curling_env.trajectory import Trajectory
from friction_estimation import discover, estimate_ice
from friction_estimation.discovery import open_session
from friction_estimation.discovery.data.session import (
    _refuse_beyond_a_session,
    refuse_too_many_cells,
)
from friction_estimation.tracks import load_tracks


def track(rows: int = 20, seconds: float = 10.0, throw: int = 0) -> Trajectory:
    t = np.linspace(0, seconds, rows)
    y = -10 + 2 * t - 0.045 * np.minimum(t, 20) ** 2
    return Trajectory(t=t, xy=np.column_stack([np.zeros(rows), y]), throw=throw)


@pytest.mark.parametrize(
    ("tracks", "complaint"),
    [
        ([track(), track(rows=20_001, throw=7)], "throw 7 has 20001 rows"),
        ([track(seconds=901.0)], "throw 0 lasts 901 s"),
        ([track(throw=k) for k in range(1001)], "1001 throws are too many"),
        ([track(), track(throw=2), track(throw=2)], "two tracks have throw 2 and stone 0"),
    ],
)
def test_more_than_a_session_is_refused(tracks: list[Trajectory], complaint: str) -> None:
    with pytest.raises(InputError, match=complaint):
        open_session(tracks)


def test_a_map_finer_than_a_stone_is_refused() -> None:
    fine = Ice.uniform(0.009, sheet=replace(PAPER_SHEET, cell_size=0.05))
    with pytest.raises(InputError, match="is too fine to be fitted"):
        estimate_ice([track()], start=fine)
    with pytest.raises(InputError, match="is too fine to be fitted"):
        discover([track()], fine)


def test_more_throws_than_anybody_makes_are_refused(tmp_path: Path) -> None:
    rows = "".join(f"{k},0,0,0,0\n{k},1,0,1,0\n" for k in range(10_001))
    (tmp_path / "t.csv").write_text("throw,t,x,y,theta\n" + rows)
    with pytest.raises(InputError, match=r"t\.csv: has 10001 throws"):
        load_tracks(tmp_path / "t.csv")


def test_the_largest_session_is_accepted() -> None:
    """A thousand throws, 20 000 rows, a quarter of an hour, and cells of a stone's band."""

    class Long(SimpleNamespace):
        def __len__(self) -> int:
            return 20_000

    every: list[Any] = [Long(throw=k, duration=900.0) for k in range(1000)]
    _refuse_beyond_a_session(every)
    for cells, refused in ((25_000, False), (25_001, True)):
        ice: Any = SimpleNamespace(friction=SimpleNamespace(mu=np.zeros(cells)))
        if not refused:
            refuse_too_many_cells(ice)
            continue
        with pytest.raises(InputError, match="25001 cells is too fine"):
            refuse_too_many_cells(ice)
    refuse_too_many_cells(None)
