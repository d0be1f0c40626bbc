"""Friction maps, ice and its file."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from curling_env.errors import InputError
from curling_env.ice import ActiveEffect, FrictionMap, Ice, load_ice, save_ice
from curling_env.ice_form import LevelError
from curling_env.physics import acceleration
from curling_env.sheet import PAPER_SHEET, WORLD_CURLING_SHEET, Sheet


def uneven(sheet: Sheet = PAPER_SHEET, interpolation="bilinear") -> Ice:
    rng = np.random.default_rng(5)
    mu = rng.uniform(0.006, 0.010, sheet.shape)
    return Ice(
        sheet=sheet,
        friction=FrictionMap(
            mu=mu, sigma=0.02 * mu, observed=rng.random(mu.shape) < 0.5, interpolation=interpolation
        ),
        effects=(
            ActiveEffect(name="curl", parameters={"strength": 0.008}, sigma={"strength": 1e-4}),
        ),
    )


def equal(a: Ice, b: Ice) -> bool:
    tables = ("mu", "sigma", "observed")
    return (
        all(np.array_equal(getattr(a.friction, k), getattr(b.friction, k)) for k in tables)
        and a.friction.interpolation == b.friction.interpolation
        and (a.sheet, a.effects, a.stone) == (b.sheet, b.effects, b.stone)
    )


@pytest.mark.parametrize("interpolation", ["bilinear", "cell"])
@pytest.mark.parametrize("sheet", [PAPER_SHEET, WORLD_CURLING_SHEET])
def test_refined_ice_has_the_same_friction_at_every_point(interpolation, sheet):
    ice = uneven(sheet, interpolation)
    finer = ice.refined(5)
    assert finer.sheet.cell_size == pytest.approx(0.1)
    rng = np.random.default_rng(2)
    points = rng.uniform(-0.5, 0.5, (2000, 2)) * [sheet.width, sheet.length]
    assert finer.mu_at(points) == pytest.approx(ice.mu_at(points), abs=1e-12)
    assert Ice.uniform(0.009).refined(3).friction.is_uniform
    with pytest.raises(InputError, match="odd"):
        ice.refined(4)


@pytest.mark.parametrize("interpolation", ["bilinear", "cell"])
@pytest.mark.parametrize("sheet", [PAPER_SHEET, WORLD_CURLING_SHEET, Sheet(cell_size=0.25)])
def test_ice_survives_its_file_to_the_last_bit(tmp_path, sheet, interpolation):
    ice = uneven(sheet, interpolation)
    save_ice(ice, tmp_path / "ice.json")
    assert equal(load_ice(tmp_path / "ice.json"), ice)


def test_assumed_parameters_are_stored_in_the_file(tmp_path):
    known = {"strength": 0.008, "speed_exponent": 0.2}
    guess = ActiveEffect(name="curl", parameters=known, believed=("strength", "speed_exponent"))
    measured = ActiveEffect(name="spin_drag", parameters={"rate": 0.01}, sigma={"rate": 1e-3})
    ice = Ice.uniform(0.008, effects=(guess, measured))
    save_ice(ice, tmp_path / "ice.json")
    again = load_ice(tmp_path / "ice.json")
    assert equal(again, ice)
    assert again.effect("curl").believed == ("strength", "speed_exponent")
    # Readers of releases before it refuse keys that they do not know.
    written = json.loads((tmp_path / "ice.json").read_text())["effects"]
    assert "believed" in written[0]
    assert "believed" not in written[1]


def test_common_errors_are_stored_in_the_file(tmp_path):
    curl = ActiveEffect(
        name="curl",
        parameters={"strength": 0.008},
        sigma={"strength": 1e-4},
        common={"strength": (0.6, -0.8)},
    )
    ice = Ice.uniform(0.008, effects=(curl,))
    level = LevelError(sigma=0.01, common=(0.3,))
    ice = replace(ice, friction=replace(ice.friction, level=level))
    save_ice(ice, tmp_path / "ice.json")
    assert equal(load_ice(tmp_path / "ice.json"), ice)
    assert load_ice(tmp_path / "ice.json").friction.level == level
    # Readers of releases before it refuse keys that they do not know.
    save_ice(Ice.uniform(0.008), tmp_path / "plain.json")
    assert "level" not in json.loads((tmp_path / "plain.json").read_text())["friction"]
    assert "level" not in json.loads((tmp_path / "ice.json").read_text())["effects"][0]


@pytest.mark.parametrize("name", ["standard", "fitted", "club", "fcv1", "paper"])
def test_presets_are_ice_and_have_a_file(tmp_path, name):
    ice = load_ice(name)
    save_ice(ice, tmp_path / "ice.json")
    assert equal(load_ice(str(tmp_path / "ice.json")), ice)
    assert load_ice(ice) is ice


def test_an_ice_file_keeps_where_it_comes_from(tmp_path):
    origin = {"version": "0.2.0", "inputs": [], "a key of a later release": 1}
    save_ice(uneven(), tmp_path / "ice.json", provenance=origin)
    read = load_ice(tmp_path / "ice.json")
    assert read.provenance == origin
    save_ice(read, tmp_path / "copy.json")
    assert (tmp_path / "copy.json").read_bytes() == (tmp_path / "ice.json").read_bytes()
    save_ice(read, tmp_path / "bare.json", provenance={})
    assert "provenance" not in json.loads((tmp_path / "bare.json").read_text())


def test_the_contracts_smallest_file_is_read(tmp_path):
    document = {
        "format": "curling-ice/1",
        "sheet": {"length": 44.5, "width": 4.5},
        "friction": {
            "cell_size": 0.5,
            "mu": [[0.008] * 9] * 89,
            "sigma": [[0.0001] * 9] * 89,
            "observed": [[True] * 9] * 89,
        },
        "effects": [
            {"name": "curl", "parameters": {"strength": 0.008}, "sigma": {"strength": None}}
        ],
    }
    (tmp_path / "ice.json").write_text(json.dumps(document))
    ice = load_ice(tmp_path / "ice.json")
    assert ice.sheet == PAPER_SHEET
    assert ice.friction.is_uniform
    assert ice.effect("curl").parameters == {"strength": 0.008}
    assert ice.effect("slope") is None


def broken(document, path, value):
    *parents, last = path
    place = document
    for key in parents:
        place = place[key]
    if value is KeyError:
        del place[last]
    else:
        place[last] = value
    return document


@pytest.mark.parametrize(
    ("path", "value", "says"),
    [
        (("format",), "curling-ice/9", "curling-ice/1"),
        (("sheet",), KeyError, "missing sheet"),
        (("sheet", "width"), "wide", "sheet.width"),
        (("sheet", "length"), -44.5, "length"),
        (("friction", "mu"), [[0.008] * 9] * 88, "sigma has shape"),
        (("friction", "mu", 3, 4), -0.001, r"friction.mu\[3\]\[4\]"),
        (("friction", "mu", 3, 4), 0, r"friction.mu\[3\]\[4\]"),
        (("friction", "mu", 3, 4), 8.2, r"friction.mu\[3\]\[4\]"),
        (("friction", "mu", 3, 4), None, r"friction.mu"),
        (("friction", "mu", 3), [0.008], "rows of equal length"),
        (("friction", "sigma", 0, 0), -1, r"friction.sigma\[0\]\[0\]"),
        (("friction", "cell_size"), 0.25, "rows"),
        (("friction", "interpolation"), "cubic", "interpolation"),
        (("friction", "colour"), 1, "unknown key colour"),
        (("stone",), {"weight": 19}, "unknown key weight"),
        (("effects",), {}, "effects: expected a list"),
        (("effects", 0, "name"), KeyError, r"effects\[0\]"),
        (("effects", 0, "parameters", "strength"), "strong", r"effects\[0\].parameters.strength"),
        (("effects", 0, "sigma", "strength"), -1e-4, r"effects\[0\].*at least 0"),
        (("effects", 0, "believed"), "strength", r"effects\[0\].believed"),
        (("effects", 0, "believed"), [1], r"effects\[0\].believed"),
        (("effects", 0, "believed"), ["speed_exponent"], r"effects\[0\].*'speed_exponent'"),
        (("effects", 0, "common"), {"speed_exponent": [0.5]}, r"effects\[0\].*no sigma"),
        (("effects", 0, "common"), {"strength": [0.8, 0.8]}, r"effects\[0\].*1.28"),
        (("effects", 0, "common"), {"strength": [1.5]}, r"effects\[0\].common"),
        (("effects", 0, "common"), {"strength": 0.5}, r"effects\[0\].common"),
        (("effects", 0, "common"), {"strength": [0.01] * 201}, r"effects\[0\].common"),
        (("friction", "level"), {"sigma": -0.1}, r"friction.level"),
        (("friction", "level"), {"common": []}, r"friction.level"),
        (("friction", "level"), {"sigma": 0.1, "common": [0.9, 0.9]}, r"friction.level: .*1.62"),
    ],
)
def test_broken_files_are_refused_with_the_place(tmp_path, path, value, says):
    source = tmp_path / "ice.json"
    save_ice(uneven(), source)
    source.write_text(json.dumps(broken(json.loads(source.read_text()), path, value)))
    with pytest.raises(InputError, match=says) as caught:
        load_ice(source)
    assert caught.value.source == str(source)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("text", ["", "{", "[]", "3", '"ice"'])
def test_an_invalid_ice_file_is_refused(tmp_path, text):
    (tmp_path / "ice.json").write_text(text)
    with pytest.raises(InputError):
        load_ice(tmp_path / "ice.json")


def test_an_unknown_ice_is_refused_with_the_list_of_presets():
    with pytest.raises(InputError, match="championship: .*club, fcv1, fitted, paper, standard"):
        load_ice("championship")


def test_a_file_may_give_one_number_for_uniform_ice(tmp_path):
    document = {
        "format": "curling-ice/1",
        "sheet": {"length": 45.72, "width": 4.75},
        "friction": {"cell_size": 0.25, "mu": 0.0079},
    }
    (tmp_path / "mine.json").write_text(json.dumps(document))
    ice = load_ice(tmp_path / "mine.json")
    sheet = Sheet(length=45.72, width=4.75, cell_size=0.25)
    assert equal(ice, Ice.uniform(0.0079, sheet))
    assert ice.friction.observed.all()


@pytest.mark.parametrize("mu", [-0.008, 0, 8.2, True, "0.008", None, {"value": 0.008}])
def test_one_number_for_uniform_ice_must_be_a_friction(tmp_path, mu):
    document = {
        "format": "curling-ice/1",
        "sheet": {"length": 44.5, "width": 4.5},
        "friction": {"cell_size": 0.5, "mu": mu},
    }
    (tmp_path / "mine.json").write_text(json.dumps(document))
    with pytest.raises(InputError, match=r"mine\.json.*friction\.mu"):
        load_ice(tmp_path / "mine.json")


@given(st.floats(-3, 3), st.floats(-24, 24))
def test_the_map_reads_the_same_as_in_the_force_law(x, y):
    for interpolation in ("bilinear", "cell"):
        ice = replace(uneven(interpolation=interpolation), effects=())
        ((_, ay, _),) = acceleration(ice, np.array([[x, y, 0.0, 2.0, 0.0]]))
        assert -ay / 9.80665 == pytest.approx(float(ice.mu_at((x, y))), rel=1e-9)


def test_the_map_is_exact_at_centres_and_halfway_between():
    ice = uneven()
    x, y, mu = PAPER_SHEET.x_centres, PAPER_SHEET.y_centres, ice.friction.mu
    points = np.stack(np.meshgrid(x, y), axis=-1)
    np.testing.assert_allclose(ice.mu_at(points), mu)
    between = ice.mu_at(((x[2] + x[3]) / 2, (y[7] + y[8]) / 2))
    assert between == pytest.approx(mu[7:9, 2:4].mean())


def test_a_map_must_have_the_sheets_cells():
    with pytest.raises(InputError, match="89 rows and 9 columns"):
        Ice(friction=FrictionMap.uniform(0.008, WORLD_CURLING_SHEET))


def test_parameters_are_finite():
    with pytest.raises(InputError, match=r"curl: parameters\.strength"):
        ActiveEffect(name="curl", parameters={"strength": float("nan")})
