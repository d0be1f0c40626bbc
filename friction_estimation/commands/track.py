"""`curling track`: tracks from films."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Argument, Option

from curling_env.commands.options import OUTPUT, Measured, TracksFile, grouped
from curling_env.commands.outputs import Writes
from curling_env.commands.terminal import print_remark, progress_bar
from curling_env.errors import InputError
from curling_env.infrastructure.files.kinds import FILM_SUFFIXES
from friction_estimation.commands.film_options import SCENE, Tracking

if TYPE_CHECKING:
    from curling_env.trajectory import Trajectory
    from curling_env.typing import Progress
    from curling_env.units import Units
    from friction_estimation.camera.scene import Scene
    from friction_estimation.tracking import TrackedFilm


@grouped
def track(
    films: Annotated[list[str], Argument(metavar="VIDEO...", help="Films, or folders of films.")],
    scene: Annotated[list[Path], SCENE],
    output: TracksFile = Path("tracks.csv"),
    append: Annotated[
        bool, Option("--append", help="Append to the tracks file.", rich_help_panel=OUTPUT)
    ] = False,
    overlay: Annotated[
        Path | None,
        Option(
            metavar="OUT.mp4",
            help="Also draw the tracks into a copy of the film; further throws: OUT-1.mp4, …",
            rich_help_panel=OUTPUT,
        ),
        Writes(kinds=("made film",), suffixes=FILM_SUFFIXES),
    ] = None,
    *,
    tracking: Tracking,
    results: Measured,
) -> None:
    """Track the thrown stone through films: from video to positions in metres.

    \b
    Examples:
        curling track practice.mp4 --scene end.scene.json -o tracks.csv
        curling track end-0.mp4 end-1.mp4 --scene end.scene.json -o tracks.csv
        curling track end-0.mp4 --scene end.scene.json --overlay seen.mp4

    A film may show one throw or a whole practice, which is cut into its throws. The paint on the
    ice corrects the marks of the scene and measures an unknown lens. The camera is solved once and
    stored next to the scene. If tracking is interrupted, repeat the command: it continues.

    The tracks file has a row for each frame in which a stone was seen. `curling throws` shows the
    throws, `curling live` tracks a running camera, and `curling join-cameras` joins films of one
    throw. See docs/tracking.md and docs/files.md.
    """
    from curling_env.infrastructure.files.writing import note_rewritten, together
    from curling_env.trajectory import read_tracks, write_tracks
    from friction_estimation.film.video import films_in
    from friction_estimation.tracking.films.resume import Checkpoints
    from friction_estimation.tracks.plausible_friction import friction_question, rough_friction
    from friction_estimation.tracks.throw_list import ThrowNote, throws_beside

    within = [films_in([film]) for film in films]
    paths = [path for some in within for path in some]
    scenes = tracking.scenes(scene)
    if len(scenes) == len(films):
        scenes = [one for one, some in zip(scenes, within, strict=True) for _ in some]
    if overlay is not None and len(paths) > 1:
        raise InputError("--overlay works on one film at a time", source="--overlay")
    earlier: list[Trajectory] = []
    if append and output.exists():
        note_rewritten(output)
        earlier = read_tracks(output)
    throws_beside(output)  # a table that cannot be read is refused before the work
    first = 1 + max((track.throw for track in earlier), default=-1)
    tracks: list[Trajectory] = [*earlier]
    tracked: list[tuple[int, TrackedFilm]] = []
    always = 0 if overlay is None else sys.maxsize
    with together(), progress_bar("frame") as bar:
        for one in tracking.throws_in(paths, scenes, output, always_track=always, progress=bar):
            asked = friction_question(rough_friction(one.thrown))
            if asked is not None:
                print_remark(f"{one.name}: {asked}")
                one = replace(one, summary={**one.summary, "question": asked})
            if overlay is not None:
                _draw(one, scenes[0], overlay, results.units, bar)
            tracked.append((first + one.thrown.throw, one))
            tracks += [replace(track, throw=first + track.throw) for track in one.tracks]
        write_tracks(output, tracks)
    Checkpoints(output).delete()
    noted = throws_beside(output)
    done = f"{len(tracked)} throw{'s' * (len(tracked) != 1)}"
    done += f" added to {output}" if earlier else f": {output}"
    results.show(
        [
            {
                "film": str(one.film),
                "throw": throw,
                **one.summary,
                **noted.get(throw, ThrowNote()).row,
            }
            for throw, one in tracked
        ],
        f"{done}; `curling throws {output}` shows the throws",
    )


def _draw(one: TrackedFilm, scene: Scene, overlay: Path, units: Units, progress: Progress) -> None:
    """Draw a throw into a copy of its film.

    Raises
    ------
    InputError : a tracker that returns tracks alone
    """
    from curling_env.infrastructure.files.writing import check_writable, fitted
    from friction_estimation.tracking.overlay.film import write_overlay

    if one.found is None:
        problem = "cannot draw: this tracker returns tracks only"
        raise InputError(problem, source="--overlay")
    number = one.thrown.throw
    numbered = fitted(overlay.stem, f"-{number}{overlay.suffix}")
    drawn = overlay.with_name(numbered) if number else overlay
    check_writable(drawn, kinds=("made film",))
    if number and drawn.exists():
        print_remark(f"{drawn}: the earlier file of this name was replaced")
    write_overlay(one.shown or one.film, scene, one.found, drawn, units=units, progress=progress)
