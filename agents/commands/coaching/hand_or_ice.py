"""`curling hand-or-ice`: why throws missed."""

from __future__ import annotations

from typing import Annotated

from agents.commands.coaching.options import (
    BELIEVED,
    TableOption,
    TracksArgument,
    causes_of,
    refuse_throw_list,
)
from curling_env.commands.options import (
    IceOption,
    Measured,
    PictureOption,
    SeedOption,
    grouped,
)
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

    Each throw with a called target (`called` in throws.csv, such as "draw 0.3,-1.2 in") is compared
    with the one that was meant, which does what was called on the believed ice. The miss is split
    into these parts, which add up to it; JSON and CSV have their standard errors:

    \b
        weight, line, rotation   the release, against the one that was meant
        ice read wrong           this session's ice (--ice), against the one planned with
                                 (--believed), or a broom or time called too much
        unexplained              the rest: a hair, frost, unnoted sweeping, an odd stone

    A hit is judged where it crosses the line of its target. See docs/coaching.md.
    """
    from agents.coaching.in_words import causes_rows, session_in_words
    from friction_estimation.reports.throws_section import as_text

    refuse_throw_list(output, tracks)
    with progress_bar("throw") as progress:
        found = causes_of(tracks, ice, believed, seed, progress)
    if output is not None:
        from agents.coaching.tables import write_causes

        write_causes(output, found)
    if picture is not None:
        from agents.coaching.figures.hand_or_ice_figure import draw_causes

        draw_causes(found, picture, results.units)
    table = [as_text(causes_rows(found, results.units))] if found.throws else []
    results.show(found.as_dict(), *table, *session_in_words(found, results.units))
