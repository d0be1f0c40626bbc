"""Every effect of the catalogue against the contract of its card, and an effect from outside."""

from __future__ import annotations

import importlib
import os
import subprocess
import sys
from dataclasses import replace
from math import exp
from pathlib import Path

import numpy as np
import pytest

from curling_env.errors import InputError
from curling_env.ice import ActiveEffect, Ice, load_ice, save_ice
from curling_env.physics import (
    EffectCard,
    acceleration,
    catalogue,
    compile_law,
    register,
    slide,
    unregister,
)
from curling_env.throw import Throw

NAMES = (
    *("speed_dependent_friction", "curl", "slope", "pebble_wear", "stone_bias", "sweeping"),
    *("friction_patch", "time_drift", "spin_drag", "air_drag", "residual"),
    *("tracking_offset", "lens_distortion", "scale_error", "frame_rate_error", "unknown"),
)
CARDS = list(catalogue().values())
PHYSICAL = [card for card in CARDS if card.is_physical]
NOT_FELT = [card for card in CARDS if not card.is_physical]
STATES = np.array(
    [
        [0.5, y, v * np.sin(a), v * np.cos(a), w]
        for y in (-12.0, 3.0)
        for v in (1e-9, 1e-3, 0.05, 1.0, 2.2, 5.0)
        for a in (0.0, 1.0, 3.5)
        for w in (-3.0, 0.0, 1e-6, 1.5)
    ]
)
MOTION = {"heading": 1.0, "t": 5.0, "clock": 900.0, "order": 12, "stone": 3, "swept": True}


def typical(card: EffectCard) -> dict[str, float]:
    """Return parameters at which the effect shows, within its bounds."""
    chosen = {
        "speed_dependent_friction": {"exponent": 0.3, "speed_offset": 0.02, "share": 0.7},
        "curl": {"strength": 0.008, "spin_exponent": 0.1},
        "slope": {"x": 2e-4, "y": -1e-4},
        "pebble_wear": {"rate": -0.01, "along_path": -0.003},
        "stone_bias": {"stone": 3, "factor": 1.02, "curl_factor": 1.3},
        "friction_patch": {"x_min": -1, "x_max": 1, "y_min": 0, "y_max": 6, "factor": 1.3},
        "residual": {"variable": 2, "low": -10, "high": 10, "log_factor_4": 0.1},
    }
    given = chosen.get(card.name, {})
    return {
        parameter.name: given.get(
            parameter.name,
            parameter.default
            if parameter.default is not None
            else parameter.low + 0.3 * (parameter.high - parameter.low),
        )
        for parameter in card.parameters
    }


def with_only(card: EffectCard, parameters: dict[str, float]) -> Ice:
    return Ice.uniform(0.009, effects=(ActiveEffect(name=card.name, parameters=parameters),))


def test_the_catalogue_has_every_effect_of_ice_files() -> None:
    assert set(NAMES) <= set(catalogue())


@pytest.mark.parametrize("card", CARDS, ids=lambda card: card.name)
class TestEveryCard:
    def test_card_has_all_texts(self, card: EffectCard) -> None:
        for text in (card.title, card.formula, card.source, card.validity, card.evidence):
            assert text
        names = [parameter.name for parameter in card.parameters]
        assert len(set(names)) == len(names)
        assert names or not card.is_physical
        for parameter in card.parameters:
            assert parameter.unit
            assert parameter.meaning
            assert parameter.low < parameter.high
            for value in (parameter.default, parameter.neutral):
                assert value is None or parameter.low <= value <= parameter.high

    def test_theta_follows_the_names(self, card: EffectCard) -> None:
        given = typical(card)
        assert card.theta(given) == [given[parameter.name] for parameter in card.parameters]
        bound = next((p for p in card.parameters if np.isfinite(p.high)), None)
        if bound is not None:
            with pytest.raises(InputError, match=bound.name):
                card.theta(given | {bound.name: bound.high + 1.0})
        with pytest.raises(InputError, match="no parameter"):
            card.theta(given | {"colour": 1.0})

    def test_card_has_a_search_and_a_variable_for_figures(self, card: EffectCard) -> None:
        assert set(card.first) <= set(card.neutral)
        assert not set(card.first) & set(card.shape)
        assert card.pushes
        for variant in card.search.variants:
            assert variant.parameter not in card.first
            assert card.parameter(variant.parameter).default is not None
        for start in card.search.finer(typical(card)):
            assert set(start) <= {parameter.name for parameter in card.parameters}
        if card.search.area is not None:
            assert card.acts == "friction"
            assert all(card.parameter(name).held for name in card.search.area)
        if card.search.stone is not None:
            assert card.parameter(card.search.stone).held
        assert all(scale > 0 for scale in card.observed.values())


