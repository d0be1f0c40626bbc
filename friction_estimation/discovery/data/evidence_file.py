"""The throws behind an ice, kept beside its file so that later throws can be added.

Beside `ice.json` lies `ice.evidence.npz` with the tracks themselves. Map and effects depend on one
another, so that an update fits all throws together once more.
"""

from __future__ import annotations

import zipfile
import zlib
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from curling_env.errors import InputError
from curling_env.ice import Ice
from curling_env.infrastructure.storage import atomic_path
from curling_env.trajectory import Trajectory
from curling_env.typing import Floats
from friction_estimation.inversion.friction.information import information_path

_ROWS = ("t", "x", "y", "theta", "swept", "sigma_xy", "sigma_theta")
_THROWS = ("throw", "stone", "clock", "rows")


def save_evidence(tracks: Sequence[Trajectory], ice: Ice, source: str | Path) -> Path:
    """Write the throws behind an ice file, complete or not at all, and return where.

    Parameters
    ----------
    tracks : tracks that the ice was estimated from
    ice : the ice, by whose friction the evidence is recognised
    source : its file
    """
    path = information_path(source)
    rows: dict[str, Any] = {
        name: np.concatenate([_column(track, name) for track in tracks]) for name in _ROWS
    }
    with atomic_path(path) as temporary:
        np.savez_compressed(
            temporary,
            mu=ice.friction.mu,
            throw=[track.throw for track in tracks],
            stone=[track.stone for track in tracks],
            clock=[track.clock for track in tracks],
            rows=[len(track) for track in tracks],
            **rows,
        )
    return path


def load_evidence(ice: Ice, source: str | Path) -> list[Trajectory] | None:
    """The throws behind an ice file; None if its evidence is not of this kind.

    Parameters
    ----------
    ice : ice as loaded from `source`
    source : the ice file

    Raises
    ------
    InputError : the evidence cannot be read, or belongs to another ice
    """
    path = information_path(source)
    try:
        with np.load(path, allow_pickle=False) as stored:
            if not {*_ROWS, *_THROWS, "mu"} <= set(stored.files):
                return None
            columns = {name: stored[name] for name in (*_ROWS, *_THROWS, "mu")}
    except FileNotFoundError:
        return None
    except (OSError, ValueError, EOFError, zipfile.BadZipFile, zlib.error) as error:
        problem = f"cannot be read as the evidence of an ice: {error}"
        raise InputError(problem, source=path) from error
    mu, counts = columns["mu"], columns["rows"]
    if mu.shape != ice.friction.mu.shape or not np.allclose(mu, ice.friction.mu, rtol=1e-9):
        raise InputError(f"belongs to another ice than {source}", source=path)
    if (
        any(len(columns[name]) != len(counts) for name in _THROWS)
        or any(len(columns[name]) != counts.sum() for name in _ROWS)
        or (counts < 1).any()
    ):
        raise InputError("is not the whole evidence of an ice", source=path)
    tracks: list[Trajectory] = []
    ends = np.cumsum(counts)
    for k, end in enumerate(ends):
        own = {name: columns[name][end - counts[k] : end] for name in _ROWS}
        sigma = {
            name: own[name] for name in ("sigma_xy", "sigma_theta") if np.isfinite(own[name]).any()
        }
        tracks.append(
            Trajectory(
                throw=int(columns["throw"][k]),
                stone=int(columns["stone"][k]),
                clock=float(columns["clock"][k]),
                t=own["t"],
                xy=np.column_stack([own["x"], own["y"]]),
                theta=own["theta"],
                swept=own["swept"],
                **sigma,
            )
        )
    return tracks


def with_later_throws(
    earlier: Sequence[Trajectory], later: Sequence[Trajectory]
) -> tuple[list[Trajectory], list[str]]:
    """Earlier and later throws as one session, and remarks on throws that were there before.

    Later throws get numbers that go on from the earlier ones.
    """
    tracks, remarks = list(earlier), list[str]()
    for track in later:
        if any(_is_same(track, other) for other in earlier):
            remarks.append(f"throw {track.throw} is among the earlier throws and counts once")
            continue
        number = max(other.throw for other in tracks) + 1
        tracks.append(replace(track, throw=number))
    return tracks, remarks


def _is_same(one: Trajectory, other: Trajectory) -> bool:
    return (
        len(one) == len(other) and np.array_equal(one.t, other.t) and np.allclose(one.xy, other.xy)
    )


def _column(track: Trajectory, name: str) -> Floats:
    """A column of a track; NaN where the track has none."""
    if name in ("x", "y"):
        return track.xy[:, "xy".index(name)]
    values = np.asarray(getattr(track, name), dtype=np.float64)
    return values if values.size else np.full(len(track), np.nan)
