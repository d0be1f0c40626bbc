"""Ices sampled within standard errors, and places of rest on them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from curling_env.analysis import is_uncertain, plausible_ices, rest_spread
from curling_env.errors import InputError
from curling_env.ice import ActiveEffect, FrictionMap, Ice, load_ice
from curling_env.ice_form import LevelError
from curling_env.physics import release_table, slide, throw_batch
from curling_env.throw import Throw


def with_sigma(ice: Ice, name: str, **sigma: float) -> Ice:
    effects = tuple(replace(e, sigma=sigma) if e.name == name else e for e in ice.effects)
    return replace(ice, effects=effects)


def doubtful(share: float = 0.05) -> Ice:
    """Championship ice with σ of its map, and of two effects."""
    ice = load_ice("standard")
    ice = replace(ice, friction=replace(ice.friction, sigma=share * ice.friction.mu))
    ice = with_sigma(ice, "curl", strength=8e-4, speed_exponent=0.05)
    return with_sigma(ice, "speed_dependent_friction", exponent=0.01)


def values(ices: list[Ice], name: str, parameter: str) -> np.ndarray:
    return np.array([ice.effect(name).parameters[parameter] for ice in ices])


def draw(ice: Ice, n: int, seed: int = 1, **options: bool) -> list[Ice]:
    return plausible_ices(ice, n, np.random.default_rng(seed), **options)


def test_maps_have_the_maps_sigma():
    drawn = draw(doubtful(), 400)
    mu, centre = np.array([one.friction.mu for one in drawn]), doubtful().friction.mu
    np.testing.assert_allclose(mu.mean(axis=0), centre, rtol=1e-9)
    np.testing.assert_allclose(mu.std(axis=0) / centre, 0.05, rtol=0.25)
    neighbours = np.corrcoef(mu[:, 40, 4], mu[:, 41, 4])[0, 1]
    far = np.corrcoef(mu[:, 40, 4], mu[:, 60, 4])[0, 1]
    assert neighbours > 0.9
    assert abs(far) < 0.25


def test_parameters_have_their_sigma_each_on_its_own():
    drawn = draw(doubtful(), 400)
    wanted = {
        ("curl", "strength"): (0.0082, 8e-4),
        ("curl", "speed_exponent"): (0.2, 0.05),
        ("speed_dependent_friction", "exponent"): (0.25, 0.01),
    }
    columns = {key: values(drawn, *key) for key in wanted}
    for key, (mean, sigma) in wanted.items():
        assert columns[key].mean() == pytest.approx(mean, abs=1e-9)
        assert columns[key].std() == pytest.approx(sigma, rel=0.02)
        # Of a Gaussian 68 % and 95 % lie within one and two standard deviations.
        away = np.abs(columns[key] - mean) / sigma
        assert (away < 1).mean() == pytest.approx(0.683, abs=0.02)
        assert (away < 2).mean() == pytest.approx(0.954, abs=0.02)
    apart = np.abs(np.corrcoef(list(columns.values())) - np.eye(3))
    assert apart.max() < 0.15
    level = np.array([ice.friction.mu.mean() for ice in drawn])
    assert abs(np.corrcoef(level, columns["curl", "strength"])[0, 1]) < 0.15
    # What has no σ stays.
    assert all(ice.effect("air_drag") == doubtful().effect("air_drag") for ice in drawn)
    assert set(values(drawn, "spin_drag", "rate")) == {0.0115}


def together(ice: Ice) -> Ice:
    """Return the ice with errors of curl and level that are correlated with that of the
    exponent.
    """
    common = {"speed_dependent_friction": {"exponent": (1.0,)}, "curl": {"strength": (-0.6, 0.8)}}
    effects = tuple(replace(e, common=common.get(e.name, {})) for e in ice.effects)
    level = LevelError(sigma=0.03, common=(0.8, 0.2))
    return replace(ice, effects=effects, friction=replace(ice.friction, level=level))


def test_errors_are_correlated_as_stated_in_the_ice():
    drawn = draw(together(doubtful()), 600)
    exponent = values(drawn, "speed_dependent_friction", "exponent")
    strength = values(drawn, "curl", "strength")
    mu = np.array([one.friction.mu for one in drawn]) / doubtful().friction.mu
    # The mean of nine columns and a hundred rows holds the level, and little of the rest.
    level = mu.mean(axis=(1, 2)) - 1.0
    found = np.corrcoef([exponent, strength, level])
    assert found[0, 1] == pytest.approx(-0.6, abs=0.08)
    assert found[0, 2] == pytest.approx(0.8, abs=0.1)
    assert found[1, 2] == pytest.approx(-0.6 * 0.8 + 0.8 * 0.2, abs=0.12)
    free = values(drawn, "curl", "speed_exponent")
    assert abs(np.corrcoef(free, exponent)[0, 1]) < 0.12
    # What each has by itself stays what its σ says.
    assert exponent.std() == pytest.approx(0.01, rel=0.05)
    assert strength.std() == pytest.approx(8e-4, rel=0.08)
    assert level.std() == pytest.approx(0.03, rel=0.15)
    np.testing.assert_allclose(mu.std(axis=0), 0.05, rtol=0.25)


def test_a_rest_is_as_sure_as_the_sum_that_is_known():
    """Less friction that follows the speed more stops a stone at the same place."""
    ice = load_ice("standard")
    ice = replace(ice, friction=replace(ice.friction, sigma=0.02 * ice.friction.mu))
    ice = with_sigma(ice, "speed_dependent_friction", exponent=0.03)
    throw = Throw(speed=2.2).release()
    along = []
    for share in (1.0, -1.0):
        level = LevelError(sigma=0.02, common=(share,))
        whole = replace(ice, friction=replace(ice.friction, level=level))
        effects = tuple(
            replace(e, common={"exponent": (1.0,)}) if e.sigma else e for e in whole.effects
        )
        along.append(rest_spread(replace(whole, effects=effects), throw)[1])
    independent = rest_spread(ice, throw)[1]
    assert min(along) < 0.9 * independent
    assert max(along) > 1.5 * independent


def test_a_map_alone_errs_as_if_the_effects_were_known():
    ice = together(doubtful())
    level = replace(ice.friction.level, common=(0.8, 0.6))
    ice = replace(ice, friction=replace(ice.friction, level=level))
    mu = np.array([one.friction.mu for one in draw(ice, 200, effects=False)])
    rest = np.sqrt(0.05**2 - 0.03**2)
    np.testing.assert_allclose(mu.std(axis=0) / ice.friction.mu, rest, rtol=0.35)


def test_the_uncertainty_of_a_cell_never_exceeds_its_sigma():
    ice = together(doubtful(share=0.01))
    mu = np.array([one.friction.mu for one in draw(ice, 400)])
    np.testing.assert_allclose(mu.std(axis=0) / ice.friction.mu, 0.01, rtol=0.05)


def test_few_ices_show_a_parameters_sigma_too():
    ice = with_sigma(load_ice("standard"), "curl", strength=8e-4)
    sets = [values(draw(ice, 32, seed), "curl", "strength") for seed in range(40)]
    np.testing.assert_allclose(np.mean(sets, axis=1), 0.0082, atol=1e-9)
    found = np.std(sets, axis=1) / 8e-4
    assert found.mean() == pytest.approx(1.0, abs=0.03)
    assert found.std() < 0.09  # sixteen independent draws would scatter by 0.18
    rng = np.random.default_rng(0)
    single = values([plausible_ices(ice, 1, rng)[0] for _ in range(2000)], "curl", "strength")
    assert single.mean() == pytest.approx(0.0082, abs=3 * 8e-4 / np.sqrt(2000))
    assert single.std() == pytest.approx(8e-4, rel=0.05)


def test_draws_stay_within_the_bounds_of_the_card():
    at_the_edge = ActiveEffect(
        name="curl",
        parameters={"strength": 0.008, "speed_exponent": -1.0},
        sigma={"speed_exponent": 0.4, "spin_exponent": 50.0},
    )
    drawn = draw(Ice.uniform(0.008, effects=(at_the_edge,)), 400)
    exponents = values(drawn, "curl", "speed_exponent")
    assert exponents.min() >= -1.0
    # The upper half of a Gaussian, whose mean lies sqrt(2/pi) of its σ above the middle.
    assert exponents.mean() == pytest.approx(-1.0 + 0.4 * np.sqrt(2 / np.pi), abs=0.01)
    # A parameter that the file leaves out is drawn around its default; this σ says nothing of it,
    # so that every value within the bounds is as likely.
    spins = values(drawn, "curl", "spin_exponent")
    assert 0.0 <= spins.min() < 0.05
    assert 1.95 < spins.max() <= 2.0
    assert spins.mean() == pytest.approx(1.0, abs=0.02)


def test_friction_stays_positive():
    ice = Ice(friction=FrictionMap.uniform(0.008, sigma=0.02))
    mu = np.array([one.friction.mu for one in draw(ice, 100)])
    assert mu.min() == pytest.approx(0.2 * 0.008)


def test_however_unsure_a_map_is_cells_are_not_a_thousandfold_apart():
    unsure = Ice.uniform(0.0082)
    unsure = replace(unsure, friction=replace(unsure.friction, sigma=unsure.friction.mu + 1e9))
    for ice in plausible_ices(unsure, 6, np.random.default_rng(0)):
        assert ice.friction.mu.min() >= 0.0082 / 5.001
        assert ice.friction.mu.max() <= 0.0082 * 5.001


def test_the_sides_of_a_patch_keep_their_order():
    sides = {"x_min": -0.1, "x_max": 0.1, "y_min": 3.0, "y_max": 6.0}
    patch = ActiveEffect(
        name="friction_patch", parameters={**sides, "factor": 1.1}, sigma=dict.fromkeys(sides, 0.5)
    )
    for ice in draw(Ice.uniform(0.008, effects=(patch,)), 200):
        drawn = ice.effect("friction_patch").parameters
        assert drawn["x_min"] <= drawn["x_max"]
        assert drawn["y_min"] <= drawn["y_max"]


def test_ice_without_sigma_is_all_there_is():
    camera = ActiveEffect(name="scale_error", parameters={"factor": 1.01}, sigma={"factor": 0.002})
    for ice in (load_ice("standard"), load_ice("paper").with_effect(camera)):
        assert not is_uncertain(ice)
        assert draw(ice, 8) == [ice]
        assert rest_spread(ice, Throw(speed=1.0).release()) is None
    assert is_uncertain(doubtful())
    alone = with_sigma(load_ice("standard"), "curl", strength=8e-4)
    assert is_uncertain(alone)
    assert draw(alone, 8, effects=False) == [alone]


def test_the_same_seed_gives_the_same_bits_on_any_number_of_workers():
    def rests(workers: int) -> np.ndarray:
        ices, each = draw(doubtful(), 4, seed=3), 600
        table = np.tile(release_table([Throw(speed=2.0, spin=1.0).release()]), 4 * each)
        table["vy"] += np.linspace(0.0, 0.1, len(table))
        which = np.repeat(np.arange(4), each)
        out = throw_batch(ices, table, which=which, workers=workers)
        return np.column_stack([out.x, out.y])

    first = rests(1)
    np.testing.assert_array_equal(first, rests(1))
    np.testing.assert_array_equal(first, rests(2))
    other = [ice.friction.mu[40, 4] for ice in draw(doubtful(), 4, seed=4)]
    assert other != [ice.friction.mu[40, 4] for ice in draw(doubtful(), 4, seed=3)]


def test_the_maps_errors_move_a_rest_by_their_integral_along_the_way():
    # v²/2 = g ∫ μ dy: the rest moves by -∫ δμ dy / μ. With correlation exp(-(d/ℓ)²/2) the variance
    # of the integral over a way L is σ² (√(2π) ℓ L - 2 ℓ²) for L well above ℓ.
    share, length, mu = 0.02, 2.0, 0.0082
    ice = Ice(friction=FrictionMap.uniform(mu, sigma=share * mu))
    release = Throw(speed=2.1).release()
    way = slide(ice, release).y - release.y
    across, along = rest_spread(ice, release)
    wanted = share * np.sqrt(np.sqrt(2 * np.pi) * length * way - 2 * length**2)
    assert along == pytest.approx(wanted, rel=0.12)
    assert across < 0.1 * along


def test_an_effects_error_moves_a_rest_by_its_slope():
    release = Throw(speed=2.1, spin=1.0).release()

    def end(strength: float) -> np.ndarray:
        curl = ActiveEffect(name="curl", parameters={"strength": strength, "speed_exponent": 0.2})
        rest = slide(Ice.uniform(0.0082, effects=(curl,)), release)
        return np.array([rest.x, rest.y])

    slope = np.abs(end(0.0083) - end(0.0081)) / 2e-4
    curl = ActiveEffect(
        name="curl",
        parameters={"strength": 0.0082, "speed_exponent": 0.2},
        sigma={"strength": 4e-4},
    )
    spread = rest_spread(Ice.uniform(0.0082, effects=(curl,)), release)
    np.testing.assert_allclose(spread, 4e-4 * slope, rtol=0.03, atol=1e-4)


def test_a_stone_that_leaves_the_ice_has_no_spread_of_its_rest():
    assert rest_spread(doubtful(), Throw(speed=4.0).release()) is None


@pytest.mark.parametrize(
    ("effect", "says"),
    [
        (ActiveEffect(name="magic", sigma={"x": 1.0}), "unknown effect 'magic'"),
        (
            ActiveEffect(name="curl", parameters={"strength": 0.008}, sigma={"power": 0.1}),
            "sigma of 'power'",
        ),
        (ActiveEffect(name="curl", sigma={"strength": 0.1}), "needs its parameter"),
    ],
)
def test_effects_that_their_card_does_not_know_are_refused(effect, says):
    with pytest.raises(InputError, match=says):
        draw(Ice.uniform(0.008, effects=(effect,)), 4)
