"""Long work on many films goes on where it was interrupted.

Each film's track is kept, as soon as it is there, in a folder beside the output; with it lies what
it was made from. The next call with the same films and choices takes what is there, and the folder
goes when all is done.
"""

from __future__ import annotations

import hashlib
import json
import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from curling_env.errors import InputError
from curling_env.storage import make_directory, read_json, write_json
from curling_env.trajectory import Trajectory, read_tracks, write_tracks

SUFFIX = ".unfinished"


class Unfinished:
    """Tracks that were made before an interruption.

    Parameters
    ----------
    output : the file that will hold all tracks
    choices : everything that decides a track besides the film itself, for JSON
    """

    def __init__(self, output: Path, choices: Mapping[str, Any]) -> None:
        self.folder = output.with_name(output.name + SUFFIX)
        self._choices = dict(choices)

    def recall(self, throw: int, film: Path) -> tuple[list[Trajectory], dict[str, Any]] | None:
        """The tracks of a film and what was said of it, where they were kept."""
        try:
            note = read_json(self._note(throw))
            tracks = read_tracks(self._track(throw))
        except InputError:
            return None
        if not isinstance(note, dict) or note.get("key") != self._key(throw, film):
            return None
        return tracks, note["about"]

    def keep(
        self, throw: int, film: Path, tracks: Sequence[Trajectory], about: Mapping[str, Any]
    ) -> None:
        """Keep a film's tracks, and what is to be said of it."""
        make_directory(self.folder)
        write_tracks(self._track(throw), tracks)
        write_json(self._note(throw), {"key": self._key(throw, film), "about": dict(about)})

    def done(self) -> None:
        """All is written where it belongs: what was kept can go."""
        shutil.rmtree(self.folder, ignore_errors=True)

    def _key(self, throw: int, film: Path) -> str:
        """A digest of all that the track was made from; a film that changed is another."""
        stat = film.stat() if film.exists() else None
        made_from = {
            **self._choices,
            "throw": throw,
            "film": str(film.resolve()),
            "size": None if stat is None else stat.st_size,
            "changed": None if stat is None else stat.st_mtime_ns,
        }
        text = json.dumps(made_from, sort_keys=True, default=str)
        return hashlib.sha256(text.encode()).hexdigest()

    def _track(self, throw: int) -> Path:
        return self.folder / f"throw-{throw:03d}.csv"

    def _note(self, throw: int) -> Path:
        return self.folder / f"throw-{throw:03d}.json"
