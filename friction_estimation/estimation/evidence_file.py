"""Throws behind an ice, kept beside its file so that later throws can be added.

`ice.evidence.npz` beside `ice.json` has the tracks and the options of the estimate. Map and effects
depend on each other, so an update fits all throws together again.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from curling_env.errors import InputError
from curling_env.ice import Ice, ice_document, parse_ice
from curling_env.infrastructure.files.reading import parse_json, read_arrays
from curling_env.infrastructure.files.storage import write_arrays
from curling_env.infrastructure.files.writing import fitted
from curling_env.trajectory import Trajectory, track_columns, tracks_of_columns
from friction_estimation.estimation.whole_ice import CameraBiasChoice, EffectsChoice


@dataclass(frozen=True, kw_only=True)
class Choices:
    """Options of an estimate, kept so that an update uses the same; as of `estimate_ice`."""

    effects: EffectsChoice = "all"
    uniform: bool = False
    camera_bias: CameraBiasChoice = "auto"
    start: Ice | None = None
    prior: Ice | None = None


@dataclass(frozen=True, kw_only=True)
class Evidence:
    """Evidence behind an ice file.

    Parameters
    ----------
    tracks : tracks that the ice was estimated from
    choices : options of the estimate
    """

    tracks: list[Trajectory]
    choices: Choices

    def check(self, asked: Choices, source: str | Path) -> None:
        """Refuse choices of an update that differ from those of the first estimate.

        Raises
        ------
        InputError : a choice that is neither the usual one nor that of the first estimate
        """
        for name in ("uniform", "effects", "camera_bias"):
            now, then = getattr(asked, name), getattr(self.choices, name)
            if now not in (getattr(Choices(), name), then):
                option = name.replace("_", "-")
                problem = f"was estimated with another --{option}; an update cannot change it"
                raise InputError(problem, source=source)


def evidence_path(ice: str | Path) -> Path:
    """Return the path of an ice file's evidence."""
    return Path(ice).with_name(fitted(Path(ice).stem, ".evidence.npz"))


_COLUMNS = {"throw", "t", "x", "y", "theta", "stone", "clock", "swept"}
"""Required columns of the tracks; columns of standard errors are optional."""
_INCOMPLETE = "is incomplete; expected the evidence of an ice"


def save_evidence(
    tracks: Sequence[Trajectory], choices: Choices, ice: Ice, source: str | Path
) -> Path:
    """Write the throws behind an ice file, complete or not at all, and return where.

    Parameters
    ----------
    tracks, choices : as of `Evidence`
    ice : the ice, by whose friction the evidence is recognised
    source : its file
    """
    path = evidence_path(source)
    document = json.dumps(_choices_document(choices))
    columns = track_columns(tracks, exact=True)
    write_arrays(path, {"mu": ice.friction.mu, "choices": document, **columns})
    return path


def load_evidence(ice: Ice, source: str | Path) -> Evidence:
    """Load the throws behind an ice file, and the options of its estimate.

    Parameters
    ----------
    ice : ice as loaded from `source`
    source : the ice file

    Raises
    ------
    InputError : there is no evidence, it cannot be read, or it belongs to another ice
    """
    path = evidence_path(source)
    if not path.exists():
        raise InputError(
            f"an update needs the evidence that `curling estimate` wrote beside the ice, {path}; "
            "--prior needs only the ice",
            source=source,
        )
    columns = read_arrays(path, what="the evidence of an ice")
    if not {*_COLUMNS, "mu", "choices"} <= columns.keys():
        problem = "contains no throws; estimate the ice again from its tracks"
        raise InputError(problem, source=path)
    mu, choices = columns.pop("mu"), str(columns.pop("choices"))
    counts = columns.pop("rows", None)
    if counts is not None:  # releases up to 0.2.0 wrote the labels once per throw
        if counts.dtype.kind not in "iu" or counts.min(initial=0) < 0:
            raise InputError(_INCOMPLETE, source=path)
        for name in ("throw", "stone", "clock"):
            if columns[name].shape != counts.shape:
                raise InputError(_INCOMPLETE, source=path)
            columns[name] = np.repeat(columns[name], counts)
    if mu.dtype.kind != "f" or any(
        column.ndim != 1 or column.dtype.kind not in "biuf" for column in columns.values()
    ):
        raise InputError(_INCOMPLETE, source=path)
    if mu.shape != ice.friction.mu.shape or not np.allclose(mu, ice.friction.mu, rtol=1e-9):
        raise InputError(f"belongs to another ice than {source}", source=path)
    cells = {name: column.tolist() for name, column in columns.items()}
    tracks = tracks_of_columns(cells, str(path))
    return Evidence(tracks=tracks, choices=_parse_choices(choices, path))


def _choices_document(choices: Choices) -> dict[str, Any]:
    """Choices for JSON."""
    ices = {"start": choices.start, "prior": choices.prior}
    return {
        "effects": choices.effects,
        "uniform": choices.uniform,
        "camera_bias": choices.camera_bias,
        **{name: None if ice is None else ice_document(ice) for name, ice in ices.items()},
    }


def _parse_choices(text: str, path: Path) -> Choices:
    """Choices from JSON."""
    try:
        document = parse_json(text, source=path, where="its choices")
        ices = {
            name: None if document[name] is None else parse_ice(document[name])
            for name in ("start", "prior")
        }
        effects, camera_bias = document["effects"], document["camera_bias"]
        if effects not in ("all", "none") or camera_bias not in ("auto", "off"):
            raise InputError("holds choices that are not known", source=path)
        return Choices(
            effects=effects, camera_bias=camera_bias, uniform=bool(document["uniform"]), **ices
        )
    except (ValueError, KeyError, TypeError, InputError) as error:
        raise InputError(_INCOMPLETE, source=path) from error


def with_later_throws(
    earlier: Sequence[Trajectory], later: Sequence[Trajectory]
) -> tuple[list[Trajectory], list[str]]:
    """Join earlier and later throws into one session, with remarks on repeated throws.

    Later throws are numbered after the earlier ones.
    """
    tracks, remarks = list(earlier), list[str]()
    numbers: dict[int, int] = {}
    first = max((track.throw for track in earlier), default=-1) + 1
    for track in later:
        if any(_is_same(track, other) for other in earlier):
            remarks.append(f"throw {track.throw} is among the earlier throws and counts once")
            continue
        number = numbers.setdefault(track.throw, first + len(numbers))
        tracks.append(replace(track, throw=number))
    return tracks, remarks


def _is_same(one: Trajectory, other: Trajectory) -> bool:
    return (
        len(one) == len(other) and np.array_equal(one.t, other.t) and np.allclose(one.xy, other.xy)
    )
