"""The data and the numbers that the figures of an estimate show."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.collections import PathCollection, QuadMesh
from scipy.interpolate import CubicSpline

from curling_env.ice import Ice
from curling_env.trajectory import Trajectory
from curling_env.units import Units
from friction_estimation.discovery.model.noise import CoordinateNoise
from friction_estimation.reports import DrawWeight
from friction_estimation.reports import estimate_figures as module
from friction_estimation.tracks.free_slide import FreeSlide

MU, G = 0.009, 9.80665
EVEN = Ice.uniform(MU)
SHAPE = EVEN.friction.mu.shape


def slid(throw: int = 0, speed: float = 2.0) -> FreeSlide:
    t = np.arange(0.0, 12.0, 0.05)
    xy = np.column_stack([0.2 + 0 * t, -11.0 + speed * t - 0.5 * MU * G * t**2])
    track = Trajectory(t=5.0 + t, xy=xy, throw=throw)
    rows = np.arange(len(t))
    return FreeSlide(track=track, rows=rows, stretch=(0, len(t)), rests=False, wild=0, noise=0.001)


def estimate(mu: float = MU, changes=(), sigma: float = 0.0003, observed=None, **other):
    """An estimate of a given map; the level is given too."""
    cells = np.full(SHAPE, MU)
    for place, factor in dict(changes).items():
        cells[place] = MU * factor
    seen = np.ones(SHAPE, dtype=bool) if observed is None else observed
    friction = replace(EVEN.friction, mu=cells, sigma=np.full(SHAPE, sigma), observed=seen)
    given = {
        "ice": replace(EVEN, friction=friction),
        "mu": mu,
        "interval": (0.0088, 0.0093),
        "uniform": False,
        "slides": (slid(),),
        "throws": 1,
        "resolution": None,
        "noise": CoordinateNoise(white=0.0031),
        "travel_residuals": [],
        "camera_bias": None,
    }
    return SimpleNamespace(**given | other)


@pytest.fixture
def drawn(monkeypatch):
    """A function that calls one that saves a figure, and returns its axes and title."""

    def draw(save, *given):
        saved = []
        monkeypatch.setattr(module, "save_figure", lambda *args: saved.append(args))
        save(*given[:2], *given[2:])
        ((figure, _, title),) = saved
        return figure.axes, title

    return draw


def mesh(ax) -> np.ndarray:
    (layer,) = (c for c in ax.collections if isinstance(c, QuadMesh))
    return layer


def test_a_map_is_per_cent_of_the_level_and_pale_without_throws(drawn):
    seen = np.ones(SHAPE, dtype=bool)
    seen[2, 3] = False
    found = estimate(0.0075, {(5, 1): 1.25}, observed=seen)
    (top, bottom, *_), _ = drawn(module.save_map, found, Path("m.png"))
    shown = np.asarray(mesh(top).get_array()).reshape(SHAPE)
    assert shown[5, 1] == pytest.approx(50.0)
    assert shown[2, 3] == pytest.approx(20.0)
    alpha = np.asarray(mesh(top).get_alpha()).reshape(SHAPE)
    assert (alpha[2, 3], alpha[5, 1]) == (0.35, 1.0)
    assert mesh(top).get_clim() == pytest.approx((-20.0, 20.0))  # all but a hundredth
    error = np.asarray(mesh(bottom).get_array()).reshape(SHAPE)
    assert error == pytest.approx(np.full(SHAPE, 4.0))
    assert mesh(bottom).get_clim() == pytest.approx((0.0, 4.0))
    path = bottom.lines[-1].get_xydata()
    xy = found.slides[0].xy[::3]
    assert path == pytest.approx(np.column_stack([xy[:, 1], -xy[:, 0]]))


def test_a_map_has_a_scale_of_one_per_cent_at_least(drawn):
    (top, bottom, *_), _ = drawn(module.save_map, estimate(sigma=0.0), Path("m.png"))
    assert mesh(top).get_clim() == (-1.0, 1.0)
    assert mesh(bottom).get_clim() == (0.0, 1e-3)
    # Without a level, the map's own mean is it.
    (top, *_), _ = drawn(module.save_map, estimate(0.0), Path("m.png"))
    assert np.abs(mesh(top).get_array()).max() < 1e-9


def test_titles_of_a_map_have_level_interval_and_resolution(drawn):
    found = estimate(0.00912, throws=7, resolution=1.234)
    (top, bottom, *_), title = drawn(module.save_map, found, Path("m.png"))
    assert title == "Friction of the ice: μ = 0.00912  (95 %: 0.00880 to 0.00930), 7 throws"
    assert bottom.get_title("left").endswith("; details below 1.23 m are not resolved")
    assert top.get_title("left") == module._caption(found, Units.METRES)
    (_, bottom, *_), _ = drawn(module.save_map, estimate(), Path("m.png"))
    assert bottom.get_title("left").endswith("no stone crossed")
    (_, bottom, *_), _ = drawn(module.save_map, found, Path("m.png"), Units.FEET)
    assert "details below 4 ft 1 in" in bottom.get_title("left")


def test_the_keenest_and_the_heaviest_crossed_cells_are_named():
    seen = np.ones(SHAPE, dtype=bool)
    seen[9, 1] = seen[9, 2] = False
    changes = {(5, 1): 0.9, (6, 1): 0.95, (7, 2): 1.2, (9, 1): 0.5, (9, 2): 2.0}
    found = estimate(0.01, changes, observed=seen)
    draw = DrawWeight(found.ice, 0.01)
    level = (
        f"a draw to the tee: {draw.speed:.2f} m/s at the hog line, {draw.seconds:.1f} s from hog "
        f"line to rest, {draw.hog_to_hog:.1f} s from hog line to hog line"
    )
    assert module._caption(found, Units.METRES) == (
        f"{level};  keenest cell that a stone crossed −19.0 %, heaviest +8.0 %"
    )
    assert module._caption(estimate(0.01, uniform=True), Units.METRES) == level
    none = estimate(0.01, observed=np.zeros(SHAPE, dtype=bool))
    assert module._caption(none, Units.METRES) == level
    assert "ft/s at the hog line" in module._caption(none, Units.FEET)
    for unknown in (0.0, -0.001):  # lost in the noise of the paper's method
        assert module._caption(estimate(unknown), Units.METRES) == ""


def test_speeds_and_decelerations_are_those_of_the_parabola(drawn):
    found = estimate(slides=(slid(0, 2.0), slid(1, 1.5)))
    (left, right), _ = drawn(module.save_motion, found, Path("m.png"))
    t = np.arange(0.0, 12.0, 0.05)
    for k, speed in enumerate((2.0, 1.5)):
        assert left.lines[k].get_xdata() == pytest.approx(t)
        assert left.lines[k].get_ydata() == pytest.approx(speed - MU * G * t, abs=1e-6)
        inner = slice(7, -7)  # a fortieth of 240 rows, and one
        run = speed * t - 0.5 * MU * G * t**2
        assert right.lines[k].get_xdata() == pytest.approx(run[inner], abs=1e-3)
        assert right.lines[k].get_ydata() == pytest.approx(np.full(226, MU), abs=1e-6)
    assert right.lines[2].get_ydata() == pytest.approx([MU, MU])
    assert right.get_ylim() == pytest.approx((0.0, 2.2 * MU))
    assert left.get_ylim()[0] == 0.0
    assert len(right.collections) == 2
    (_, right), _ = drawn(module.save_motion, estimate(slides=(slid(),) * 4), Path("m.png"))
    assert not right.collections


def test_a_band_is_two_standard_errors_of_the_deceleration(drawn):
    (_, right), _ = drawn(module.save_motion, estimate(), Path("m.png"))
    (band,) = right.collections
    ys = band.get_paths()[0].vertices[:, 1]
    part = slid()
    motion = module.smooth_motion(part.t, part.xy, window=2.0, noise=0.001)
    widest = 2 * motion.acceleration_sigma[7:-7].max() / G
    assert ys.max() - MU == pytest.approx(widest, rel=0.01)
    assert MU - ys.min() == pytest.approx(widest, rel=0.01)


def test_residuals_are_in_millimetres_and_correlated_by_lag(drawn, rng):
    residuals = [(np.arange(50) / 10, rng.normal(0, 0.003, 50)), (np.arange(9), np.ones(9) * 0.001)]
    noise = CoordinateNoise(white=0.0031, slow=0.0042, time=0.57)
    found = estimate(travel_residuals=residuals, noise=noise)
    (left, right), title = drawn(module.save_residuals, found, Path("r.png"))
    for line, (t, residual) in zip(left.lines, residuals, strict=True):
        assert line.get_xydata() == pytest.approx(np.column_stack([t, 1000 * residual]))
    expected = []
    for lag in range(31):
        pairs = [
            r[i] * r[i + lag] for _, r in residuals if lag < len(r) - 1 for i in range(len(r) - lag)
        ]
        expected.append(np.mean(pairs))
    heights = [bar.get_height() for bar in right.patches]
    assert heights == pytest.approx(np.array(expected) / expected[0])
    assert [bar.get_x() + bar.get_width() / 2 for bar in right.patches] == pytest.approx(range(31))
    assert left.get_ylim() == pytest.approx((-4500 * noise.total, 4500 * noise.total))
    assert title == "Residuals of the fit;  noise: 3.1 mm white, 4.2 mm lasting 0.57 s"
    _, title = drawn(module.save_residuals, estimate(travel_residuals=residuals), Path("r.png"))
    assert title == "Residuals of the fit;  noise: 3.1 mm white"


def test_a_profile_is_the_mean_of_the_crossed_cells(drawn):
    seen = np.zeros(SHAPE, dtype=bool)
    seen[10:20, 2:4] = True
    found = estimate(changes={(12, 2): 1.1, (12, 3): 1.3, (12, 4): 9.0}, observed=seen)
    plain = estimate(changes={(12, 3): 1.5}, observed=seen)
    (ax,), _ = drawn(module.save_profile, found, plain, Path("p.png"))
    y = EVEN.sheet.y_centres
    mean, dots = ax.lines[:2]
    expected = np.full(len(y), np.nan)
    expected[10:20] = MU
    expected[12] = 1.2 * MU
    assert mean.get_xdata() == pytest.approx(y)
    assert mean.get_ydata() == pytest.approx(expected, nan_ok=True)
    known = dots.get_xydata()[np.isfinite(dots.get_ydata())]
    assert known[:, 0] == pytest.approx(np.repeat(y[10:20], 2))
    assert known[:, 1] == pytest.approx(MU * np.where(np.arange(20) == 5, 1.5, 1.0))
    (band,) = (c for c in ax.collections if not isinstance(c, PathCollection))
    ys = np.concatenate([path.vertices[:, 1] for path in band.get_paths()])
    assert np.nanmax(ys) == pytest.approx(1.2 * MU + 0.0006)
    assert np.nanmin(ys) == pytest.approx(MU - 0.0006)
    span = 0.2 * MU + 6 * 0.0003
    assert ax.get_ylim() == pytest.approx((MU - 1.2 * span, 1.2 * MU + 1.2 * span))
    exact = estimate(sigma=0.0, observed=seen)
    (ax,), _ = drawn(module.save_profile, exact, plain, Path("p.png"))
    assert ax.get_ylim() == pytest.approx((MU - 0.12 * MU, MU + 0.12 * MU))


def test_a_bias_is_drawn_in_millimetres_with_its_interval(drawn):
    nodes = np.array([-9.0, -2.0, 4.0, 10.0])
    values, sigma = np.array([0.0, 0.012, -0.005, 0.003]), np.array([0.001, 0.002, 0.003, 0.002])
    bias = SimpleNamespace(nodes=nodes, values=values, sigma=sigma, size=0.0072)
    (ax,), title = drawn(module.save_camera_bias, bias, EVEN, Path("c.png"))
    x, y = ax.lines[0].get_xydata().T
    assert (x[0], x[-1]) == (-9.0, 10.0)
    assert y == pytest.approx(1000 * CubicSpline(nodes, values, bc_type="natural")(x))
    (band,) = ax.collections
    shape = band.get_paths()[0].vertices
    ends = shape[np.isclose(shape[:, 0], 10.0)][:, 1]
    assert (ends.min(), ends.max()) == pytest.approx((3 - 3.92, 3 + 3.92))
    assert title == "What the camera was off by: 7.2 mm (rms)"


@pytest.mark.parametrize(
    ("part", "words"), [(0.0123, "+1.2 %"), (-0.0987, "−9.9 %"), (0.0, "+0.0 %")]
)
def test_a_share_has_its_sign(part, words):
    assert module.per_cent(part) == words


def test_the_files_that_are_written_are_those_with_content(monkeypatch):
    called = []
    for name in ("map", "motion", "residuals", "profile", "camera_bias"):
        monkeypatch.setattr(
            module, f"save_{name}", lambda *given, name=name: called.append((name, given))
        )
    folder, bias = Path("f"), SimpleNamespace(found=True)
    whole = estimate(travel_residuals=[1], camera_bias=bias)
    pictures = ["map.png", "motion.png", "residuals.png", "profile.png", "camera.png"]
    assert module.write_pictures(whole, estimate(), folder, Units.FEET) == pictures
    assert [given[-1] for _, given in called[1:]] == [folder / name for name in pictures[1:]]
    assert called[0] == ("map", (whole, folder / "map.png", Units.FEET))
    bare = estimate(camera_bias=SimpleNamespace(found=False))
    assert module.write_pictures(bare, None, folder) == pictures[:2]
    assert module.write_pictures(estimate(uniform=True), bare, folder) == pictures[:2]
    assert module.write_pictures(estimate(), bare, folder) == [*pictures[:2], "profile.png"]
