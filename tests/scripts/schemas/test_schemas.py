"""Published schemas agree with the program, accept its files, and reject broken ones."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from jsonschema import Draft202012Validator
from schemas import FILES, FOLDER

from agents.planning import read_stones
from agents.playing import read_record
from curling_env.game import load_skill
from curling_env.ice import load_ice, preset_names
from friction_estimation import load_scene
from friction_estimation.camera import load_lens
from friction_estimation.donation import read_session
from friction_estimation.reports import findings
from friction_estimation.tracking import camera_from
from friction_estimation.tracking.films.shared_cameras import FORMAT as CAMERA_FORMAT

SCHEMAS = {
    path.name.removesuffix(".schema.json"): json.loads(path.read_text(encoding="utf-8"))
    for path in sorted(FOLDER.glob("*.json"))
}
SPECIMENS = Path(__file__).parent / "specimens"
"""One file of every released number of every format; they are never edited."""


def documents(name: str) -> list[Any]:
    """Return the specimen of a kind of file, line by line if its lines are documents."""
    (path,) = SPECIMENS.glob(f"{name}.json*")
    text = path.read_text(encoding="utf-8")
    return [json.loads(k) for k in (text.splitlines() if path.suffix == ".jsonl" else [text])]


def broken(document: Any, part: dict[str, Any]) -> Iterator[Any]:
    """A document with one fault each: an entry missing, of another type, unknown.

    Parameters
    ----------
    part : schema of the document, an object
    """
    for key in part["required"]:
        yield {name: value for name, value in document.items() if name != key}
    for key in document.keys() & part["properties"].keys():
        other = "text" if isinstance(document[key], dict | list) else {"an": "object"}
        yield {**document, key: other}
    if part.get("additionalProperties") is False:
        yield {**document, "no such key": 1}


@pytest.mark.parametrize("name", FILES)
def test_the_published_schema_agrees_with_the_program(name):
    made = json.loads(json.dumps(FILES[name].schema(name)))
    assert SCHEMAS[name] == made, "run `make schemas`"


@pytest.mark.parametrize("name", SCHEMAS)
def test_every_schema_is_sound_and_names_itself(name):
    Draft202012Validator.check_schema(SCHEMAS[name])
    assert SCHEMAS[name]["$id"] == f"{name}.schema.json"


def test_the_page_lists_every_schema_and_each_has_its_specimen():
    text = (FOLDER / "README.md").read_text(encoding="utf-8")
    assert set(re.findall(r"\]\(([\w-]+)\.schema\.json\)", text)) == set(SCHEMAS)
    assert {path.stem for path in SPECIMENS.iterdir()} == set(SCHEMAS)


@pytest.mark.parametrize("path", sorted(SPECIMENS.iterdir()), ids=lambda path: path.stem)
def test_specimens_fit_their_schema(path, must_fit):
    must_fit(path, path.stem)


@pytest.mark.parametrize("name", preset_names())
def test_presets_fit_the_schema_of_ice(name, must_fit):
    import curling_env

    must_fit(Path(curling_env.__file__).parent / "presets" / f"{name}.json", "ice-1")


@pytest.mark.parametrize("name", SCHEMAS)
def test_a_broken_file_does_not_fit(name):
    schema = SCHEMAS[name]
    validator, parts = Draft202012Validator(schema), schema["$defs"]
    is_list = schema.get("type") == "array"
    roots = schema.get("anyOf") or [schema.get("items", schema)]
    tried = 0
    for document, root in zip(documents(name), roots, strict=True):
        whole = document[0] if is_list else document
        for fault in broken(whole, parts[root["$ref"].rpartition("/")[2]]):
            assert not validator.is_valid([fault] if is_list else fault), json.dumps(fault)[:300]
            tried += 1
    assert tried >= 3
    if "format" in documents(name)[0]:
        assert not validator.is_valid({**documents(name)[0], "format": "curling-broom/1"})


def test_every_released_number_is_read():
    ice = load_ice(SPECIMENS / "ice-1.json")
    assert ice.effect("curl") is not None
    assert ice.friction.is_uniform
    assert load_scene(SPECIMENS / "scene-1.json").has_corners
    assert "camera_matrix" in load_lens(SPECIMENS / "lens-1.json")
    solved = json.loads((SPECIMENS / "camera-1.json").read_text(encoding="utf-8"))
    assert camera_from(CAMERA_FORMAT.accept(solved)).measured == 540
    assert len(read_stones(SPECIMENS / "stones-1.json")[0]) > 1
    assert load_skill(SPECIMENS / "skill-1.json").name == "Ada"
    assert len(read_record(SPECIMENS / "game-1.jsonl")) == 3
    assert len(read_session(SPECIMENS / "session-1.json").tracks) == 1
    report = json.loads((SPECIMENS / "report-1.json").read_text(encoding="utf-8"))
    assert findings(report).missing[0].name == "curl"
