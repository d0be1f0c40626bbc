"""`curling validate`: an ice beside published measurements."""

from __future__ import annotations

from typing import Annotated

import typer

from curling_env.commands.cli import JsonOption, conclude, say_what_is_lacking


def validate(
    ice: Annotated[
        str, typer.Argument(metavar="[ICE]", help="An ice file, or the name of a preset.")
    ] = "standard",
    as_json: JsonOption = False,
) -> None:
    """Hold an ice against what has been published about real ice.

    Stones are thrown along the centre line, and what a watch or a film would show of them is set
    beside measurements and coaches' tables: friction against speed, times, curl and turns, weights,
    sweeping, the level of the ice, collisions. A row agrees where the value lies within the
    source's own uncertainty. docs/validation.md tells of each row, its source, and where sources
    disagree. For programs (--json, or where stdout is no terminal):

    \b
        ice      what was given
        counts   number of rows by verdict
        rows     part, name, unit, published (in the source's words), low, high, value,
                 verdict (agrees, explained, differs, not computed, not measured),
                 why (it differs), about (what the source leaves open), source

    \b
    Examples:
        curling validate
        curling validate fcv1
        curling validate ice.json --json
    """
    from curling_env.ice import load_ice
    from curling_env.validation.table import as_text, compare, counts, in_words, preset_of

    known = load_ice(ice)
    found = compare(known, preset_of(ice))
    say_what_is_lacking(known)
    document = {"ice": ice, "counts": counts(found), "rows": [c.as_dict() for c in found]}
    conclude(document, as_text(found), in_words(found), as_json=as_json)