@pytest.mark.parametrize("card", PHYSICAL, ids=lambda card: card.name)
class TestEveryEffectThatAStoneFeels:
    def test_pushes_in_the_declared_directions(self, card: EffectCard) -> None:
        """Straight along, to the left of or across a path that is fixed in the sheet."""
        for travel in (0.4, 2.9):
            states = np.array([[0.5, 3.0, 2 * np.sin(travel), 2 * np.cos(travel), 1.5]])
            plain = acceleration(Ice.uniform(0.009), states, **MOTION)[0]
            change = acceleration(with_only(card, typical(card)), states, **MOTION)[0] - plain
            along = change[:2] @ [np.sin(travel), np.cos(travel)]
            left = change[:2] @ [-np.cos(travel), np.sin(travel)]
            if not {"left", "along the sheet", "across the sheet"} & set(card.pushes):
                assert left == pytest.approx(0.0, abs=1e-12)
            if not {"along", "along the sheet", "across the sheet"} & set(card.pushes):
                assert along == pytest.approx(0.0, abs=1e-12)
            if card.acts == "motion" and "turn" not in card.pushes:
                assert change[2] == pytest.approx(0.0, abs=1e-12)

    def test_depends_on_speed_and_spin_alone_exactly_if_declared(self, card: EffectCard) -> None:
        """A law of speed and spin alone may be read from a table."""
        felt = []
        for place, travel, motion in (
            ((0.5, 3.0), 0.4, MOTION),
            ((-1.2, -9.0), 2.9, {"heading": 2.0, "t": 1.0, "clock": 90.0, "order": 2, "stone": 5}),
        ):
            ahead = np.array([np.sin(travel), np.cos(travel)])
            left = np.array([-ahead[1], ahead[0]])
            states = np.array([[*place, *(speed * ahead), 1.5] for speed in (0.4, 2.0)])
            change = acceleration(with_only(card, typical(card)), states, **motion)
            felt.append([change[:, :2] @ ahead, change[:, :2] @ left, change[:, 2]])
        alike = np.allclose(felt[0], felt[1], rtol=1e-9, atol=1e-12)
        assert alike is card.of_speed_and_spin

    def test_is_finite_everywhere_also_at_rest(self, card: EffectCard) -> None:
        states = np.vstack([STATES, np.zeros((1, 5)), [[0, 0, 0, 0, 2.0]]])
        assert np.isfinite(acceleration(with_only(card, typical(card)), states, **MOTION)).all()

    def test_shows_and_can_be_switched_off(self, card: EffectCard) -> None:
        plain = acceleration(Ice.uniform(0.009), STATES, **MOTION)
        shown = acceleration(with_only(card, typical(card)), STATES, **MOTION)
        assert np.abs(shown - plain).max() > 1e-6
        neutral = {p.name: p.neutral for p in card.parameters if p.neutral is not None}
        if neutral:
            off = acceleration(with_only(card, typical(card) | neutral), STATES, **MOTION)
            assert off == pytest.approx(plain, abs=1e-15)

    def test_is_dissipative_exactly_if_declared(self, card: EffectCard) -> None:
        ice = with_only(card, typical(card))
        frictionless = replace(ice, friction=replace(ice.friction, mu=1e-9 * ice.friction.mu))

        def power(ice: Ice) -> np.ndarray:
            a = acceleration(ice, STATES, **MOTION)
            inertia = ice.stone.inertia / ice.stone.mass
            return (a[:, :2] * STATES[:, 2:4]).sum(1) + inertia * a[:, 2] * STATES[:, 4]

        if card.dissipative:
            assert (power(ice) <= 1e-15).all()
            assert (power(frictionless) <= 1e-15).all()
        else:
            assert (power(frictionless) > 1e-6).any()

    def test_knows_no_left_from_right(self, card: EffectCard) -> None:
        """The mirror image of a motion under the mirrored effect, and its half-turn."""
        given = typical(card)
        here = acceleration(with_only(card, given), STATES, **MOTION)
        for flip_x, flip_y in [(-1, 1), (-1, -1)]:
            turned = self._turned(card, given, flip_x, flip_y)
            spin = flip_x * flip_y
            states = STATES * [flip_x, flip_y, flip_x, flip_y, spin]
            there = acceleration(with_only(card, turned), states, **MOTION)
            assert there * [flip_x, flip_y, spin] == pytest.approx(here, abs=1e-13)

    @staticmethod
    def _turned(
        card: EffectCard, given: dict[str, float], flip_x: int, flip_y: int
    ) -> dict[str, float]:
        """Parameters of the same effect on the turned sheet: those fixed to the ice turn too."""
        turned = dict(given)
        for axis, flip in (("x", flip_x), ("y", flip_y)):
            if axis in given:
                turned[axis] = flip * given[axis]
            if f"{axis}_min" in given and flip < 0:
                turned[f"{axis}_min"] = -given[f"{axis}_max"]
                turned[f"{axis}_max"] = -given[f"{axis}_min"]
        if card.name == "residual" and flip_y < 0:
            turned |= {"low": -given["high"], "high": -given["low"]}
            turned |= {f"log_factor_{k}": given[f"log_factor_{6 - k}"] for k in range(7)}
        return turned

    def test_survives_the_ice_file_and_a_throw(self, card: EffectCard, tmp_path: Path) -> None:
        ice = with_only(card, typical(card))
        save_ice(ice, tmp_path / "ice.json")
        release = Throw(speed=1.2, angle=0, spin=1.5).release()
        path = slide(load_ice(tmp_path / "ice.json"), release)
        assert (path.x, path.y) == (slide(ice, release).x, slide(ice, release).y)


