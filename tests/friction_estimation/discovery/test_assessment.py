"""What a discovery is worth: its models in the order of what they foretell."""

from __future__ import annotations

from typing import Any

import pytest

from friction_estimation import discover
from friction_estimation.discovery import assess, document

from .conftest import effect


def _clearly_worse(model: dict[str, Any]) -> bool:
    """Whether a model foretells worse than the best by more than twice the difference's error."""
    return model["difference"] < -2.0 * model["difference_se"]


def test_models_of_two_effects_are_named_and_ranked(make_session):
    hidden = [effect("curl", strength=0.006), effect("slope", x=5e-4, y=3e-4)]
    found = discover(make_session(hidden, throws=12, scatter=0.004))
    assert {e.label for e in found.effects} == {"curl", "slope"}
    models = document(found, assess(found))["models"]
    names = [model["name"] for model in models]
    assert {"baseline", "named", "named without curl", "named without slope"} <= set(names)
    # The baseline with curl is the improved model without the slope: it stands once.
    assert "baseline + curl" not in names
    assert len(set(names)) == len(names)
    assert 1 <= sum(name.startswith("named + ") for name in names) <= 3
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
