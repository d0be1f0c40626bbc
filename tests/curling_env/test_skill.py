"""Scatter of throws: normal by default, with tails and a correlation if given."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.stats import norm, t

from curling_env.errors import InputError
from curling_env.throw import SKILLS, Skill

SIGMA: dict[str, Any] = {"sigma_speed": 0.02, "sigma_angle": 0.003, "sigma_spin": 0.1}


def test_without_tails_and_correlation_errors_are_those_of_before_to_the_last_bit():
    club = SKILLS["club"]
    assert (club.tails, club.correlation) == (math.inf, 0.0)
    sigma = np.array([club.sigma_speed, club.sigma_angle, club.sigma_spin])
    half = np.random.default_rng(4).standard_normal((3, 3))
    expected = (np.concatenate([half, -half])[:5] * sigma).tolist()
    assert club.errors(5, np.random.default_rng(4)).tolist() == expected
    one = np.random.default_rng(4).standard_normal(3)
    assert list(club.error(np.random.default_rng(4))) == (one * sigma).tolist()


@pytest.mark.parametrize("tails", [3.0, 5.0, math.inf])
def test_quantiles_are_those_of_students_t_with_the_given_standard_deviations(tails):
    skill = Skill(name="own", tails=tails, **SIGMA)
    rng = np.random.default_rng(1)
    errors = skill.errors(80_000, rng)[:40_000] / list(SIGMA.values())
    one = norm if tails == math.inf else t(tails, scale=math.sqrt((tails - 2) / tails))
    for share in (0.5, 0.9, 0.99, 0.998):
        beyond = (np.abs(errors) > one.ppf((1 + share) / 2)).mean(axis=0)
        off = 5 * math.sqrt(share * (1 - share) / len(errors))
        assert np.abs(beyond - (1 - share)).max() < off


def test_a_throw_that_went_wrong_went_wrong_in_everything():
    rng = np.random.default_rng(2)
    drawn = [Skill(name="a", tails=n).standard_errors(20_000, rng) ** 2 for n in (6.0, math.inf)]
    tailed, normal = (np.corrcoef(np.log(z.T))[0, 1] for z in drawn)
    assert tailed > 0.05 > abs(normal)


@pytest.mark.parametrize("tails", [4.0, math.inf])
@pytest.mark.parametrize("correlation", [-0.6, 0.8])
def test_speed_and_angle_are_correlated_and_spin_is_not(tails, correlation):
    skill = Skill(name="own", tails=tails, correlation=correlation, **SIGMA)
    signs = np.sign(skill.errors(40_000, np.random.default_rng(3)))[:20_000]
    # For elliptic errors the share of equal signs follows from the correlation alone.
    same = (signs[:, 0] == signs[:, 1]).mean()
    assert same == pytest.approx(0.5 + math.asin(correlation) / math.pi, abs=0.02)
    assert (signs[:, 0] == signs[:, 2]).mean() == pytest.approx(0.5, abs=0.02)


def test_one_error_and_many_have_the_same_distribution():
    skill = Skill(name="own", tails=3.5, correlation=0.5, **SIGMA)
    rng = np.random.default_rng(5)
    single = np.array([skill.error(rng) for _ in range(20_000)])
    many = skill.errors(40_000, rng)[:20_000]
    shares = np.linspace(0.05, 0.95, 15)
    for column in range(3):
        a, b = (np.quantile(e[:, column], shares) for e in (single, many))
        assert np.abs(a - b).max() < 0.12 * list(SIGMA.values())[column]
    assert np.sign(single[:, :2].prod(axis=1)).mean() == pytest.approx(1 / 3, abs=0.03)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"tails": 2.0}, "tails must be above 2"),
        ({"tails": math.nan}, "tails"),
        ({"correlation": 1.0}, "between -1 and 1"),
        ({"correlation": math.nan}, "between -1 and 1"),
        ({"sigma_angle": -1.0}, "sigma_angle"),
    ],
)
def test_an_invalid_distribution_is_refused(given, message):
    with pytest.raises(InputError, match=message):
        Skill(name="own", **(SIGMA | given))
