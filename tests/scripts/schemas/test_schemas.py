"""Published schemas: as the program has them, true of what it writes, closed to what is broken."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from jsonschema import Draft202012Validator
from schemas.catalogue import FILES, JsonFile, page

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

FOLDER = Path(__file__).parents[3] / "docs" / "schemas"
SPECIMENS = Path(__file__).parent / "specimens"
"""One file of every number of every format that was released; they are never edited."""


def name_of(file: JsonFile) -> str:
    return file.file_name.removesuffix(".schema.json")


def documents(file: JsonFile) -> list[Any]:
    """The specimen of a kind of file, line by line where its lines are documents."""
    path = SPECIMENS / f"{name_of(file)}.json{'l' * file.lines}"
    text = path.read_text(encoding="utf-8")
    return [json.loads(line) for line in (text.splitlines() if file.lines else [text])]


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


@pytest.mark.parametrize("file", FILES, ids=name_of)
def test_the_published_schema_is_what_the_program_has(file):
    published = (FOLDER / file.file_name).read_text(encoding="utf-8")
    assert published == file.text(), "run `make schemas`"
    Draft202012Validator.check_schema(json.loads(published))


def test_the_page_lists_every_schema_and_there_are_no_others():
    assert (FOLDER / "README.md").read_text(encoding="utf-8") == page(), "run `make schemas`"
    there = {path.name for path in FOLDER.glob("*.json")}
    assert {file.file_name for file in FILES} <= there
    # Schemas of earlier numbers stay; each has its specimen.
    assert {name.removesuffix(".schema.json") for name in there} == {
        path.stem for path in SPECIMENS.iterdir()
    }


@pytest.mark.parametrize("path", sorted(SPECIMENS.iterdir()), ids=lambda path: path.stem)
def test_specimens_fit_their_schema(path, must_fit):
    must_fit(path, path.stem)


@pytest.mark.parametrize("name", preset_names())
def test_presets_fit_the_schema_of_ice(name, must_fit):
    import curling_env

    must_fit(Path(curling_env.__file__).parent / "presets" / f"{name}.json", "ice-1")


@pytest.mark.parametrize("file", FILES, ids=name_of)
def test_a_broken_file_does_not_fit(file):
    schema = file.schema()
    validator, parts = Draft202012Validator(schema), schema["$defs"]
    names = [root["$ref"].rpartition("/")[2] for root in schema.get("anyOf", [])]
    if not names:
        names = [schema.get("items", schema)["$ref"].rpartition("/")[2]]
    tried = 0
    for document, name in zip(documents(file), names, strict=True):
        whole = document if file.listed is None else document[0]
        for fault in broken(whole, parts[name]):
            given = fault if file.listed is None else [fault]
            assert not validator.is_valid(given), json.dumps(fault)[:300]
            tried += 1
    assert tried >= 3
    other = "curling-broom/1"
    if file.format is not None:
        assert not validator.is_valid({**documents(file)[0], "format": other})


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
    assert findings(report).missing[0].title == "curl"