def test_residual_is_the_table_it_was_given() -> None:
    values = [0.0, 0.1, -0.1, 0.2, 0.0, 0.05, 0.3]
    table = {f"log_factor_{k}": value for k, value in enumerate(values)}
    ice = with_only(catalogue()["residual"], {"variable": 0, "low": 0.5, "high": 3.5, **table})
    speeds = np.linspace(0.1, 4.0, 50)
    states = np.column_stack([0 * speeds, 0 * speeds, 0 * speeds, speeds, 0 * speeds])
    expected = np.exp(np.interp(speeds, np.linspace(0.5, 3.5, 7), values)) * 0.009 * 9.80665
    assert -acceleration(ice, states)[:, 1] == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("card", NOT_FELT, ids=lambda card: card.name)
def test_effects_of_the_measurement_stay_in_the_ice_file(card: EffectCard, tmp_path: Path) -> None:
    plain, ice = Ice.uniform(0.009), with_only(card, typical(card))
    assert (acceleration(ice, STATES, **MOTION) == acceleration(plain, STATES, **MOTION)).all()
    save_ice(ice, tmp_path / "ice.json")
    assert load_ice(tmp_path / "ice.json").effect(card.name) == ice.effect(card.name)
    if card.displacement is not None:
        xy, theta = STATES[:, :2], STATES[:, 4]
        off = card.displacement(xy, theta, typical(card) | card.neutral)
        assert off == pytest.approx(np.zeros_like(xy), abs=1e-15)
        assert np.abs(card.displacement(xy, theta, typical(card))).max() > 1e-3


def test_a_card_that_contradicts_itself_is_refused() -> None:
    card = catalogue()["air_drag"]
    with pytest.raises(InputError, match="names 'speed', which is not one"):
        replace(card, observed={"speed": 1.0})
    with pytest.raises(InputError, match="names 'speed', which is not one"):
        replace(card, parameters=(replace(card.parameters[0], observed_with="speed"),))
    with pytest.raises(InputError, match="wants a kernel"):
        replace(card, kernel=None)
    with pytest.raises(InputError, match="takes no kernel"):
        replace(card, acts="measurement")


