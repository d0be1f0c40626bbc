"""`curling donate`: a measured session in one file, without film and without names."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from agents.commands.coaching.options import TracksArgument
from curling_env.commands.cli import JsonOption, OutputFile, conclude, say


def donate(
    tracks: TracksArgument,
    scene: Annotated[
        Path, typer.Option(metavar="SCENE.json", help="The scene with which they were tracked.")
    ],
    consent: Annotated[
        str,
        typer.Option(
            metavar="TEXT",
            help="Who agrees to what, in a sentence or two without names: it is in the file.",
        ),
    ],
    output: OutputFile = Path("session.json"),
    as_json: JsonOption = False,
) -> None:
    """Pack a measured session into one file that may be given away.

    Measurements of real ice are few, and no table of a real stone's path is public. The file has
    the tracks, the scene, and of each throw what throws.csv and athletes.csv beside the tracks say
    of it without telling who threw: athletes become numbers, with their hands; stones become
    numbers; called shots are kept where they have words of calls alone; notes stay at home, and so
    do file names and the time of day. No picture goes in. A consent that names one of the athletes
    is refused. The same session gives the same bytes.

    The file is given under CC0: anybody may use it for anything. Ask everybody who threw first. It
    is one JSON document (docs/files.md); `curling convert session.json -o tracks.csv` takes the
    tracks out again.

    \b
    Example:
        curling donate tracks.csv --scene scene.json -o session.json \\
            --consent "All who threw, and the club, agree to publication without names."
    """
    from agents.coaching.throw_sheet import hands_beside
    from curling_env.errors import InputError
    from friction_estimation.camera.scene import load_scene
    from friction_estimation.donation import Session, write_session
    from friction_estimation.donation.names import refuse_names, without_names
    from friction_estimation.tracks.throw_list import load_tracks, throws_beside

    notes, hands = throws_beside(tracks), hands_beside(tracks)
    refuse_names(consent, {*hands, *(note.athlete for note in notes.values())} - {""})
    throws, left_out = without_names(notes, hands)
    seen = load_scene(scene)
    paths = load_tracks(tracks)
    try:
        session = Session(consent=consent, scene=seen, tracks=paths, throws=throws)
    except InputError as error:
        about = "--consent" if "consent" in error.problem else tracks
        raise InputError(error.problem, source=about) from error
    write_session(session, output)
    if left_out:
        say(f"{left_out} called shots have other words than calls have, and were left out")
    athletes = {thrown.athlete for thrown in throws} - {None}
    number = len({track.throw for track in paths})
    rows = sum(map(len, paths))
    conclude(
        {
            "written": str(output),
            "throws": number,
            "rows": rows,
            "athletes": len(athletes),
            "called_left_out": left_out,
        },
        f"{number} throws of {len(athletes) or 'unnamed'} athletes, {rows} rows: {output}; "
        "look into it before you give it away",
        as_json=as_json,
    )
