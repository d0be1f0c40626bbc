"""`curling match-stones`: stones that run and curl alike."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from agents.commands.coaching.options import TracksArgument
from curling_env.commands.options import (
    IceOption,
    Measured,
    PictureOption,
    SeedOption,
    grouped,
    output_to,
)
from curling_env.commands.outputs import Writes
from curling_env.commands.terminal import progress_bar


@grouped
def match_stones(
    tracks: TracksArgument,
    ice: IceOption,
    output: Annotated[
        Path | None,
        output_to("ICE.json", "Also write the ice with every stone's friction and curl."),
        Writes(kinds=("ice",)),
    ] = None,
    picture: PictureOption = None,
    seed: SeedOption = 0,
    *,
    results: Measured,
) -> None:
    """Find stones that run or curl unlike their set, and suggest pairs.

    \b
    Example:
        curling match-stones tracks.csv --ice ice.json --picture stones.png

    The stone of each throw is in throws.csv beside the tracks (column `stone`), or in the tracks
    themselves. Friction and curl are compared with the mean of the set, with 95 % intervals, and
    pairs of stones that run alike are suggested. Stones that cannot be distinguished yet are
    listed, with the number of throws needed. Throw the stones in turn: steady changes of the ice
    and differences between the ends then cancel out. See docs/coaching.md.
    """
    from agents.coaching.in_words import stones_in_words, stones_rows
    from agents.coaching.stones import match_stones as match
    from curling_env.ice import load_ice, save_ice
    from curling_env.infrastructure.provenance import provenance
    from friction_estimation.reports.throws_section import as_text
    from friction_estimation.tracks.throw_list import load_tracks, throws_beside

    known, measured, notes = load_ice(ice), load_tracks(tracks), throws_beside(tracks)
    with progress_bar("throw") as progress:
        found = match(measured, known, notes, seed=seed, progress=progress)
    if output is not None:
        save_ice(found.on(known), output, provenance=provenance([tracks, ice], seed=seed))
    if picture is not None:
        from agents.coaching.coaching_figures import draw_stones

        draw_stones(found, picture)
    results.show(
        found.as_dict(),
        as_text(stones_rows(found)),
        *stones_in_words(found),
    )
