"""`curling validate`: an ice compared with published measurements."""

from __future__ import annotations

from typing import Annotated

from typer import Argument

from curling_env.commands.options import Results, grouped
from curling_env.commands.terminal import warn_about


@grouped
def validate(
    ice: Annotated[str, Argument(metavar="[ICE]", help="Ice file or preset.")] = "standard",
    *,
    results: Results,
) -> None:
    """Compare an ice with published measurements of real ice.

    \b
    Examples:
        curling validate
        curling validate fcv1
        curling validate ice.json --json

    Simulated readings of a watch or a film are compared with measurements and coaches' tables:
    friction against speed, times, curl and turns, weights, sweeping, level of the ice, collisions.
    A row agrees if its value lies within the source's own uncertainty. See docs/validation.md.
    """
    from curling_env.ice import load_ice
    from curling_env.validation.table import as_text, compare, counts, in_words, preset_of

    known = load_ice(ice)
    found = compare(known, preset_of(ice))
    warn_about(known)
    document = {"ice": ice, "counts": counts(found), "rows": [c.as_dict() for c in found]}
    results.show(document, as_text(found), in_words(found))
