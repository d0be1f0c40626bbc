"""Every JSON format of the project, with the form that its files have."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import msgspec

from agents.closed_loop.demo import FINDINGS_FORMAT
from agents.learning.evaluation import EVALUATION_FORMAT
from agents.planning.stones_file import MOST_STONES, StoneDocument
from agents.playing import record
from agents.playing.record_schema import DeliveryLine, HeadLine, ResultLine
from curling_env.game.skill_file import SKILL_FORMAT, SkillDocument
from curling_env.ice import ICE_FORMAT
from curling_env.ice_form import IceDocument
from curling_env.infrastructure.files.schema import FileFormat
from friction_estimation.camera.scene import SCENE_FORMAT, LensDocument, SceneDocument
from friction_estimation.discovery.report import REPORT_FORMAT
from friction_estimation.donation.session import SESSION_FORMAT, SessionDocument
from friction_estimation.reports.estimate_page import SUMMARY_FORMAT
from friction_estimation.synthetic.films import TRUTH_FORMAT
from friction_estimation.tracking.films import shared_cameras
from schemas import written

IN_PARTS = "#/$defs/"
DIALECT = "https://json-schema.org/draft/2020-12/schema"


@dataclass(frozen=True, kw_only=True)
class JsonFile:
    """A kind of JSON file.

    Parameters
    ----------
    title : what it is called
    written_by : the command that writes it, or who else does
    forms : what its document may be; each line has one of them in a file of JSON lines
    format : its numbered format; None where a file does not say it
    name : its name, where it has no numbered format
    lines : whether every line is a document
    listed : the most documents of a list; None where there is one document
    """

    title: str
    written_by: str
    forms: Sequence[type]
    format: FileFormat | None = None
    name: str = ""
    lines: bool = False
    listed: int | None = None

    @property
    def file_name(self) -> str:
        """Name of the schema's file, with the number of the format."""
        label = self.format.name.removeprefix("curling-") if self.format else f"{self.name}/1"
        return f"{label.replace('/', '-')}.schema.json"

    def schema(self) -> dict[str, Any]:
        """The JSON Schema."""
        outer, parts = msgspec.json.schema_components(
            self.forms, ref_template=f"{IN_PARTS}{{name}}"
        )
        roots = list(outer)
        if self.format is not None:
            said = parts[roots[0]["$ref"].removeprefix(IN_PARTS)]
            said["properties"]["format"] = {"const": self.format.name}
            if not self.format.numbered:
                said["required"] = [n for n in said["required"] if n != "format"]
        body = roots[0] if len(roots) == 1 else {"anyOf": roots}
        if self.listed is not None:
            body = {"type": "array", "items": body, "maxItems": self.listed}
        return {
            "$schema": DIALECT,
            "$id": self.file_name,
            "title": self.title,
            **body,
            "$defs": parts,
        }

    def text(self) -> str:
        """The JSON Schema as its file has it."""
        return json.dumps(self.schema(), indent=1, ensure_ascii=False) + "\n"


FILES = (
    JsonFile(
        title="Ice",
        written_by="`curling estimate`, `discover`, `save_ice`",
        forms=[IceDocument],
        format=ICE_FORMAT,
    ),
    JsonFile(
        title="Scene",
        written_by="`curling corners`, `locate`, `film`, or by hand",
        forms=[SceneDocument],
        format=SCENE_FORMAT,
    ),
    JsonFile(
        title="Camera file (lens)",
        written_by="`curling calibrate`",
        forms=[LensDocument],
        name="lens",
    ),
    JsonFile(
        title="Solved camera",
        written_by="`curling track`, `estimate`",
        forms=[written.SolvedCamera],
        format=shared_cameras.FORMAT,
    ),
    JsonFile(
        title="Stones on the sheet",
        written_by="`curling stones`, or by hand",
        forms=[StoneDocument],
        name="stones",
        listed=MOST_STONES,
    ),
    JsonFile(
        title="Skill",
        written_by="`curling athletes`",
        forms=[SkillDocument],
        format=SKILL_FORMAT,
    ),
    JsonFile(
        title="Recorded game (a line of it)",
        written_by="`curling play`, `tournament`",
        forms=[HeadLine, DeliveryLine, ResultLine],
        format=record.FORMAT,
        lines=True,
    ),
    JsonFile(
        title="Donated session",
        written_by="`curling donate`",
        forms=[SessionDocument],
        format=SESSION_FORMAT,
    ),
    JsonFile(
        title="Report of a discovery",
        written_by="`curling discover`",
        forms=[written.Report],
        format=REPORT_FORMAT,
    ),
    JsonFile(
        title="Numbers of an estimate",
        written_by="`curling estimate --report`",
        forms=[written.Estimate],
        format=SUMMARY_FORMAT,
    ),
    JsonFile(
        title="Truth of a rendered film",
        written_by="`curling film`",
        forms=[written.Truth],
        format=TRUTH_FORMAT,
    ),
    JsonFile(
        title="Findings of the demo",
        written_by="`curling demo`",
        forms=[written.Findings],
        format=FINDINGS_FORMAT,
    ),
    JsonFile(
        title="Evaluation of an agent",
        written_by="`curling train`",
        forms=[written.Evaluation],
        format=EVALUATION_FORMAT,
    ),
)


def page() -> str:
    """The list of the schemas, as docs/schemas/README.md has it."""
    rows = [
        f"| {file.title} | {f'`{file.format.name}`' if file.format else '—'} | {file.written_by} "
        f"| [{file.file_name}]({file.file_name}) |"
        for file in FILES
    ]
    return PAGE.format(rows="\n".join(rows))


PAGE = """\
# JSON Schemas

Every JSON file of the project, described for other programs in
[JSON Schema](https://json-schema.org/), draft 2020-12. What the entries mean is told in
[files](../files.md), and how formats change in [versions](../versioning.md).

| File | Format | Written by | Schema |
|---|---|---|---|
{rows}

In a recorded game every line is a document: the first says who plays what where, one follows for
every delivery, and the last is the result. Numbers have bounds far beyond what is measured; the
`description` of a number is its unit. A schema says less than the program knows: that the rows of a
map fit its sheet, or that times increase, is checked by whoever reads the file.

To check a file in Python, with the package `jsonschema`:

```python
import json
from pathlib import Path

import jsonschema

schema = json.loads(Path("docs/schemas/ice-1.schema.json").read_text())
ice = json.loads(Path("curling_env/presets/standard.json").read_text())
jsonschema.validate(ice, schema)  # says nothing if it fits
```

Generated by `make schemas` from the forms with which the program checks what it reads. Tests hold
the files that it writes to them.
"""
