"""Sessions from files that are there, such as those of `curling demo`, and a made-up evening."""

from __future__ import annotations

import os
import re
import shutil
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from datetime import date, timedelta
from itertools import groupby
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

from agents.app.club import Camera, Club, Film, Session
from agents.app.club.club import ICE, TRACKS, named_row, plain
from agents.app.club.films import added_film, film_in, marks_of
from agents.app.club.records import Hand, State
from agents.app.club.session_files import Part, finish_files, note_change, save_part, write_files
from agents.app.work.jobs import submit
from agents.coaching.throw_sheet import hands_beside
from curling_env.errors import InputError
from curling_env.ice import load_ice, save_ice
from curling_env.infrastructure.files.writing import atomic_path, make_directory
from curling_env.infrastructure.provenance import sha256_of
from curling_env.trajectory import Trajectory, read_tracks
from curling_env.typing import Progress, no_progress
from friction_estimation.camera.scene import load_scene, save_scene
from friction_estimation.tracks.throw_list import ThrowNote, throws_beside

FILM_OF_THROW = re.compile(r".*-(\d{1,5})\.mp4")
"""Films of one throw each are named for its number, as `curling film` and `curling demo` do."""


class Found(NamedTuple):
    """Files of a session found in a folder."""

    throws: Mapping[int, Sequence[Trajectory]]
    """The tracks of each throw by its number, the thrown stone's first."""
    notes: Mapping[int, ThrowNote]
    hands: Mapping[str, str]
    films: Mapping[int, Path]
    """By the number of the throw that they show."""
    scene: Path | None
    ice: Path | None


def look_through(folder: Path) -> Found:
    """Find the tracks of a session in a folder, and what else is there.

    Raises
    ------
    InputError : there are no tracks, or a file that cannot be read
    """
    tracks = folder / TRACKS
    if not tracks.is_file():
        raise InputError(f"has no {TRACKS}; expected the output of `curling track`", source=folder)
    scenes = sorted((folder / "films").glob("*.scene.json"))
    scene = scenes[0] if len(scenes) == 1 else None
    ice = folder / ICE
    if scene is not None:
        load_scene(scene)
    if ice.exists():
        load_ice(ice)
    named = ((FILM_OF_THROW.fullmatch(k.name), k) for k in sorted((folder / "films").glob("*.mp4")))
    return Found(
        throws={
            number: list(group)
            for number, group in groupby(read_tracks(tracks), key=lambda track: track.throw)
        },
        notes=throws_beside(tracks),
        hands=hands_beside(tracks),
        films={int(match[1]): path for match, path in named if match and scene is not None},
        scene=scene,
        ice=ice if ice.exists() else None,
    )


def take_in(club: Club, folder: Path, *, name: str, day: str, sheet: str) -> Session:
    """A new session from the files of a folder, which stay as they are."""
    return fill_from(club, begin_from(club, folder, name=name, day=day, sheet=sheet), folder)


def begin_from(club: Club, folder: Path, *, name: str, day: str, sheet: str) -> Session:
    """A new session that `fill_from` fills; the folder counts as taken in from now on."""
    look_through(folder)
    session = club.add_session(name, day, sheet, None)
    club.keep_setting(_mark(folder), str(session.id))
    return session


def fill_from(club: Club, session: Session, folder: Path) -> Session:
    """Fill a session with what a folder holds; one that was filled in part is filled up."""
    found = look_through(folder)
    if found.scene is not None and session.camera_id is None:
        camera = _camera(club, found.scene)
        club.change("session", session.id, camera_id=camera.id)
        session = club.session(session.id) or session
    shown: dict[int, int] = {}
    without = [number for number in found.throws if number not in found.films]
    alone = [found.throws[number] for number in without]
    if alone:
        nothing = [[None] * len(tracks) for tracks in alone]
        save_part(club, session, None, Part(throws=alone, handles=nothing))
    for number, tracks in found.throws.items():
        if number in found.films:
            film = add_film(club, session, found.films[number], clock=tracks[0].clock)
            # Times of a film count from its first frame.
            part = [replace(track, clock=0.0, throw=0) for track in tracks]
            save_part(club, session, film, Part(throws=[part], handles=[[None] * len(part)]))
            shown[film.id] = number
    write_files(club, session)
    before = {
        one.number: without[one.part] if one.film_id is None else shown[one.film_id]
        for one in club.throws(session)
    }
    _note(club, session, found, before)
    finish_files(club)
    if found.ice is not None:
        save_ice(load_ice(found.ice), club.ice_of(session))
    return session


def is_in(club: Club, folder: Path) -> bool:
    """Return whether a folder's tracks were imported before, into a session that still exists."""
    session = club.setting(_mark(folder))
    return bool(session) and club.session(int(session)) is not None


