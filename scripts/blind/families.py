"""The families of sessions, and what is hidden in each session of them."""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice
from typing import Any

import numpy as np

from blind.hidden import FORMS, GIVEN, NAMES, OUTSIDE
from blind.sessions import make_session

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
"""Hidden in sessions that were played in one direction only."""
FIRST_SUITE = ("none", "undecidable", "one", "another form", "two", "outside")
"""Families with one thing hidden, or two, on ice that is perfect otherwise."""
KINDS = (
    *FIRST_SUITE,
    "model given",
    "model given, nothing hidden",
    "map",
    "weak",
    "known beside unknown",
    "one way",
    "badly measured",
    "24 throws",
)
FRESH = 6
"""Throws played after a session, that only the score sees."""


@dataclass(frozen=True, kw_only=True)
class Task:
    """One session to make and to search.

    Parameters
    ----------
    kind : family
    index : number within the family; with the seed of the benchmark it seeds the session
    hidden : names of what is hidden
    throws : throws of the session
    ways : directions of play
    given : whether the preset `standard` is given as the model, and the ice is like it
    scale : factor on the usual sizes of the effects
    bad : whether the session is badly measured
    """

    kind: str
    index: int
    hidden: tuple[str, ...] = ()
    throws: int
    ways: int = 2
    given: bool = False
    scale: float = 1.0
    bad: bool = False

    @property
    def name(self) -> str:
        """Name of its files."""
        return f"{self.kind.replace(', ', '-').replace(' ', '-')}-{self.throws}-{self.index:03d}"

    def make(self, seed: int, *, film: bool) -> tuple[dict[str, list[Any]], dict[str, Any]]:
        """Columns of its tracks, and the sealed truth, see `make_session`."""
        family = zlib.crc32(self.kind.encode())
        return make_session(
            self.hidden,
            np.random.default_rng([seed, family, self.throws, self.index]),
            throws=self.throws,
            fresh=FRESH,
            ways=self.ways,
            film=film,
            championship=self.given,
            scale=self.scale,
            bad=self.bad,
        )


def plan(
    kinds: list[str], sessions: int, *, throws: int = 20, others: tuple[int, ...] = ()
) -> list[Task]:
    """What is hidden in every session; more sessions add to those that fewer have.

    Parameters
    ----------
    kinds : families, of `KINDS`
    sessions : times that each effect is hidden; pairs, forms and what is outside half as often
    throws : of sessions outside the first suite, whose sessions have 16
    others : further numbers of throws, for sessions with one effect or none
    """
    half = max(1, sessions // 2)
    hidden: dict[str, list[tuple[str, ...]]] = {
        "none": [()] * (4 * sessions),
        "undecidable": [("frame_rate_error",), ("scale_error",)],
        "one": singles(NAMES, sessions),
        "another form": singles(FORMS, half),
        "two": list(PAIRS) * half,
        "outside": singles(OUTSIDE, half),
        "model given": singles(GIVEN, sessions),
        "model given, nothing hidden": [()] * (4 * sessions),
        "map": [
            ("friction_map", *others)
            for four in islice(zip(*map(combinations, range(4)), strict=True), 4 * sessions)
            for others in four
        ],
        "weak": singles(NAMES, 2 * sessions),
        "known beside unknown": beside_unknown(sessions),
        "one way": list(ONE_WAY) * sessions,
        "badly measured": [*([()] * 4), *singles(NAMES, 1)] * sessions,
        "24 throws": [(), ("curl",), ("friction_map", "curl", "slope"), ("sweeping",)] * half,
    }
    tasks = [
        Task(kind=kind, index=i, hidden=names, **_setting(kind, i, throws))
        for kind in KINDS
        if kind in kinds
        for i, names in enumerate(hidden[kind])
    ]
    for count in others:
        for kind, wanted in (("one", singles(NAMES, 1)), ("none", [()] * 2)):
            tasks += [
                Task(kind=kind, index=i, hidden=names, throws=count)
                for i, names in enumerate(wanted)
            ]
    return tasks


def _setting(kind: str, index: int, throws: int) -> dict[str, Any]:
    """How the sessions of a family are played and measured."""
    if kind in FIRST_SUITE:
        return {"throws": 16}
    if kind == "24 throws":
        return {"throws": 24, "given": index % 4 == 3}
    return {
        "throws": throws,
        "ways": 1 if kind == "one way" else 2,
        "given": kind.startswith("model given"),
        "scale": (1.0 / 3.0, 0.1)[index // len(NAMES) % 2] if kind == "weak" else 1.0,
        "bad": kind == "badly measured",
    }


def singles(names: tuple[str, ...], times: int) -> list[tuple[str, ...]]:
    """Each name by itself, all of them several times."""
    return [(name,) for name in names] * times


def combinations(count: int) -> Iterator[tuple[str, ...]]:
    """Endless combinations of several effects, all of them about equally often.

    Wear of the whole sheet and wear along paths are never together: they are one effect.
    """
    rng = np.random.default_rng(count)
    while True:
        order = rng.permutation(len(NAMES))
        for begin in range(0, len(NAMES) - count + 1, max(count, 1)):
            names = tuple(NAMES[int(k)] for k in order[begin : begin + count])
            if len({name.partition(":")[0] for name in names}) == count:
                yield names


def beside_unknown(times: int) -> list[tuple[str, ...]]:
    """Each effect of the catalogue, beside one thing after the other that is outside it."""
    count = len(NAMES) * times
    return [(NAMES[i % len(NAMES)], OUTSIDE[i % len(OUTSIDE)]) for i in range(count)]
