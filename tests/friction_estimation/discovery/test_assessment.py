"""What a discovery is worth: its models in the order of what they foretell."""

from __future__ import annotations

from typing import Any

import pytest

from friction_estimation import discover
from friction_estimation.discovery import assess, document
from friction_estimation.discovery.assessment import models_in_question

from .conftest import effect


def _clearly_worse(model: dict[str, Any]) -> bool:
    """Whether a model foretells worse than the best by more than twice the difference's error."""
    return model["difference"] < -2.0 * model["difference_se"]


def test_models_of_two_effects_are_named_and_ranked(make_session):
    hidden = [effect("curl", strength=0.006), effect("slope", x=5e-4, y=3e-4)]
    found = discover(make_session(hidden, throws=14, scatter=0.004))
    assert {e.label for e in found.effects} == {"curl", "slope"}
    fits = models_in_question(found)
    assert {"baseline", "named", "named without curl", "named without slope"} <= set(fits)
    # The baseline with curl is the improved model without the slope: it stands once.
    assert "baseline + curl" not in fits
    assert {len(fitted.session) for fitted in fits.values()} == {14}
    assert len({fitted.noise for fitted in fits.values()}) == 1
    added = [name for name in fits if name.startswith("named + ")]
    assert 1 <= len(added) <= 3
    assert all(fits[name].deviance < fits["named"].deviance + 3.0 for name in added)
    base = fits["baseline"]
    assert all(f.deviance < base.deviance + 100 for f in fits.values())
    models = document(found, assess(found))["models"]
    assert models[0]["name"].startswith("named")
    assert models[0]["difference"] == 0.0
    named = next(model for model in models if model["name"] == "named")
    assert not _clearly_worse(named)
    for model in models:
        lacks_an_effect = model["name"].startswith(("baseline", "named without"))
        assert _clearly_worse(model) or not lacks_an_effect, model["name"]
    for model in models[1:]:
        assert model["difference"] <= 0.0
        assert model["difference_se"] > 0.0
    by_name = {model["name"]: model["elpd"] for model in models}
    assert by_name["baseline"] < by_name["named without curl"] < by_name["named"]


def test_where_nothing_is_missing_no_candidate_foretells_clearly_better(make_session):
    found = discover(make_session(throws=12))
    assert not found.effects
    models = document(found, assess(found))["models"]
    assert {"baseline"} < {model["name"] for model in models}
    baseline = next(model for model in models if model["name"] == "baseline")
    assert not _clearly_worse(baseline)
    # A patch put where it serves these throws best foretells none that did not help to place it.
    patch = next(model for model in models if model["name"] == "baseline + friction_patch")
    assert patch["difference"] < baseline["difference"]
    assert "named" not in {model["name"] for model in models}


@pytest.mark.parametrize("throws", [1, 3])
def test_few_throws_are_assessed_too(make_session, throws):
    found = discover(make_session(throws=throws))
    assessed = document(found, assess(found))
    (model,) = assessed["models"]
    assert model["name"] == "baseline"
    assert len(assessed["loo_pit"]["throws"]) <= throws
