"""The throws behind an ice: written, read, checked and added to."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from curling_env.errors import InputError
from curling_env.ice import Ice
from curling_env.trajectory import Trajectory
from friction_estimation.estimation.evidence_file import (
    Choices,
    Evidence,
    evidence_path,
    load_evidence,
    save_evidence,
    with_later_throws,
)

ICE = Ice.uniform(0.009)


def track(throw: int, *, shift: float = 0.0, rows: int = 5, stone: int = 0) -> Trajectory:
    t = np.arange(float(rows))
    xy = np.column_stack([0 * t + shift, 2.0 * t - 10.0])
    return Trajectory(t=t, xy=xy, theta=0.1 * t, throw=throw, stone=stone, clock=60.0 * throw)


@pytest.fixture
def saved(tmp_path: Path) -> Path:
    source = tmp_path / "ice.json"
    choices = Choices(effects="none", uniform=True, camera_bias="off", start=Ice.uniform(0.01))
    path = save_evidence([track(3, stone=7), track(5, rows=8)], choices, ICE, source)
    assert path == evidence_path(source) == tmp_path / "ice.evidence.npz"
    return source


def rewritten(source: Path, **changes: np.ndarray) -> None:
    """Write the evidence of an ice again, with other columns; None drops one."""
    path = evidence_path(source)
    with np.load(path) as content:
        columns = {**dict(content), **changes}
    np.savez(path, **{name: column for name, column in columns.items() if column is not None})


def test_throws_and_choices_are_read_as_they_were_written(saved: Path) -> None:
    found = load_evidence(ICE, saved)
    first, second = found.tracks
    assert (first.throw, first.stone, first.clock) == (3, 7, 180.0)
    assert (second.throw, second.stone, second.clock) == (5, 0, 300.0)
    assert first.xy.tolist() == track(3).xy.tolist()
    assert second.t.tolist() == track(5, rows=8).t.tolist()
    choices = found.choices
    assert (choices.effects, choices.uniform, choices.camera_bias) == ("none", True, "off")
    assert choices.prior is None
    assert choices.start is not None
    assert choices.start.friction.mu == pytest.approx(0.01)


def test_labels_that_older_releases_wrote_once_per_throw_are_repeated(saved: Path) -> None:
    """Each throw gets its labels in all of its rows."""
    rewritten(
        saved,
        rows=np.array([5, 8]),
        throw=np.array([3, 5]),
        stone=np.array([7, 0]),
        clock=np.array([180.0, 300.0]),
    )
    assert [(t.throw, t.stone, len(t)) for t in load_evidence(ICE, saved).tracks] == [
        *((3, 7, 5), (5, 0, 8)),
    ]
    rewritten(saved, rows=np.array([5, 8, 0]))
    with pytest.raises(InputError, match="is incomplete"):
        load_evidence(ICE, saved)
    rewritten(saved, rows=np.array([-5, 18]))
    with pytest.raises(InputError, match="is incomplete"):
        load_evidence(ICE, saved)
    rewritten(saved, rows=np.array([5.0, 8.0]))
    with pytest.raises(InputError, match="is incomplete"):
        load_evidence(ICE, saved)


def test_what_is_no_evidence_of_this_ice_is_refused(saved: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="an update needs the evidence"):
        load_evidence(ICE, tmp_path / "other.json")
    other = replace(ICE, friction=replace(ICE.friction, mu=ICE.friction.mu * (1 + 1e-5)))
    with pytest.raises(InputError, match="belongs to another ice"):
        load_evidence(other, saved)
    rounded = replace(ICE, friction=replace(ICE.friction, mu=ICE.friction.mu * (1 + 1e-10)))
    assert load_evidence(rounded, saved).tracks
    rewritten(saved, mu=np.full((3, 3), 0.009))
    with pytest.raises(InputError, match="belongs to another ice"):
        load_evidence(ICE, saved)


@pytest.mark.parametrize(
    "changes",
    [
        {"choices": np.array("{}")},
        {"choices": np.array("no JSON")},
        {"x": np.zeros((13, 1))},
        {"x": np.array(["a"] * 13)},
        {"mu": np.array(["a"])},
    ],
    ids=lambda changes: next(iter(changes)),
)
def test_incomplete_evidence_is_refused(saved: Path, changes: dict[str, np.ndarray]) -> None:
    rewritten(saved, **changes)
    with pytest.raises(InputError, match="is incomplete"):
        load_evidence(ICE, saved)


def test_evidence_without_throws_is_refused(saved: Path) -> None:
    path = evidence_path(saved)
    with np.load(path) as content:
        columns = {name: column for name, column in content.items() if name != "swept"}
    np.savez(path, **columns)
    with pytest.raises(InputError, match="contains no throws"):
        load_evidence(ICE, saved)


def test_an_update_keeps_the_choices_of_the_first_estimate() -> None:
    known = Evidence(tracks=[], choices=Choices(effects="none", camera_bias="off"))
    known.check(Choices(), "ice.json")  # what is not asked for stays
    known.check(Choices(effects="none", camera_bias="off"), "ice.json")
    with pytest.raises(InputError, match="was estimated with another --uniform"):
        known.check(Choices(uniform=True), "ice.json")
    usual = Evidence(tracks=[], choices=Choices())
    with pytest.raises(InputError, match="another --camera-bias; an update cannot change it"):
        usual.check(Choices(camera_bias="off"), "ice.json")


def test_later_throws_are_numbered_after_the_earlier_ones_and_count_once() -> None:
    earlier = [track(3), track(8, shift=0.5)]
    struck = track(1, shift=0.9, stone=4)
    later = [track(1, shift=0.7), struck, track(9, shift=0.5), track(2, shift=0.6, rows=6)]
    tracks, remarks = with_later_throws(earlier, later)
    assert [t.throw for t in tracks] == [3, 8, 9, 9, 10]
    assert [t.stone for t in tracks] == [0, 0, 0, 4, 0]
    assert remarks == ["throw 9 is among the earlier throws and counts once"]
    alone, none = with_later_throws([], [track(7)])
    assert [t.throw for t in alone] == [0]
    assert none == []
