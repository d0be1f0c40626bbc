"""Families of sessions, and the hidden effects of each session."""

from __future__ import annotations

import json
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from blind.hidden import FORMS, GIVEN, NAMES, OUTSIDE
from blind.sessions import make_session
from curling_env.infrastructure.files.storage import write_table
from curling_env.trajectory import Trajectory, read_tracks

PAIRS = (
    ("curl", "speed_dependent_friction"),
    ("curl", "slope"),
    ("curl", "stone_bias"),
    ("curl", "stone_bias:curl"),
    ("curl", "sweeping"),
    ("speed_dependent_friction", "slope"),
    ("speed_dependent_friction", "time_drift"),
    ("air_drag", "speed_dependent_friction"),
    ("spin_drag", "curl"),
    ("slope", "pebble_wear"),
    ("curl", "pebble_wear:along paths"),
    ("tracking_offset", "curl"),
    ("friction_patch", "slope"),
    ("lens_distortion", "curl"),
)
ONE_WAY = (
    (),
    ("curl",),
    ("speed_dependent_friction",),
    ("slope",),
    ("curl", "speed_dependent_friction"),
)
"""Hidden effects of sessions that were played in one direction only."""
SHORT = ("none", "one", "another form", "two")
"""Families whose sessions have 16 throws, the others 20."""
FRESH = 6
"""Number of throws played after a session."""


@dataclass(frozen=True, kw_only=True)
class Task:
    """Session to make and to search.

    Parameters
    ----------
    kind : family
    index : number within the family; with the seed of the benchmark it seeds the session
    hidden : names of the hidden effects
    throws : number of throws of the session
    ways : directions of play
    given : give the preset `standard` as the model, on ice like it
    scale : factor on the usual sizes of the effects
    """

    kind: str
    index: int
    hidden: tuple[str, ...] = ()
    throws: int
    ways: int = 2
    given: bool = False
    scale: float = 1.0

    @property
    def name(self) -> str:
        """Name of the session."""
        return f"{self.kind.replace(', ', '-').replace(' ', '-')}-{self.throws}-{self.index:03d}"

    def make(self, seed: int) -> tuple[list[Trajectory], dict[str, Any]]:
        """Make the session: its tracks as read from a track file, and the sealed truth."""
        family = zlib.crc32(self.kind.encode())
        columns, truth = make_session(
            self.hidden,
            np.random.default_rng([seed, family, self.throws, self.index]),
            throws=self.throws,
            fresh=FRESH,
            ways=self.ways,
            championship=self.given,
            scale=self.scale,
        )
        seen = np.array(columns["throw"]) < self.throws
        with TemporaryDirectory() as folder:
            path = Path(folder) / "tracks.csv"
            write_table(path, {k: np.array(v)[seen].tolist() for k, v in columns.items()})
            return read_tracks(path), json.loads(json.dumps(truth, default=float))


def plan(kind: str) -> list[Task]:
    """Return the sessions of a family."""
    weak = len(NAMES)
    hidden: dict[str, list[tuple[str, ...]]] = {
        "none": [()] * 4,
        "one": _singles(NAMES),
        "another form": _singles(FORMS),
        "two": list(PAIRS),
        "model given": _singles(GIVEN),
        "model given, nothing hidden": [()] * 4,
        "map": [
            ("friction_map", *others)
            for four in islice(zip(*map(combinations, range(4)), strict=True), 4)
            for others in four
        ],
        "weak": _singles(NAMES) * 2,
        "known beside unknown": [(name, OUTSIDE[i % len(OUTSIDE)]) for i, name in enumerate(NAMES)],
        "one way": list(ONE_WAY),
    }
    return [
        Task(
            kind=kind,
            index=i,
            hidden=names,
            throws=16 if kind in SHORT else 20,
            ways=1 if kind == "one way" else 2,
            given=kind.startswith("model given"),
            scale=(1.0 / 3.0, 0.1)[i // weak] if kind == "weak" else 1.0,
        )
        for i, names in enumerate(hidden[kind])
    ]


def _singles(names: tuple[str, ...]) -> list[tuple[str, ...]]:
    return [(name,) for name in names]


def combinations(count: int) -> Iterator[tuple[str, ...]]:
    """Yield endless combinations of several effects, all of them about equally often.

    Wear of the whole sheet and wear along paths are never together: they are one effect.
    """
    rng = np.random.default_rng(count)
    while True:
        order = rng.permutation(len(NAMES))
        for begin in range(0, len(NAMES) - count + 1, max(count, 1)):
            names = tuple(NAMES[int(k)] for k in order[begin : begin + count])
            if len({name.partition(":")[0] for name in names}) == count:
                yield names
