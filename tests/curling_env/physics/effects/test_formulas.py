"""Every kernel computes the formula on its card, written out here a second time."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from curling_env.ice import ActiveEffect, Ice
from curling_env.physics import acceleration, catalogue
from curling_env.sheet import RULE_BOOK_STONE

G, MU = 9.80665, 0.009
SPIN = 1.2
POINT = replace(RULE_BOOK_STONE, band_radius=0.0)
"""Stone on a point contact: friction acts against its velocity, for any spin."""
PLACES = np.array([[x, y] for x in (-1.5, -1.0, 0.2, 1.0, 1.4) for y in (-3.0, 0.0, 2.5, 6.0, 9.0)])
SPEEDS = (0.004, 0.05, 0.6, 2.3)


def felt(name: str, xy: Any = (0.0, 0.0), speed: float = 2.0, spin: float = SPIN,
         others: tuple[ActiveEffect, ...] = (), motion: dict[str, Any] | None = None,
         **parameters: float) -> np.ndarray:  # fmt: skip
    """Return the acceleration of a stone that travels along +y: to the right, along, of its
    spin.
    """
    effects = (ActiveEffect(name=name, parameters=parameters), *others)
    ice = Ice.uniform(MU, stone=POINT, effects=effects)
    state = np.array([[*xy, 0.0, speed, spin]])
    return acceleration(ice, state, **(motion or {}))[0]


def side_of(spin: float) -> float:
    """The sign of the spin, which fades out below 0.01 rad/s."""
    return spin / np.hypot(spin, 0.01)


def factor(name: str, **given: Any) -> float:
    """Return the factor of an effect on friction."""
    return -felt(name, **given)[1] / (MU * G)


@pytest.mark.parametrize("speed", SPEEDS)
def test_air_drag_grows_with_the_square_of_speed(speed):
    assert felt("air_drag", speed=speed, coefficient=0.01) == pytest.approx(
        [0.0, -MU * G - 0.01 * speed**2, 0.0], abs=1e-12
    )


@pytest.mark.parametrize("spin", [-3.0, -1.5, 0.02, 2.5])
@pytest.mark.parametrize("speed", SPEEDS)
def test_curl_goes_left_for_positive_spin(speed, spin):
    values = {"strength": 0.008, "speed_exponent": 0.3, "spin_exponent": 0.5}
    left = side_of(spin) * 0.008 * speed**0.3 * (abs(spin) / 1.5) ** 0.5
    pushed = felt("curl", speed=speed, spin=spin, **values)
    assert pushed == pytest.approx([-left, -MU * G, 0.0], rel=1e-6, abs=1e-12)


def test_slope_pulls_towards_its_fall_whatever_the_speed():
    assert felt("slope", x=2e-4, y=-3e-4) == pytest.approx([2e-4 * G, -MU * G - 3e-4 * G, 0.0])


def test_wear_drift_and_bias_multiply_friction():
    assert factor("pebble_wear", rate=-0.01, motion={"order": 7}) == pytest.approx(np.exp(-0.07))
    assert factor("time_drift", rate=2e-5, motion={"clock": 900.0}) == pytest.approx(np.exp(0.018))
    assert factor("stone_bias", stone=3, factor=1.1, motion={"stone": 3}) == pytest.approx(1.1)
    for other in (2, 4):
        assert factor("stone_bias", stone=3, factor=1.1, motion={"stone": other}) == 1.0


def test_a_biased_stone_curls_more_or_less_for_any_friction():
    curl = ActiveEffect(name="curl", parameters={"strength": 0.01, "speed_exponent": 0.0})
    for stone, friction, sideways in ((3, 0.9, 0.016), (2, 1.0, 0.01)):
        pushed = felt("stone_bias", stone=3, factor=0.9, curl_factor=1.6, others=(curl,),
                      motion={"stone": stone})  # fmt: skip
        expected = [-sideways * side_of(SPIN), -friction * MU * G, 0.0]
        assert pushed == pytest.approx(expected, rel=1e-6)
    old = felt("stone_bias", stone=3, factor=0.9, others=(curl,), motion={"stone": 3})
    assert old == pytest.approx([-0.01 * side_of(SPIN), -0.9 * MU * G, 0.0], rel=1e-6)


def test_sweeping_multiplies_friction_and_curl_while_it_lasts():
    curl = ActiveEffect(name="curl", parameters={"strength": 0.01, "speed_exponent": 0.0})
    values = {"friction_factor": 0.8, "curl_factor": 0.5, "others": (curl,)}
    swept = felt("sweeping", motion={"swept": True}, **values)
    assert swept == pytest.approx([-0.005 * side_of(SPIN), -0.8 * MU * G, 0.0], rel=1e-6)
    assert felt("sweeping", **values) == pytest.approx(
        [-0.01 * side_of(SPIN), -MU * G, 0.0], rel=1e-6
    )


def test_a_sharp_patch_is_a_rectangle_with_its_sides():
    values = {"x_min": -1.0, "x_max": 1.0, "y_min": 0.0, "y_max": 6.0, "factor": 1.5}
    for x, y in PLACES:
        inside = -1 <= x <= 1 and 0 <= y <= 6
        assert factor("friction_patch", xy=(x, y), **values) == pytest.approx(1.5 if inside else 1)


def test_a_soft_patch_fades_over_its_edge():
    values = {"x_min": -1.0, "x_max": 1.0, "y_min": 0.0, "y_max": 6.0, "factor": 1.5, "edge": 0.4}

    def box(u: float, low: float, high: float) -> float:
        return 0.5 * (np.tanh((u - low) / 0.4) - np.tanh((u - high) / 0.4))

    for x, y in PLACES:
        expected = 1 + 0.5 * box(x, -1, 1) * box(y, 0, 6)
        assert factor("friction_patch", xy=(x, y), **values) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("speed", SPEEDS)
@pytest.mark.parametrize("exponent", [-0.5, 0.3, 1.2])
@pytest.mark.parametrize("share", [1.0, 0.6])
def test_friction_follows_the_slip_and_rises_no_more_below_a_centimetre_a_second(
    speed, exponent, share
):
    slip = max(speed, 0.01)
    given = {"speed": speed, "exponent": exponent, "share": share}
    assert factor("speed_dependent_friction", **given) == pytest.approx(
        1 - share + share * slip**-exponent, rel=1e-6
    )
    slip = max(speed, 0.01 if exponent < 1 else 0.0) + 0.05
    assert factor("speed_dependent_friction", **given, speed_offset=0.05) == pytest.approx(
        1 - share + share * slip**-exponent, rel=1e-6
    )


@pytest.mark.parametrize("spin", [-3.0, 0.7])
@pytest.mark.parametrize("speed", SPEEDS)
def test_spin_drag_slows_the_turn_more_the_slower_the_stone_slides(speed, spin):
    values = {"rate": 0.02, "speed_exponent": 0.5, "speed_floor": 0.1, "spin_exponent": 0.4}
    drag = 0.02 * max(speed, 0.1) ** -0.5 * (abs(spin) / 1.5) ** 0.4
    slowed = felt("spin_drag", speed=speed, spin=spin, **values)
    assert slowed == pytest.approx([0.0, -MU * G, -side_of(spin) * drag], rel=1e-6)


@pytest.mark.parametrize(
    ("variable", "state"),
    [
        (0, lambda value: {"speed": value}),
        (1, lambda value: {"xy": (value, 3.0)}),
        (2, lambda value: {"xy": (0.5, value)}),
        (3, lambda value: {"spin": -value}),
        (4, lambda value: {"motion": {"clock": value}}),
        (5, lambda value: {"motion": {"order": value}}),
    ],
)
def test_the_residual_runs_over_one_variable(variable, state):
    logs = [0.1, -0.2, 0.3, 0.0, 0.25, -0.1, 0.05]
    table = {f"log_factor_{k}": value for k, value in enumerate(logs)}
    values = {"variable": variable, "low": 0.25, "high": 2.0, **table}
    for value in (0.25, 1.0, 1.5, 2.0):
        expected = np.exp(np.interp(value, np.linspace(0.25, 2.0, 7), logs))
        shown = state(int(value) if variable == 5 else value)
        if variable == 5:
            expected = np.exp(np.interp(int(value), np.linspace(0.25, 2.0, 7), logs))
        assert factor("residual", **values, **shown) == pytest.approx(expected, rel=1e-9)
    breaks = {"x_breaks": catalogue()["residual"].x_breaks(values),
              "y_breaks": catalogue()["residual"].y_breaks(values)}  # fmt: skip
    places = pytest.approx(np.linspace(0.25, 2.0, 7))
    assert breaks["x_breaks"] == (places if variable == 1 else ())
    assert breaks["y_breaks"] == (places if variable == 2 else ())


def test_a_patch_reports_its_edges():
    card = catalogue()["friction_patch"]
    values = {"x_min": -1.0, "x_max": 1.0, "y_min": 0.0, "y_max": 6.0, "factor": 1.5}
    assert card.x_breaks(values) == (-1.0, 1.0)
    assert card.y_breaks(values) == (0.0, 6.0)
    soft = card.y_breaks(values | {"edge": 0.4})
    assert len(soft) == 26
    assert (min(soft), max(soft)) == pytest.approx((-1.8, 7.8))


FORMAT = {
    "air_drag": {"coefficient": (0.0, 0.02, None)},
    "curl": {
        "strength": (-0.1, 0.1, None),
        "speed_exponent": (-1.0, 2.0, 0.2),
        "spin_exponent": (0.0, 2.0, 0.0),
    },
    "friction_patch": {
        **dict.fromkeys(("x_min", "x_max", "y_min", "y_max"), (-25.0, 25.0, None)),
        "factor": (0.2, 5.0, None),
        "edge": (0.0, 5.0, 0.0),
    },
    "pebble_wear": {
        "rate": (-0.1, 0.1, 0.0),
        "along_path": (-0.1, 0.1, 0.0),
        "under_contacts": (-0.1, 0.1, 0.0),
    },
    "residual": {
        "variable": (0.0, 5.0, None),
        "low": (-np.inf, np.inf, None),
        "high": (-np.inf, np.inf, None),
        **{f"log_factor_{k}": (-2.0, 2.0, 0.0) for k in range(7)},
    },
    "slope": {"x": (-5e-3, 5e-3, 0.0), "y": (-5e-3, 5e-3, 0.0)},
    "speed_dependent_friction": {
        "exponent": (-1.0, 2.0, None),
        "speed_offset": (0.0, 1.0, 0.0),
        "share": (-0.2, 1.0, 1.0),
    },
    "spin_drag": {
        "rate": (0.0, 0.5, None),
        "speed_exponent": (0.0, 1.5, 0.6),
        "speed_floor": (1e-4, 1.0, 0.05),
        "spin_exponent": (0.0, 2.0, 0.0),
    },
    "stone_bias": {
        "stone": (0.0, 1e6, None),
        "factor": (0.5, 2.0, 1.0),
        "curl_factor": (0.0, 3.0, 1.0),
    },
    "sweeping": {"friction_factor": (0.3, 1.5, 0.912), "curl_factor": (0.0, 2.0, 1.0)},
    "time_drift": {"rate": (-1e-3, 1e-3, None)},
}
"""Effect -> parameter -> least value, greatest value, and default in an ice file."""


@pytest.mark.parametrize("name", FORMAT)
def test_ice_files_keep_their_meaning(name):
    """A changed bound or default would change the meaning of an ice file, or refuse it."""
    card = catalogue()[name]
    assert {p.name: (p.low, p.high, p.default) for p in card.parameters} == FORMAT[name]


NEUTRAL = {
    "air_drag": {"coefficient": 0.0},
    "curl": {"strength": 0.0},
    "friction_patch": {"factor": 1.0},
    "pebble_wear": {"rate": 0.0},
    "residual": {},
    "slope": {"x": 0.0, "y": 0.0},
    "speed_dependent_friction": {"exponent": 0.0},
    "spin_drag": {"rate": 0.0},
    "stone_bias": {"factor": 1.0, "curl_factor": 1.0},
    "sweeping": {"friction_factor": 1.0, "curl_factor": 1.0},
    "time_drift": {"rate": 0.0},
    "tracking_offset": {"forward": 0.0, "left": 0.0},
    "lens_distortion": {"k1": 0.0, "k2": 0.0},
    "scale_error": {"factor": 1.0},
    "frame_rate_error": {"factor": 1.0},
}
"""Effect -> values at which it does nothing; discovery starts there."""


def test_every_effect_has_values_at_which_it_does_nothing():
    found = {
        name: {p.name: p.neutral for p in card.parameters if p.neutral is not None}
        for name, card in catalogue().items()
    }
    assert found == {**NEUTRAL, "unknown": {}}


def test_parameters_that_a_fit_may_change_and_that_turn_with_the_sheet():
    held, axes, scales = ({}, {}, {})
    for name, card in catalogue().items():
        for parameter in card.parameters:
            if parameter.held:
                held.setdefault(name, set()).add(parameter.name)
            if parameter.axis is not None:
                axes[name, parameter.name] = parameter.axis
            if parameter.scales is not None:
                scales[name, parameter.name] = parameter.scales
    assert held == {
        "friction_patch": {"x_min", "x_max", "y_min", "y_max", "edge"},
        "lens_distortion": {"centre_x"},
        "spin_drag": {"speed_floor"},
        "stone_bias": {"stone"},
    }
    assert axes == {("slope", "x"): "x", ("slope", "y"): "y"}
    assert scales == {(name, "curl_factor"): "left" for name in ("stone_bias", "sweeping")}
