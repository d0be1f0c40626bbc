"""File of an athlete's execution error (JSON)."""

from __future__ import annotations

import os
from dataclasses import asdict
from math import inf
from pathlib import Path
from typing import Annotated, Any

import msgspec

from curling_env.errors import InputError, placed
from curling_env.infrastructure.files.reading import read_json
from curling_env.infrastructure.files.schema import Document, FileFormat, Short, checked, within
from curling_env.infrastructure.files.storage import write_json
from curling_env.throw import MIN_TAILS, SKILLS, Skill

SKILL_FORMAT = FileFormat(name="curling-skill/1", what="a skill file")


class SkillDocument(Document):
    """Skill file."""

    format: Short
    name: Short
    sigma_speed: Annotated[float, within(0.0, 2.0, "m/s")]
    sigma_angle: Annotated[float, within(0.0, 1.0, "rad")]
    sigma_spin: Annotated[float, within(0.0, 20.0, "rad/s")] = 0.0
    tails: Annotated[float, within(MIN_TAILS, 1e6)] | None = None
    correlation: Annotated[float, within(-1.0, 1.0)] = 0.0
    source: str = ""
    provenance: dict[str, Any] = msgspec.field(default_factory=dict[str, Any])


def load_skill(source: str | Path | Skill) -> Skill:
    """Load a skill by its name, or from a file written by `curling athletes`.

    Parameters
    ----------
    source : a name in `SKILLS`, the path of a skill file, or a `Skill`, which is returned unchanged

    Raises
    ------
    InputError : neither a name nor a file, or a file that does not describe a skill
    """
    if isinstance(source, Skill):
        return source
    if str(source) in SKILLS:
        return SKILLS[str(source)]
    # Callers from Python may pass anything.
    a_path = isinstance(source, str | Path)  # pyright: ignore[reportUnnecessaryIsInstance]
    if not (a_path and os.path.exists(source)):  # accepts any name, unlike a Path's
        raise InputError(
            f"unknown skill {str(source)[:80]!r}; expected a skill file or one of "
            f"{', '.join(SKILLS)}"
        )
    document = read_json(source)
    with placed(source=source):
        skill = checked(SKILL_FORMAT.accept(document), SkillDocument)
        fields: dict[str, Any] = msgspec.structs.asdict(skill)
        del fields["format"], fields["provenance"]
        if skill.tails is None:
            del fields["tails"]
        return Skill(**fields)


def save_skill(skill: Skill, path: str | Path, *, provenance: dict[str, Any] | None = None) -> None:
    """Write a skill file, completely or not at all.

    Parameters
    ----------
    skill : an athlete's execution error
    path : file to write
    provenance : its provenance
    """
    document = {"format": SKILL_FORMAT.name, **asdict(skill)}
    if skill.tails == inf:
        del document["tails"]  # JSON has no infinity
    if not skill.correlation:
        del document["correlation"]
    write_json(path, document | ({"provenance": provenance} if provenance else {}))
