"""`curling donate`: a measured session in one file, without film and without names."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from typer import Option

from agents.commands.coaching.options import TracksArgument
from curling_env.commands.options import OutputFile, Results, grouped
from curling_env.commands.terminal import print_remark


@grouped
def donate(
    tracks: TracksArgument,
    scene: Annotated[Path, Option(metavar="SCENE.json", help="The scene of the tracks.")],
    consent: Annotated[str, Option(metavar="TEXT", help="Consent of all throwers, without names.")],
    output: OutputFile = Path("session.json"),
    *,
    results: Results,
) -> None:
    """Pack a measured session into one file that may be published.

    \b
    Example:
        curling donate tracks.csv --scene scene.json -o session.json \\
            --consent "All throwers and the club agree to publication without names."

    The file has the tracks, the scene, and the entries of throws.csv and athletes.csv without
    names: athletes and stones become numbers; notes, file names, the time of day and pictures are
    excluded. A consent that names an athlete is refused. The file is published under CC0: anyone
    may use it for anything. `curling convert` extracts the tracks. See docs/files.md.
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
        print_remark(
            f"{left_out} called shots that are not in the vocabulary of calls were dropped"
        )
    athletes = len({thrown.athlete for thrown in throws} - {None})
    number = len({track.throw for track in paths})
    rows = sum(map(len, paths))
    results.show(
        {
            "written": str(output),
            "throws": number,
            "rows": rows,
            "athletes": athletes,
            "called_left_out": left_out,
        },
        f"{number} throws by {athletes or 'unnamed'} athletes, {rows} rows: {output}; check it "
        "before you publish it",
    )
