"""`curling athletes`: the bias and spread of each athlete."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from typer import Argument, Option

from agents.commands.coaching.options import BELIEVED
from curling_env.commands.options import Measured, PictureOption, SeedOption, grouped, output_to
from curling_env.commands.outputs import Writes
from curling_env.commands.terminal import print_remark, progress_bar
from curling_env.errors import InputError


@grouped
def athletes(
    tracks: Annotated[list[Path], Argument(metavar="TRACKS.csv...", help="One file per session.")],
    ice: Annotated[list[str], Option(metavar="ICE", help="Ice of all sessions, or of each.")],
    believed: Annotated[list[str] | None, BELIEVED] = None,
    output: Annotated[
        Path | None,
        output_to("DIR", "Also write athlete_errors.csv and NAME.skill.json."),
        Writes(folder=True),
    ] = None,
    picture: PictureOption = None,
    seed: SeedOption = 0,
    *,
    results: Measured,
) -> None:
    """Measure the bias and spread of each athlete's weight, line and rotation.

    \b
    Examples:
        curling athletes tracks.csv --ice ice.json --believed morning.json -o athletes
        curling athletes mon/tracks.csv fri/tracks.csv --ice mon/ice.json --ice fri/ice.json
        curling plan --ice ice.json --target 0,17.37 --skill athletes/Ada.skill.json

    All throws with a called target are used, over all sessions. Weight is in seconds from hog line
    to hog line against the call, line at the far tee line, rotation in turns. With -o,
    NAME.skill.json has each athlete's spread as an execution error, for --skill of `curling plan`,
    `play` and `tournament`; the bias is not in it. See docs/coaching.md.
    """
    from agents.coaching.athletes import athlete_errors
    from agents.coaching.in_words import athletes_in_words, athletes_rows
    from agents.coaching.misses.hand_or_ice import causes_beside
    from friction_estimation.reports.throws_section import as_text

    ices = _for_each(ice, tracks, "--ice")
    taken = _for_each(believed, tracks, "--believed") if believed else [None] * len(tracks)
    with progress_bar("throw") as progress:
        sessions = [
            causes_beside(path, ices[k], believed=taken[k], seed=seed, progress=progress)
            for k, path in enumerate(tracks)
        ]
    found = athlete_errors(sessions, seed=seed)
    for remark in dict.fromkeys(remark for one in sessions for remark in one.remarks):
        print_remark(remark)
    if not found:
        problem = (
            "no athlete has two throws with a called target that were seen from the hog line to "
            "rest; record more throws"
        )
        raise InputError(problem, source=tracks[0])
    if output is not None:
        from agents.coaching.tables import write_athletes

        for name in write_athletes(output, found, [*tracks, *ice, *(believed or [])], seed=seed):
            print_remark(f"{name}")
    if picture is not None:
        from agents.coaching.coaching_figures import draw_athletes

        draw_athletes(found, picture)
    results.show(
        [one.as_dict() for one in found],
        as_text(athletes_rows(found)),
        *athletes_in_words(found),
    )


def _for_each(given: list[str], tracks: list[Path], option: str) -> list[str]:
    """Repeat an ice that was given for all sessions."""
    if len(given) not in (1, len(tracks)):
        problem = f"expected one ice for all sessions, or one for each of the {len(tracks)}"
        raise InputError(f"{problem}, got {len(given)}", source=option)
    return given * len(tracks) if len(given) == 1 else given
