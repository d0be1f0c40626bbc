"""The sections on what a discovery is worth."""

from __future__ import annotations

import numpy as np
from scipy.stats import kstest

from friction_estimation.reports.assessment_sections import (
    assessment_sections,
    models_section,
    pit_picture,
)

MODELS = [
    {"name": "named", "elpd": 60166.4, "se": 2565.0, "difference": 0.0, "difference_se": 0.0},
    {"name": "baseline + air_drag", "elpd": 60160.2, "se": 2566.0, "difference": -6.25,
     "difference_se": 2.5},
    {"name": "baseline", "elpd": 50000.0, "se": 2600.0, "difference": -10166.4,
     "difference_se": 800.0},
]  # fmt: skip


def test_models_are_named_in_words_with_their_differences():
    text = models_section(MODELS)
    assert text.index("the improved model") < text.index("the model as it was with air drag")
    assert "best" in text
    assert "-6.2" in text
    assert "2.5" in text
    assert "_" not in text.replace("elpd", "")


def test_values_are_even_as_kolmogorov_says():
    rng = np.random.default_rng(1)
    even = {"throws": list(range(18)), "across": ((np.arange(18) + 0.5) / 18).tolist()}
    # The figure is drawn each time: two on either side of the limit, and two far beyond it.
    others = sorted((rng.random(18) for _ in range(80)), key=lambda v: kstest(v, "uniform").pvalue)
    worse = sum(kstest(v, "uniform").pvalue <= 0.05 for v in others)
    near = others[worse - 2 : worse + 2]
    for values in [*near, rng.random(18) ** 2, rng.random(18) * 0.6]:
        (section,) = assessment_sections({"loo_pit": {**even, "along": values.tolist()}})
        is_even = "Both stay within the band" in section
        assert is_even == (kstest(values, "uniform").pvalue > 0.05)


def test_next_throws_say_what_they_teach():
    throw = {"words": "draw weight, towards the away end", "teaches": {"spin_drag": 0.31}}
    (section,) = assessment_sections({"next_throws": [throw]})
    assert "draw weight, towards the away end" in section
    assert "spin that fades faster than the band explains 31 %" in section


def test_a_report_that_says_nothing_has_no_sections():
    assert assessment_sections({}) == []
    few = {"throws": [1, 2], "along": [0.2, 0.8], "across": [0.1, 0.5]}
    assert assessment_sections({"models": MODELS[:1], "loo_pit": few}) == []


def test_the_steps_run_from_the_first_throw_to_the_last():
    values = np.array([0.1, 0.4, 0.5, 0.9, 0.95])
    figure = pit_picture({"along": values, "across": 1.0 - values})
    steps = figure.axes[0].lines[1].get_xydata()
    assert steps[0].tolist() == [0.0, 0.0]
    assert steps[-1].tolist() == [1.0, 1.0]
    assert steps[3].tolist() == [0.5, 0.6]


def test_a_side_that_leaves_the_band_is_said():
    even = np.linspace(0.02, 0.98, 20)
    sure = {"throws": list(range(20)), "along": (0.1 * even).tolist(), "across": even.tolist()}
    (section,) = assessment_sections({"loo_pit": sure})
    assert "how far it went leaves the band" in section
    fine = {**sure, "along": even.tolist()}
    assert "Both stay within the band" in assessment_sections({"loo_pit": fine})[0]