def test_an_effect_can_be_taken_out_of_the_catalogue_and_put_back() -> None:
    card = unregister("air_drag")
    try:
        assert "air_drag" not in catalogue()
        with pytest.raises(InputError, match="no effect named 'air_drag'"):
            unregister("air_drag")
    finally:
        assert register(card) is card
    assert catalogue()["air_drag"] is card
    assert list(catalogue()) == sorted(catalogue())


OUTSIDE = '''
"""A magnet under the ice: an effect that someone else wrote, in one file."""

from curling_env.physics.compiled import effect_kernel
from curling_env.physics.effects import EffectCard, Parameter, register
from curling_env.physics.motion import ALONG, SPEED


@effect_kernel
def _kernel(motion, theta, push):
    push[ALONG] -= theta[0] * motion[SPEED]


CARD = register(
    EffectCard(
        name="eddy_brake",
        title="Eddy-current brake",
        formula="dv/dt = -rate * v",
        parameters=(
            Parameter(name="rate", unit="1/s", meaning="decay", low=0.0, high=1.0, neutral=0.0),
        ),
        source="Lenz",
        validity="stones with a metal handle",
        evidence="deceleration that grows with v",
        acts="motion",
        kernel=_kernel,
        dissipative=True,
    )
)
'''


def test_an_effect_from_outside_in_one_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "eddy_brake.py").write_text(OUTSIDE, encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    card = importlib.import_module("eddy_brake").CARD
    try:
        ice = replace(
            Ice.uniform(1e-9), effects=(ActiveEffect(name="eddy_brake", parameters={"rate": 0.1}),)
        )
        save_ice(ice, tmp_path / "ice.json")
        run = slide(
            load_ice(tmp_path / "ice.json"),
            Throw(speed=2.0, angle=0, spin=0).release(),
            bounds=np.array([-2.0, 2.0, -20.0, 5.0]),
        )
        assert run.vy == pytest.approx(2.0 - 0.1 * (run.y + 10.9725), abs=5e-5)
        assert run.vy == pytest.approx(2.0 * exp(-0.1 * run.time), abs=5e-5)
        assert register(card) is card
        with pytest.raises(InputError, match="already registered"):
            register(replace(card, title="Another"))
    finally:
        unregister("eddy_brake")
        sys.modules.pop("eddy_brake")
    with pytest.raises(InputError, match="unknown effect 'eddy_brake'"):
        compile_law(ice)


ON_WORKERS = """
from curling_env.infrastructure.executor import executor
from curling_env.ice import load_ice
from curling_env.analysis.sweep import Sweep, run
from curling_env.throw import Throw

if __name__ == "__main__":
    release = Throw(speed=2.0, angle=0.0, spin=0.0).release()
    ices = [load_ice("ice.json"), load_ice("paper")]
    with executor(2) as workers:
        print(*run(Sweep(ices=ices, releases=[release]), workers).y.ravel())
"""


def test_a_declared_effect_is_known_to_workers_without_an_import(tmp_path: Path) -> None:
    """A package is a folder with its entry points, as made by an installer."""
    code = OUTSIDE + "\n\ndef card():\n    return CARD\n"
    (tmp_path / "eddy_brake.py").write_text(code.replace("register(", "("), encoding="utf-8")
    declared = tmp_path / "eddy_brake-1.0.dist-info"
    declared.mkdir()
    (declared / "METADATA").write_text("Metadata-Version: 2.1\nName: eddy_brake\nVersion: 1.0\n")
    (declared / "entry_points.txt").write_text("[curling.effects]\neddy_brake = eddy_brake:card\n")
    (tmp_path / "sweep.py").write_text(ON_WORKERS, encoding="utf-8")
    effect = ActiveEffect(name="eddy_brake", parameters={"rate": 0.1})
    save_ice(load_ice("paper").with_effect(effect), tmp_path / "ice.json")
    paths = [str(tmp_path), str(Path(__file__).parents[3])]
    done = subprocess.run(
        [sys.executable, "sweep.py"],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(paths)},
        capture_output=True,
        text=True,
        check=True,
    )
    braked, plain = map(float, done.stdout.split())
    assert braked < plain - 1.0
