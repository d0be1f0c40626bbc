"""Sweeps over many throws: every throw on every ice, with every seed of a player's errors.

A sweep is cut into pieces of fixed size. The randomness of a piece comes only from its seed and its
place, so that its numbers do not depend on the worker.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from curling_env.errors import InputError
from curling_env.ice import Ice
from curling_env.infrastructure.workers import Executor
from curling_env.physics.batch import RELEASE_DTYPE, Rests, release_table, throw_batch
from curling_env.physics.slides import SlideEnd
from curling_env.throw import MAX_SPEED, MAX_SPIN, Release, Skill, skill_named
from curling_env.typing import Floats, Progress, no_progress, with_progress

PIECE_SIZE = 4096
"""Number of throws in a piece, a twentieth of a second of work; another size would draw other
errors.
"""
MIN_RELEASE_SPEED = 1e-3
"""Minimum speed of a release, for an error that would stop it or turn it back [m/s]."""


class Piece(NamedTuple):
    """Throws that one worker makes on one ice, each of them with each seed."""

    ice: Ice
    releases: NDArray[Any]
    skill: Skill
    seeds: tuple[int, ...]
    place: int
    """Place of its releases among those of the sweep, in pieces."""
    bounds: Floats | None


def throw_piece(piece: Piece) -> Rests:
    """Make the throws of a piece; the result depends on nothing else."""
    # The spawn key is that of the place-th child of SeedSequence(seed).spawn.
    sources = [np.random.SeedSequence(seed, spawn_key=(piece.place,)) for seed in piece.seeds]
    made = [executed(piece.releases, piece.skill, np.random.default_rng(s)) for s in sources]
    return throw_batch(piece.ice, np.concatenate(made), bounds=piece.bounds)


def executed(releases: NDArray[Any], skill: Skill, rng: np.random.Generator) -> NDArray[Any]:
    """Return releases of RELEASE_DTYPE as executed by a player, each with its own error."""
    if skill.is_exact:
        return releases
    # Errors come in opposite pairs: draw 2 n, of which the first n are independent.
    error = skill.errors(2 * len(releases), rng)[: len(releases)]
    speed = np.hypot(releases["vx"], releases["vy"])
    turn = np.arctan2(releases["vy"], releases["vx"]) + error[:, 1]
    speed = np.clip(speed + error[:, 0], MIN_RELEASE_SPEED, MAX_SPEED)
    made = releases.copy()
    made["vx"], made["vy"] = speed * np.cos(turn), speed * np.sin(turn)
    made["omega"] = np.clip(releases["omega"] + error[:, 2], -MAX_SPIN, MAX_SPIN)
    return made


@dataclass(frozen=True, kw_only=True)
class Sweep:
    """Ices, throws and seeds, in all combinations.

    Parameters
    ----------
    releases : (n,) intended releases, structured array of RELEASE_DTYPE or `Release`s
    seeds : seeds of the errors; with the same seed every ice sees the same errors
    skill : scatter of the throws, a name or a `Skill`
    bounds : (4,) x_min, x_max, y_min, y_max of centres that end a throw; the edges of the ice by
        default

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
                raise InputError(f"expected at least one of the {name}, got none")
        if min(self.seeds) < 0:
            raise InputError(f"a seed must be at least 0, got {min(self.seeds)}")
        skill_named(self.skill)

    @property
    def shape(self) -> tuple[int, int, int]:
        """Number of ices, seeds and throws."""
        return len(self.ices), len(self.seeds), len(self.releases)

    def pieces(self) -> Iterator[Piece]:
        """Yield the pieces of the work, ice by ice and seed by seed."""
        releases = self.releases
        table = releases if isinstance(releases, np.ndarray) else release_table(releases)
        if table.dtype != RELEASE_DTYPE:
            raise InputError(f"expected releases of RELEASE_DTYPE, got {table.dtype}")
        skill, many = skill_named(self.skill), self._seeds_per_piece
        for ice in self.ices:
            for first in range(0, len(self.seeds), many):
                seeds = tuple(self.seeds[first : first + many])
                for place, start in enumerate(range(0, len(table), PIECE_SIZE)):
                    part = table[start : start + PIECE_SIZE]
                    yield Piece(ice, part, skill, seeds, place, self.bounds)

    @property
    def _seeds_per_piece(self) -> int:
        """Number of seeds per piece: several if the throws are few, otherwise one."""
        return max(1, PIECE_SIZE // len(self.releases))

    @property
    def piece_count(self) -> int:
        """Number of pieces."""
        ices, seeds, throws = self.shape
        return ices * -(-seeds // self._seeds_per_piece) * -(-throws // PIECE_SIZE)

    def table(self, ends: Rests) -> dict[str, NDArray[Any]]:
        """Return the columns of a table of ends: a row for each ice, seed and throw.

        Parameters
        ----------
        ends : the ends, from `run`
        """
        ice, seed, throw = (axis.ravel() for axis in np.indices(self.shape))
        given = self.releases
        is_table = isinstance(given, np.ndarray)
        numbers = range(len(given)) if is_table else [release.throw for release in given]
        names = np.array([end.name.lower() for end in SlideEnd])
        return {
            "ice": ice,
            "seed": np.array(self.seeds)[seed],
            "throw": np.array(numbers)[throw],
            **{name: getattr(ends, name).ravel() for name in ("x", "y", "theta", "time")},
            "end": names[ends.end.ravel()],
        }


def run(
    sweep: Sweep, executor: Executor | None = None, *, progress: Progress = no_progress
) -> Rests:
    """Make all throws of a sweep, in this process or by an executor.

    Progress is reported in pieces. The arrays have the sweep's shape (ices, seeds, throws).
    """
    pieces = (executor or Executor()).map(throw_piece, sweep.pieces())
    done = list(with_progress(pieces, "sweep", progress, sweep.piece_count))
    ends: dict[str, Any] = {
        name: np.concatenate([getattr(rests, name) for rests in done]).reshape(sweep.shape)
        for name in ("x", "y", "theta", "time", "end")
    }
    return replace(done[0], **ends)
