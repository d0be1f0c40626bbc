"""`curling hand-or-ice`: causes of missed throws."""

from __future__ import annotations

from typing import Annotated

from agents.commands.coaching.options import (
    BELIEVED,
    TableOption,
    TracksArgument,
    refuse_throw_list,
)
from curling_env.commands.options import IceOption, Measured, PictureOption, SeedOption, grouped
from curling_env.commands.terminal import progress_bar


@grouped
def hand_or_ice(
    tracks: TracksArgument,
    ice: IceOption,
    believed: Annotated[str | None, BELIEVED] = None,
    output: TableOption = None,
    picture: PictureOption = None,
    seed: SeedOption = 0,
    *,
    results: Measured,
) -> None:
    """Explain why throws missed: the hand's weight, line and rotation, or the ice.

    \b
    Example:
        curling estimate tracks.csv -o ice.json
        curling hand-or-ice tracks.csv --ice ice.json --believed morning.json --picture why.png

    Each throw with a called target is compared with the intended throw, which reaches the target on
    the believed ice. The miss is split into these parts, which add up to it:

    \b
        weight, line, rotation   the release, against the intended one
        misread ice              --ice against --believed, or a wrong call of broom or time
        unexplained              the rest: a hair, frost, unrecorded sweeping, an odd stone

    JSON and CSV have the standard error of each part. See docs/coaching.md.
    """
    from agents.coaching.in_words import causes_rows, session_in_words
    from agents.coaching.misses.hand_or_ice import causes_beside
    from friction_estimation.reports.throws_section import as_text

    refuse_throw_list(output, tracks)
    with progress_bar("throw") as progress:
        found = causes_beside(tracks, ice, believed=believed, seed=seed, progress=progress)
    if output is not None:
        from agents.coaching.tables import write_causes

        write_causes(output, found)
    if picture is not None:
        from agents.coaching.coaching_figures import draw_causes

        draw_causes(found, picture)
    table = [as_text(causes_rows(found))] if found.throws else []
    results.show(found.as_dict(), *table, *session_in_words(found))