def _mark(folder: Path) -> str:
    return f"taken in: {sha256_of(folder / TRACKS)}"


def add_film(club: Club, session: Session, path: Path, *, clock: float | None = None) -> Film:
    """A film that was tracked already, with its file in the club folder; added once."""
    folder = make_directory(club.folder_of(session) / "films")
    target = folder / path.name
    with suppress(OSError):  # a film that many sessions share is kept once where the disk can
        os.link(path, target)
    if not target.exists():
        with atomic_path(target) as draft:
            shutil.copyfile(path, draft)
    size, file = target.stat().st_size, club.name_of(target)
    marks = marks_of(club, club.camera(session.camera_id))
    with club.database.writing() as connection:
        known = film_in(connection, session, file=file)
        if known is not None:
            return known
        about = {"state": State.DONE, "clock": clock, "marks": marks}
        return added_film(connection, session, path.name, size, file=file, received=size, **about)


def _camera(club: Club, scene: Path) -> Camera:
    """Return the club's camera with this scene, which is added if missing."""
    seen, name = load_scene(scene), scene.name.removesuffix(".scene.json")
    for camera in club.cameras():
        if camera.scene is not None and camera.name.partition(" (")[0] == name:
            known = load_scene(club.path(camera.scene))
            if (known.points_px.shape == seen.points_px.shape) and (
                known.points_px == seen.points_px
            ).all():
                return camera
    taken = {camera.name for camera in club.cameras()}
    free = next(k for k in (name, *(f"{name} ({i})" for i in range(2, 1000))) if k not in taken)
    file = f"cameras/{plain(free)}.scene.json"
    save_scene(seen, club.path(file))
    length, width = seen.sheet.length, seen.sheet.width
    return club.add(Camera, name=free, length=length, width=width, scene=file)


def _note(club: Club, session: Session, found: Found, before: Mapping[int, int]) -> None:
    """Enter the notes beside the tracks, and overwrite nothing that was entered here.

    Parameters
    ----------
    before : numbers of the throws in the folder, by their numbers in the session
    """
    with club.database.writing() as connection:
        for number, old in before.items():
            note = found.notes.get(old, ThrowNote())
            hand = Hand(found.hands.get(note.athlete, "right"))
            athlete = named_row(connection, "athlete", note.athlete, hand=hand)
            stone = named_row(connection, "stone", note.stone)
            connection.execute(
                "update throw set athlete_id = ?, stone_id = ?, called = ?, note = ? "
                "where session_id = ? and number = ? "
                "and athlete_id is null and stone_id is null and called = '' and note = ''",
                (athlete, stone, note.called, note.note, session.id, number),
            )
        note_change(connection, "id = ?", session.id)


NAME, BEFORE, SHEET = "A made-up evening", "The week before", "Sheet 2"


def begin_evening(club: Club, day: str) -> Session | None:
    """The session of the made-up evening, still empty; None where the club has one.

    Parameters
    ----------
    day : of the evening, as ``2026-11-22``
    """
    if any(session.name == NAME for session in club.sessions()):
        return None
    return club.add_session(NAME, day, SHEET, None)


def fill_evening(
    club: Club, session: Session, *, seed: int = 0, progress: Progress = no_progress
) -> Session:
    """Fill a session with the made-up evening; one that was filled in part is filled up.

    Parameters
    ----------
    session : of the evening
    seed, progress : see `write_evening`
    """
    from agents.closed_loop.made_up_evening import write_evening  # it loads what renders films

    with TemporaryDirectory() as made:
        believed = write_evening(Path(made), seed=seed, progress=progress)
        fill_from(club, session, Path(made))
    day = (date.fromisoformat(session.day) - timedelta(days=7)).isoformat()
    if not any(one.name == BEFORE and one.day == day for one in club.sessions()):
        before = club.add_session(BEFORE, day, SHEET, None)
        save_ice(believed, club.ice_of(before))  # what the team takes it for
    return session


def begin_sessions(
    club: Club, folders: Sequence[Path], *, demo: bool, remark: Callable[[str], object]
) -> None:
    """Begin sessions from folders, and a made-up evening; both are filled while the app runs.

    Parameters
    ----------
    club : the club
    folders : folders with tracks; one that the club has already is skipped, with a remark
    demo : also begin a made-up evening
    remark : called with what the person at the terminal should know
    """
    today = date.today().isoformat()
    for folder in folders:
        if is_in(club, folder):
            remark(f"{folder}: is in this club already")
            continue
        session = begin_from(club, folder, name=folder.resolve().name, day=today, sheet="")
        submit(club, "import", session, str(folder.resolve()))
    evening = begin_evening(club, today) if demo else None
    if evening is not None:
        submit(club, "make up", evening)
