from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from agents.closed_loop import (
    draw_practice,
    filming,
    patchy_ice,
    run_demo,
)
from curling_env.ice import Ice, load_ice
from curling_env.physics import SlideEnd, slide
from curling_env.sheet import TEE_Y
from curling_env.throw import Throw, read_releases
from curling_env.trajectory import read_tracks
from curling_env.units import Units
from friction_estimation import estimate_ice
from friction_estimation.reports.keen_and_heavy import zones


def test_a_stone_that_leaves_the_ice_is_not_filmed_at_rest(tmp_path: Path, monkeypatch) -> None:
    tails: list[float] = []

    def film(job: filming._Job):
        tails.append(job.spec.tail)
        return job.path, 0.0, 0

    monkeypatch.setattr(filming, "_film_and_track", film)
    ice = Ice.uniform(0.0082)
    weights = [Throw(speed=speed).release() for speed in (1.9, 3.0)]
    assert [slide(ice, w).end for w in weights] == [SlideEnd.REST, SlideEnd.LEFT_BOUNDS]
    filming.film_throws(tmp_path, ice, weights, seed=0)
    assert tails[0] > 0
    assert tails[1] == 0


def relative(ice: Ice, observed: np.ndarray) -> np.ndarray:
    """Friction over its mean in the observed cells, minus one."""
    return ice.friction.mu / ice.friction.mu[observed].mean() - 1


def test_practice_throws_stay_on_the_ice_and_cross_it_both_ways() -> None:
    for seed in range(4):
        rng = np.random.default_rng(seed)
        ice = patchy_ice(rng)
        assert 0.05 < np.abs(relative(ice, ice.friction.observed)).max() < 0.15
        releases = draw_practice(8, rng)
        assert {np.sign(release.omega) for release in releases} == {-1.0, 1.0}
        rests = [slide(ice, release) for release in releases]
        assert all(rest.end == SlideEnd.REST for rest in rests)
        assert np.ptp([rest.x for rest in rests]) > 1.0


def test_the_hidden_areas_are_read_from_measured_paths() -> None:
    rng = np.random.default_rng(0)
    ice = patchy_ice(rng)
    tracks = []
    for k, release in enumerate(draw_practice(8, rng)):
        path = slide(ice, release, fps=10, throw=k).trajectory
        tracks.append(replace(path, xy=path.xy + 0.002 * rng.standard_normal(path.xy.shape)))
    found = estimate_ice(tracks, effects="none", start=load_ice("standard")).ice
    observed = found.friction.observed
    error = (found.friction.mu / ice.friction.mu - 1)[observed]
    assert np.sqrt(np.mean(error**2)) < 0.015
    true = relative(ice, observed)
    x, y = np.meshgrid(ice.sheet.x_centres, ice.sheet.y_centres)
    areas = [zone for zone in zones(found) if zone.stands_out]
    assert len(areas) >= 3
    for area in areas:
        inside = (area.x[0] <= x) & (x < area.x[1]) & (area.y[0] <= y) & (y < area.y[1])
        assert true[inside & observed].mean() == pytest.approx(area.relative, abs=0.02)


@pytest.mark.slow
def test_the_demo_leaves_all_it_promises(curling, must_fit, tmp_path: Path) -> None:
    reported: list[float] = []
    found = run_demo(
        tmp_path / "demo",
        seed=2,
        throws=2,
        fps=4,
        frame_size=(640, 360),
        draws=2,
        workers=1,
        progress=lambda what, done, total=1.0: reported.append(done / total),
    )
    folder = tmp_path / "demo"
    assert reported == sorted(reported)
    assert reported[-1] == 1.0
    for name in ("overlay.mp4", "films/gantry-1.mp4", "films/gantry.scene.json"):
        assert (folder / name).stat().st_size > 100
    tracks = read_tracks(folder / "tracks.csv")
    assert len(tracks) == 2
    assert found.track_errors.max() < 0.01
    # Each film begins before its release.
    assert all(
        track.clock < release.clock
        for track, release in zip(tracks, read_releases(folder / "releases.csv"), strict=True)
    )
    assert load_ice(folder / "ice.json").friction.observed.any()
    picture = cv2.imread(str(folder / "page.png"))
    assert picture.shape[1] > 1000
    page = (folder / "index.html").read_text()
    assert found.headline() in page.replace("&#x27;", "'")
    assert page.count("data:image/png;base64,") == 5
    assert 'src="http' not in page
    must_fit(folder / "findings.json", "findings-1")
    numbers = json.loads((folder / "findings.json").read_text())
    assert numbers["miss_on_true_ice_m"] == pytest.approx(
        np.hypot(found.tested.rest[0], found.tested.rest[1] - TEE_Y)
    )
    # What was planned on the estimated ice lands there to the millimetre: the loop is closed.
    assert numbers["miss_on_estimated_ice_m"] < 5e-3
    assert found.sentences()[-1].startswith("Over 2 draws")
    in_feet = " ".join(replace(found, units=Units.FEET).sentences())
    assert not re.search(r"\d (mm|cm|m)\b", in_feet)
    assert re.search(r"misses by [^;]* in;", in_feet)


def test_command_refuses_a_folder_that_cannot_be(curling, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    assert "file" in curling("demo", "-o", tmp_path / "file" / "demo").complaint


def test_command_refuses_a_folder_with_files_of_its_user(curling, tmp_path: Path) -> None:
    (tmp_path / "tracks.csv").write_text("throw,t,x,y,theta\n0,0,0,0,0\n")
    message = curling("demo", "-o", tmp_path).complaint
    assert "has tracks.csv, not from an earlier demo" in message
    assert [path.name for path in tmp_path.iterdir()] == ["tracks.csv"]
