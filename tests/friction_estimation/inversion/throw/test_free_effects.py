"""Effects fitted together with the map, on throws that another program threw."""

from __future__ import annotations

import json
from types import SimpleNamespace

import numpy as np
import pytest

from curling_env.errors import InputError
from curling_env.ice import ActiveEffect, Ice, save_ice
from curling_env.trajectory import write_tracks
from friction_estimation.inversion import estimate_friction

UNKNOWN = Ice.uniform(
    0.0085,
    effects=(
        ActiveEffect(name="speed_dependent_friction", parameters={"exponent": 0.0}),
        ActiveEffect(name="slope", parameters={"x": 0.0, "y": 0.0}),
        ActiveEffect(name="curl", parameters={"strength": 0.004}),
    ),
)
"""Nothing is known of how friction follows the speed, nor whether the ice is level."""


@pytest.fixture(scope="module")
def thrown(sliding) -> dict[float, SimpleNamespace]:
    """Sixteen throws on uneven ice, with and without friction that follows the speed."""
    out = {}
    for exponent in (0.0, 0.25):
        rng = np.random.default_rng(7)
        field = sliding.random_field(rng, mu=0.009, spread=0.06, length=3.0)
        starts = sliding.varied_starts(rng, 16, spin=0.0)
        tracks = sliding.measured_throws(field, starts, rng, exponent=exponent)
        found = estimate_friction(tracks, start=UNKNOWN, refit=True)
        sheet = found.ice.sheet
        truth = field(*np.meshgrid(sheet.x_centres, sheet.y_centres))
        out[exponent] = SimpleNamespace(tracks=tracks, found=found, truth=truth)
    return out


@pytest.mark.parametrize("exponent", [0.0, 0.25])
def test_exponent_and_slope_are_separated_from_the_map(thrown, exponent):
    ice = thrown[exponent].found.ice
    speed, slope, _ = ice.effects
    error = speed.parameters["exponent"] - exponent
    assert 0 < speed.sigma["exponent"] < 0.01
    assert abs(error) < 3.5 * speed.sigma["exponent"]
    assert abs(slope.parameters["y"]) < 3.5 * slope.sigma["y"] < 1e-4


def test_map_is_as_good_as_if_the_effect_were_known(thrown):
    case = thrown[0.25]
    seen = case.found.ice.friction.observed

    def error(ice: Ice) -> float:
        return float(np.sqrt(np.mean((ice.friction.mu / case.truth - 1)[seen] ** 2)))

    law = ActiveEffect(name="speed_dependent_friction", parameters={"exponent": 0.25})
    given = estimate_friction(case.tracks, start=Ice.uniform(0.0085, effects=(law,))).ice
    ignorant = estimate_friction(case.tracks).ice
    assert error(case.found.ice) < 1.2 * error(given) + 2e-3
    assert error(ignorant) > 3 * error(case.found.ice)


def test_what_acts_across_the_travel_is_left_alone(thrown):
    _, slope, curl = thrown[0.25].found.ice.effects
    assert curl == UNKNOWN.effects[2]
    assert slope.parameters["x"] == 0.0
    assert "x" not in slope.sigma


def test_without_refit_effects_stay(thrown):
    found = estimate_friction(thrown[0.25].tracks[:6], start=UNKNOWN)
    assert found.ice.effects == UNKNOWN.effects


def test_knowledge_of_a_refitted_ice_takes_later_throws(thrown, sliding):
    case = thrown[0.25]
    again = estimate_friction(case.tracks[:1], start=case.found.ice, update=case.found.information)
    assert again.ice.effects == case.found.ice.effects
    # A throw that was there before can hardly move the map.
    np.testing.assert_allclose(again.ice.friction.mu, case.found.ice.friction.mu, rtol=0.01)


def test_what_cannot_be_refitted_is_refused(thrown):
    tracks = thrown[0.0].tracks[:2]
    with pytest.raises(InputError, match="no effect to refit"):
        estimate_friction(tracks, refit=True)
    with pytest.raises(InputError, match="together with a map"):
        estimate_friction(tracks, start=UNKNOWN, refit=True, uniform=True)


def test_command_refits(curling, thrown, tmp_path):
    write_tracks(tmp_path / "tracks.csv", thrown[0.25].tracks[:8])
    save_ice(UNKNOWN, tmp_path / "start.json")
    run = curling(
        "estimate", tmp_path / "tracks.csv", "--start", tmp_path / "start.json", "--refit",
        "-o", tmp_path / "ice.json",
    )  # fmt: skip
    assert run.status == 0
    effects = {e["name"]: e for e in json.loads((tmp_path / "ice.json").read_text())["effects"]}
    assert abs(effects["speed_dependent_friction"]["parameters"]["exponent"] - 0.25) < 0.03
    assert run.json()["effects"][0]["sigma"]["exponent"] > 0
    complaint = curling(
        "estimate", tmp_path / "tracks.csv", "--refit", "-o", tmp_path / "no.json"
    ).complaint
    assert "no effect to refit" in complaint
