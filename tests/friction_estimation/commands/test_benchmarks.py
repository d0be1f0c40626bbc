"""The measure of tracking runs, on a small film, and `curling bench` finds it."""

from __future__ import annotations

from importlib.metadata import entry_points

import pytest

from friction_estimation.commands import benchmarks


@pytest.mark.slow
def test_tracking_is_timed(monkeypatch):
    timed = []

    def once(work, *, repeats):
        timed.append(work())
        return 10.0 * repeats

    monkeypatch.setattr(benchmarks, "SIZE", (640, 360))
    monkeypatch.setattr(benchmarks, "FPS", 3.0)
    monkeypatch.setattr(benchmarks, "rate", once)
    found = {measure.name: measure.value for measure in benchmarks.measures()}
    assert timed[0] > 30  # frames, while the stone crosses the sheet
    assert found == {"track_frames_per_s": 10.0}


def test_the_bench_command_finds_it():
    declared = {point.value for point in entry_points(group="curling.benchmarks")}
    assert "friction_estimation.commands.benchmarks:measures" in declared
