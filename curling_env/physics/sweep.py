"""Sweeps: every throw on every ice, with every seed of a hand's errors.

A sweep is cut into pieces of fixed size, and a piece's randomness comes from its seed and its
place alone. So its numbers do not depend on who did which piece, or how often.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from curling_env.errors import InputError
from curling_env.executor import Executor, Here
from curling_env.ice import Ice
from curling_env.physics.batch import RELEASE_DTYPE, Rests, release_table, throw_batch
from curling_env.throw import MAX_SPEED, MAX_SPIN, Release, Skill, skill_named
from curling_env.typing import Floats

PIECE = 4096
"""Throws in a piece, a twentieth of a second's work; another size would draw other errors."""
SLOWEST = 1e-3
"""A hand that errs to a standstill still lets go with this speed [m/s]."""


@dataclass(frozen=True, kw_only=True)
class Piece:
    """Throws that one worker makes on one ice: each of them with each seed.

    Parameters
    ----------
    ice : thrown on
    releases : as they were meant, structured array of RELEASE_DTYPE
    skill : of the hand that makes them
    seeds, place : of its errors: seeds of the sweep, and the piece's place among the throws
    bounds : as of `throw_batch`
    """

    ice: Ice
    releases: NDArray[Any]
    skill: Skill
    seeds: tuple[int, ...]
    place: int
    bounds: Floats | None


def throw_piece(piece: Piece) -> Rests:
    """Make the throws of a piece; depends on nothing else."""
    made: list[NDArray[Any]] = []
    for seed in piece.seeds:
        # The spawn key is that of the place-th child of SeedSequence(seed).spawn.
        source = np.random.SeedSequence(seed, spawn_key=(piece.place,))
        made.append(executed(piece.releases, piece.skill, np.random.default_rng(source)))
    return throw_batch(piece.ice, np.concatenate(made), bounds=piece.bounds)


def executed(releases: NDArray[Any], skill: Skill, rng: np.random.Generator) -> NDArray[Any]:
    """Releases as a hand makes them, whose errors are independent of each other.

    Parameters
    ----------
    releases : structured array of RELEASE_DTYPE
    """
    if skill.is_exact:
        return releases
    # Errors come in opposite pairs; half of twice as many are independent.
    error = skill.errors(2 * len(releases), rng)[: len(releases)]
    speed = np.hypot(releases["vx"], releases["vy"])
    turn = np.arctan2(releases["vy"], releases["vx"]) + error[:, 1]
    speed = np.clip(speed + error[:, 0], SLOWEST, MAX_SPEED)
    made = releases.copy()
    made["vx"], made["vy"] = speed * np.cos(turn), speed * np.sin(turn)
    made["omega"] = np.clip(releases["omega"] + error[:, 2], -MAX_SPIN, MAX_SPIN)
    return made


@dataclass(frozen=True, kw_only=True)
class Sweep:
    """What is swept over: all combinations.

    Parameters
    ----------
    ices : thrown on
    releases : (n,) as they are meant, structured array of RELEASE_DTYPE or `Release`s
    seeds : of the hand's errors; every ice sees the same errors with the same seed
    skill : of the hand, a name or a `Skill`
    bounds : (4,) x_min, x_max, y_min, y_max of centres that end a throw; an ice's edges by default

    Raises
    ------
    InputError : no ice, no release, no seed, a seed below 0
    """

    ices: Sequence[Ice]
    releases: NDArray[Any] | Sequence[Release]
    seeds: Sequence[int] = (0,)
    skill: Skill | str = "none"
    bounds: Floats | None = None

    def __post_init__(self) -> None:
        for name in ("ices", "releases", "seeds"):
            if len(getattr(self, name)) == 0:
                raise InputError(f"a sweep needs {name}, got none")
        if min(self.seeds) < 0:
            raise InputError(f"a seed must be at least 0, got {min(self.seeds)}")
        skill_named(self.skill)

    @property
    def shape(self) -> tuple[int, int, int]:
        """Ices, seeds and throws."""
        return len(self.ices), len(self.seeds), len(self.releases)

    def pieces(self) -> Iterator[Piece]:
        """The work, cut up: ice by ice, seed by seed."""
        releases = self.releases
        table = releases if isinstance(releases, np.ndarray) else release_table(releases)
        if table.dtype != RELEASE_DTYPE:
            raise InputError(f"expected releases of RELEASE_DTYPE, got {table.dtype}")
        for ice in self.ices:
            for first in range(0, len(self.seeds), self._together):
                for place, start in enumerate(range(0, len(table), PIECE)):
                    yield Piece(
                        ice=ice,
                        releases=table[start : start + PIECE],
                        skill=skill_named(self.skill),
                        seeds=tuple(self.seeds[first : first + self._together]),
                        place=place,
                        bounds=self.bounds,
                    )

    @property
    def _together(self) -> int:
        """Seeds in a piece: many where the throws are few, else one."""
        return max(1, PIECE // len(self.releases))

    @property
    def piece_count(self) -> int:
        """How many pieces there are."""
        ices, seeds, throws = self.shape
        return ices * -(-seeds // self._together) * -(-throws // PIECE)


def run(
    sweep: Sweep,
    executor: Executor | None = None,
    *,
    through: Callable[[Iterable[Rests]], Iterable[Rests]] = lambda results: results,
) -> Rests:
    """Do a sweep.

    Parameters
    ----------
    executor : who does it; this process by default
    through : passes finished pieces on and shows how far it is

    Returns
    -------
    arrays of the sweep's shape: ices, seeds, throws
    """
    done = list(through((executor or Here()).map(throw_piece, sweep.pieces())))
    ends: dict[str, Any] = {
        name: np.concatenate([getattr(rests, name) for rests in done]).reshape(sweep.shape)
        for name in ("x", "y", "theta", "time", "end")
    }
    return replace(done[0], **ends)
