"""`curling validate`."""

from __future__ import annotations

from curling_env.ice import load_ice, save_ice
from curling_env.validation import ICE_ROWS


def test_an_ice_is_compared_with_published_values(curling, tmp_path):
    save_ice(load_ice("standard"), tmp_path / "ice.json")
    found = curling("validate", tmp_path / "ice.json").json()
    assert found["ice"].endswith("ice.json")
    assert sum(found["counts"].values()) == len(found["rows"]) == len(ICE_ROWS)
    row = next(row for row in found["rows"] if row["name"] == "draw, hog to hog")
    assert row["published"] == "13.0–14.5 s"
    assert (row["low"], row["high"], row["unit"]) == (13.0, 14.5, "s")
    assert 13.5 < row["value"] < 14.0
    assert row["verdict"] == "agrees"
    # Reasons known of a preset are not those of a file.
    curl = next(row for row in found["rows"] if row["name"] == "curl of a draw")
    assert (curl["verdict"], curl["why"]) == ("differs", "")


def test_the_standard_ice_is_meant_where_none_is_named(curling):
    assert curling("validate").json()["ice"] == "standard"


def test_an_invalid_ice_is_refused(curling):
    done = curling("validate", "nothing.json")
    assert "no such ice file" in done.complaint
