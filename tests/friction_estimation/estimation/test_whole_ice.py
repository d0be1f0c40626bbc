"""The whole ice from a few throws and from many: map, effects, and what is only believed.

The throws come from the blind sessions' own formulas and integrator.
"""

from __future__ import annotations

import numpy as np
import pytest
from blind.law import CURL, EXPONENT, MU, SIZE
from blind.sessions import make_session

from curling_env.ice import load_ice
from curling_env.infrastructure import write_table
from curling_env.trajectory import read_tracks
from friction_estimation import discover, estimate_ice
from friction_estimation.discovery import document

THINNED = 3
"""Only one of this number of rows is used: ten a second are enough for everything here."""


def session(folder, hidden, seed, **options):
    columns, sealed = make_session(hidden, np.random.default_rng(seed), **options)
    every = {name: values[::THINNED] for name, values in columns.items()}
    write_table(folder / "tracks.csv", every)
    return read_tracks(folder / "tracks.csv"), sealed


def names(found):
    report = document(found)
    return sorted(effect["name"] for effect in report["effects"]), report


@pytest.fixture(scope="module")
def three_draws(tmp_path_factory):
    folder = tmp_path_factory.mktemp("draws")
    return session(folder, (), 11, throws=3, ways=1, championship=True)


def test_three_throws_one_way_give_an_ice_that_curls(three_draws, unchanged) -> None:
    tracks, sealed = three_draws
    numbers = np.array(sealed["numbers"])
    assert len(numbers) == SIZE
    found = estimate_ice(tracks)
    for name, parameter, place in (
        ("curl", "strength", CURL),
        ("speed_dependent_friction", "exponent", EXPONENT),
    ):
        effect = found.ice.effect(name)
        error = effect.parameters[parameter] - numbers[place]
        assert abs(error) < 4 * effect.sigma[parameter] + 1e-4
    level = np.log(found.ice.friction.mu[found.ice.friction.observed]).mean()
    assert level == pytest.approx(np.log(numbers[MU]), abs=0.06)
    remarks = " ".join(found.remarks)
    assert "All throws went one way" in remarks
    assert "No heading was measured" not in remarks
    unchanged.document(found.summary())


def test_without_headings_the_spin_is_believed(three_draws, unchanged) -> None:
    from dataclasses import replace

    tracks, _ = three_draws
    blind = [replace(track, theta=np.full(len(track), np.nan)) for track in tracks]
    found = estimate_ice(blind)
    drag = found.ice.effect("spin_drag")
    assert "rate" in drag.believed
    assert drag.sigma["rate"] > 0.7 * 0.006
    assert any(words.startswith("No heading was measured") for words in found.remarks)
    assert any("is assumed, not measured: film more stones" in words for words in found.remarks)
    unchanged.document(found.summary())


def test_a_map_and_curl_are_distinguished_and_both_sized(tmp_path, unchanged) -> None:
    tracks, sealed = session(tmp_path, ("friction_map", "curl"), 3, throws=12)
    found = discover(tracks)
    named, report = names(found)
    assert named == ["curl", "friction_map"]
    ice = found.improved_ice()
    seen = ice.friction.observed
    true = np.array(sealed["map"])[seen]
    got = np.log(ice.friction.mu)[seen]
    error = (got - got.mean()) - (true - true.mean())
    assert np.sqrt(np.mean(error**2)) < 0.4 * true.std()
    sigma = (ice.friction.sigma / ice.friction.mu)[seen]
    level = np.log(np.array(sealed["numbers"])[MU])
    # The cells of one session err together: now and then a fifth of them lies outside.
    assert np.mean(np.abs(got - true - level) < 1.96 * sigma) > 0.75
    unchanged.document(report)


@pytest.mark.parametrize(("hidden", "seed"), [((), 2), (("slope",), 3)])
def test_a_given_models_strengths_are_changes_and_no_effects(
    tmp_path, hidden, seed, unchanged
) -> None:
    tracks, sealed = session(tmp_path, hidden, seed, throws=12, championship=True)
    found = discover(tracks, load_ice("standard"))
    named, report = names(found)
    assert named == list(hidden)
    changes = {(c["name"], c["parameter"]): c for c in report["changes"]}
    for (name, parameter), place in {
        ("curl", "strength"): CURL,
        ("speed_dependent_friction", "exponent"): EXPONENT,
    }.items():
        change = changes[name, parameter]
        true = np.array(sealed["numbers"])[place]
        assert abs(change["found"] - true) < 4 * change["stderr"]
        result = " ".join([report["verdict"], *report["remarks"]])
        assert f"{name.replace('_', ' ')}" in result or "friction" in result
    unchanged.document(report)


def test_slow_noise_is_no_effect(tmp_path, unchanged) -> None:
    tracks, _ = session(tmp_path, (), 1, throws=12, bad=True)
    named, report = names(discover(tracks))
    assert named == []
    unchanged.document(report)
