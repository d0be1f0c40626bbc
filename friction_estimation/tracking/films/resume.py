"""Resuming of interrupted work on many films.

The tracks of each throw are kept in a folder beside the output, under a digest of their inputs. The
next call with the same film and options reads them, to the last bit, instead of tracking that throw
again; a call with others ignores them. The folder is deleted when the output has been written.
"""

from __future__ import annotations

import hashlib
import importlib.metadata
import json
import os
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from curling_env.infrastructure.files.reading import read_arrays
from curling_env.infrastructure.files.storage import write_arrays
from curling_env.infrastructure.files.writing import (
    at_once,
    fitted,
    keep,
    make_directory,
    note_rewritten,
)
from curling_env.infrastructure.provenance import command_name, sha256_of
from curling_env.trajectory import Trajectory
from friction_estimation.film.video import TIMES_SUFFIX

SUFFIX = ".unfinished"
"""Suffix of the folder of checkpoints, added to the name of the output."""


class Checkpoints:
    """Kept tracks of an interrupted call, and of this one.

    Parameters
    ----------
    output : the file that will hold the result of all films
    """

    def __init__(self, output: Path) -> None:
        self.folder = output.with_name(fitted(output.name, SUFFIX))

    def load(self, key: str) -> tuple[list[Trajectory], dict[str, Any]] | None:
        """Load the tracks of a throw and their summary; None if they were not kept.

        Parameters
        ----------
        key : what the tracks must have been made from, see `digest`
        """
        note_rewritten(self._file(key))  # a damaged one is made again
        try:
            kept = read_arrays(self._file(key))
            note = json.loads(str(kept["note"]))
            if note["key"] != key:
                return None
            tracks = [
                Trajectory(**{name: kept[f"{k}_{name}"] for name in _ARRAYS}, **labels)
                for k, labels in enumerate(note["tracks"])
            ]
        except (AttributeError, KeyError, TypeError, ValueError, RecursionError):
            return None
        self._report()
        return tracks, note["summary"]

    def save(self, key: str, tracks: Sequence[Trajectory], summary: Mapping[str, Any]) -> None:
        """Keep the tracks of a throw and a summary of them, for JSON."""
        make_directory(self.folder)
        labels = [{name: getattr(track, name) for name in _LABELS} for track in tracks]
        note = json.dumps({"key": key, "tracks": labels, "summary": dict(summary)})
        arrays = {
            f"{k}_{name}": getattr(track, name)
            for k, track in enumerate(tracks)
            for name in _ARRAYS
        }
        with at_once():
            write_arrays(self._file(key), {"note": np.array(note), **arrays})
        self._report()

    def delete(self) -> None:
        """Delete all kept tracks, once the output is written."""
        for kept in self.folder.glob("film-*.npz"):
            with suppress(OSError):
                kept.unlink()
        with suppress(OSError):
            self.folder.rmdir()  # refuses a folder that holds anything else

    def _file(self, key: str) -> Path:
        return self.folder / f"film-{key[:24]}.npz"

    def _report(self) -> None:
        keep(f"what was tracked is kept in {self.folder}; repeat the command to continue")


_LABELS = ("throw", "stone", "clock")
_ARRAYS = tuple(field.name for field in fields(Trajectory) if field.name not in _LABELS)


def digest(film: Path, **choices: Any) -> str:
    """Return a digest of a film and everything else that determines its tracks.

    Parameters
    ----------
    film : its path, size and time of change count, and the content of a table of times beside it;
        so does the command that runs
    choices : other settings that affect the tracks, for JSON
    """
    stat = film.stat() if film.exists() else None
    beside = film.with_name(fitted(film.name, TIMES_SUFFIX))
    made_from = {
        **choices,
        "command": command_name(),
        "version": importlib.metadata.version("curling-sheet"),
        "times": sha256_of(beside) if beside.exists() else None,
        "film": os.path.realpath(film),
        "size": None if stat is None else stat.st_size,
        "changed": None if stat is None else stat.st_mtime_ns,
    }
    text = json.dumps(made_from, sort_keys=True, default=_for_json)
    return hashlib.sha256(text.encode()).hexdigest()


def _for_json(value: Any) -> Any:
    return value.tolist() if isinstance(value, np.ndarray | np.generic) else repr(value)
