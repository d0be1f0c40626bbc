"""JSON Schemas of the files that the program reads, in docs/schemas; `make schemas` writes them.

msgspec makes them from the structs of the readers. Schemas of files that the program only writes
are edited in docs/schemas, and tests check written files against them.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from agents.benchmark.rows import ROW_FORMAT, RowDocument
from agents.planning.stones_file import MOST_STONES, StoneDocument
from agents.playing import record
from agents.playing.record_schema import DeliveryLine, HeadLine, ResultLine
from curling_env.game.skill_file import SKILL_FORMAT, SkillDocument
from curling_env.ice import ICE_FORMAT
from curling_env.ice_form import IceDocument
from curling_env.infrastructure.files.schema import FileFormat
from friction_estimation.camera.scene import SCENE_FORMAT, LensDocument, SceneDocument
from friction_estimation.donation.session import SESSION_FORMAT, SessionDocument

FOLDER = Path(__file__).parents[1] / "docs" / "schemas"
DIALECT = "https://json-schema.org/draft/2020-12/schema"
IN_PARTS = "#/$defs/"


@dataclass(frozen=True, kw_only=True)
class JsonFile:
    """A kind of JSON file that the program reads.

    Parameters
    ----------
    title : its title
    forms : what its document may be; each line has one of them in a file of JSON lines
    format : its numbered format; None if a file does not state it
    listed : the most documents of a list; None where there is one document
    """

    title: str
    forms: Sequence[type]
    format: FileFormat | None = None
    listed: int | None = None

    def schema(self, name: str) -> dict[str, Any]:
        """Return the JSON Schema that has a name, such as ``ice-1``."""
        outer, parts = msgspec.json.schema_components(
            self.forms, ref_template=f"{IN_PARTS}{{name}}"
        )
        roots = list(outer)
        if self.format is not None:
            head = parts[roots[0]["$ref"].removeprefix(IN_PARTS)]
            head["properties"]["format"] = {"const": self.format.name}
        body = roots[0] if len(roots) == 1 else {"anyOf": roots}
        if self.listed is not None:
            body = {"type": "array", "items": body, "maxItems": self.listed}
        about = {"$schema": DIALECT, "$id": f"{name}.schema.json", "title": self.title}
        return {**about, **body, "$defs": parts}


FILES = {
    "ice-1": JsonFile(title="Ice", forms=[IceDocument], format=ICE_FORMAT),
    "scene-1": JsonFile(title="Scene", forms=[SceneDocument], format=SCENE_FORMAT),
    "lens-1": JsonFile(title="Camera file (lens)", forms=[LensDocument]),
    "stones-1": JsonFile(
        title="Stones on the sheet", forms=[StoneDocument], listed=MOST_STONES
    ),
    "skill-1": JsonFile(title="Skill", forms=[SkillDocument], format=SKILL_FORMAT),
    "game-1": JsonFile(
        title="Recorded game (a line of it)",
        forms=[HeadLine, DeliveryLine, ResultLine],
        format=record.FORMAT,
    ),
    "benchmark-1": JsonFile(
        title="Row of the benchmark", forms=[RowDocument], format=ROW_FORMAT
    ),
    "session-1": JsonFile(title="Donated session", forms=[SessionDocument], format=SESSION_FORMAT),
}  # fmt: skip
"""File described by each schema."""


def main() -> None:
    for name, file in FILES.items():
        text = json.dumps(file.schema(name), indent=1, ensure_ascii=False) + "\n"
        (FOLDER / f"{name}.schema.json").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
