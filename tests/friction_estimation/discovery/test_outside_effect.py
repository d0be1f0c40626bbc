"""A user's own effect: named, sized, drawn and observed like those of the project."""

from __future__ import annotations

import importlib
import sys

import numpy as np
import pytest

from curling_env.envs.known_ice import ice_features, ice_names
from curling_env.ice import ActiveEffect, Ice
from curling_env.physics import unregister
from curling_env.sheet import Direction
from friction_estimation import discover
from friction_estimation.discovery import document
from friction_estimation.reports import residual_pictures, write_report_page

from .conftest import effect

TROUGH = '''
"""Ice that is lower in the middle of the sheet."""

from curling_env.physics.compiled import effect_kernel
from curling_env.physics.effects import EffectCard, Parameter, register
from curling_env.physics.motion import PUSH_X, X


@effect_kernel
def _kernel(motion, theta, push):
    push[PUSH_X] -= theta[0] * motion[X]


CARD = register(
    EffectCard(
        name="trough",
        title="Trough",
        readable="ice that is lower in the middle",
        formula="dvx/dt = -rate * x",
        parameters=(
            Parameter(
                name="rate", unit="1/s²", meaning="fall per metre", low=-0.1, high=0.1, neutral=0.0
            ),
        ),
        source="a user",
        validity="a sheet flooded from its sides",
        evidence="stones drift to the centre line",
        acts="motion",
        kernel=_kernel,
        dissipative=False,
        pushes=("across the sheet",),
        shown_over="x",
        observed={"rate": 0.004},
    )
)
'''


@pytest.fixture
def trough(tmp_path, monkeypatch):
    """The effect, registered by importing its file."""
    (tmp_path / "trough.py").write_text(TROUGH, encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    yield importlib.import_module("trough").CARD
    unregister("trough")
    sys.modules.pop("trough")


def test_its_file_alone_makes_it_named_sized_and_drawn(make_session, trough, tmp_path, unchanged):
    found = discover(make_session([effect("trough", rate=0.002)], throws=8))
    report = document(found)
    (named,) = report["effects"]
    assert named["name"] == "trough"
    assert named["kind"] == "physics"
    assert abs(named["parameters"]["rate"]["value"] / 0.002 - 1) < 0.15
    assert named["where"].startswith("stones drift to the centre line; clearest in throws")
    assert "The model lacks ice that is lower in the middle:" in report["verdict"]
    assert found.improved_ice().effect("trough") is not None
    ((label, figure),) = residual_pictures(found)
    assert label == "trough"
    assert figure.axes[0].get_xlabel() == "across the sheet, x [m]"
    assert "to the side" in figure.axes[0].get_ylabel()
    write_report_page(found, report, tmp_path / "report.html")
    page = (tmp_path / "report.html").read_text()
    assert "Evidence for ice that is lower in the middle" in page
    unchanged.document(report)
    unchanged.page(page)


def test_an_agent_observes_it(trough):
    names = ice_names()
    place = names.index("trough.rate")
    ice = Ice.uniform(0.009, effects=(ActiveEffect(name="trough", parameters={"rate": 0.002}),))
    result = ice_features(ice, Direction.AWAY)
    assert result[place] == np.float32(0.5)
    # It comes after the effects of the project, whose places trained policies rely on.
    assert place == len(names) - 1 == len(result) - 1


def test_what_is_known_of_the_projects_effects_keeps_its_places():
    names = ice_names()
    first = names.index("speed_dependent_friction.exponent")
    assert names[first : first + 13] == (
        "speed_dependent_friction.exponent",
        "speed_dependent_friction.speed_offset",
        "speed_dependent_friction.share",
        "curl.strength",
        "curl.speed_exponent",
        "curl.spin_exponent",
        "air_drag.coefficient",
        "spin_drag.rate",
        "spin_drag.speed_exponent",
        "spin_drag.speed_floor",
        "spin_drag.spin_exponent",
        "slope.x",
        "slope.y",
    )
