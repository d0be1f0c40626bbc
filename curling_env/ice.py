"""Ice: friction per cell with its uncertainty, the active effects, and their file."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from importlib.resources import files
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from numpy.typing import ArrayLike

from curling_env.errors import InputError, placed
from curling_env.ice_form import (
    MAX_PARAMETER,
    EffectDocument,
    IceDocument,
    Interpolation,
    LevelDocument,
    LevelError,
    check_common,
)
from curling_env.infrastructure.files.reading import read_json
from curling_env.infrastructure.files.schema import FileFormat, checked
from curling_env.infrastructure.files.storage import write_json, write_table
from curling_env.sheet import PAPER_SHEET, RULE_BOOK_STONE, Sheet, Stone
from curling_env.typing import Flags, Floats
from curling_env.worn_tracks import WornTracks

ICE_FORMAT = FileFormat(name="curling-ice/1", what="an ice file")
MAX_FRICTION = 1.0
"""Largest μ accepted: far above any ice, but low enough to catch a file in other units."""


_PRESETS = files("curling_env") / "presets"


@dataclass(frozen=True, kw_only=True)
class FrictionMap:
    """Coefficient of friction per cell.

    Parameters
    ----------
    mu : (rows, columns) coefficient of friction; rows from y=-L/2 upward, columns from x=-W/2
    sigma : (rows, columns) standard error of mu
    observed : (rows, columns) true if a measured stone crossed the cell
    interpolation : ``bilinear`` between the centres of cells, or ``cell`` for constant cells, as in
        the paper
    level : the error that all cells have in common; None if unknown

    Raises
    ------
    InputError : shapes that differ, a mu that is not positive, a sigma that is negative
    """

    mu: Floats
    sigma: Floats
    observed: Flags
    interpolation: Interpolation = "bilinear"
    level: LevelError | None = None

    def __post_init__(self) -> None:
        shape = self.mu.shape
        if self.mu.ndim != 2:
            raise InputError(f"friction mu must be a table of rows and columns, got {shape}")
        for name in ("sigma", "observed"):
            if getattr(self, name).shape != shape:
                raise InputError(
                    f"friction {name} has shape {getattr(self, name).shape}, mu has {shape}"
                )
        mu, sigma = self.mu, self.sigma
        for name, good, expected in (
            ("mu", (mu > 0) & (mu <= MAX_FRICTION), f"be above 0 and at most {MAX_FRICTION}"),
            ("sigma", (sigma >= 0) & (sigma < np.inf), "be a finite number of at least 0"),
        ):
            for row, column in np.argwhere(~good)[:1].tolist():
                raise InputError(
                    f"{name} must {expected}, got {getattr(self, name)[row, column]:g}",
                    where=f"friction.{name}[{row}][{column}]",
                )
        if self.interpolation not in ("bilinear", "cell"):
            raise InputError(
                f"interpolation must be 'bilinear' or 'cell', got {self.interpolation!r}",
                where="friction.interpolation",
            )

    @classmethod
    def uniform(cls, mu: float, sheet: Sheet = PAPER_SHEET, *, sigma: float = 0.0) -> FrictionMap:
        """Return the same friction on every cell of a sheet."""
        return cls(
            mu=np.full(sheet.shape, float(mu)),
            sigma=np.full(sheet.shape, float(sigma)),
            observed=np.ones(sheet.shape, dtype=bool),
        )

    @property
    def is_uniform(self) -> bool:
        """Return whether every cell has the same mu."""
        return bool((self.mu == self.mu.flat[0]).all())


@dataclass(frozen=True, kw_only=True)
class ActiveEffect:
    """Effect of the catalogue with its parameters on this ice.

    Parameters
    ----------
    name : name in the catalogue of effects
    parameters : values by name, in the units of the effect's card
    sigma : standard errors by the same names; a missing one is unknown
    believed : names of parameters whose value is an assumption for any rink, not from throws on
        this ice
    common : for parameters with a sigma, the parts of their error in common with others of the ice.
        The ice has independent standard normal errors e₁, e₂, …; the error of a parameter is
        sigma·(c₁·e₁ + c₂·e₂ + … + c·e), where c·e is independent and all squares add up to one. A
        missing parameter shares nothing.

    Raises
    ------
    InputError : a number that is not finite, a negative sigma, a believed parameter without a
        value, or a common part of more than the whole
    """

    name: str
    parameters: Mapping[str, float] = field(default_factory=dict[str, float])
    sigma: Mapping[str, float] = field(default_factory=dict[str, float])
    believed: tuple[str, ...] = ()
    common: Mapping[str, tuple[float, ...]] = field(default_factory=dict[str, tuple[float, ...]])

    def __post_init__(self) -> None:
        for kind, values, low in (
            ("parameters", self.parameters, -MAX_PARAMETER),
            ("sigma", self.sigma, 0.0),
        ):
            for key, value in values.items():
                if not low <= value <= MAX_PARAMETER:
                    raise InputError(
                        f"effect {self.name}: {kind}.{key} must be at least {low:g} and at most "
                        f"{MAX_PARAMETER:g}, got {value:g}"
                    )
        for key in self.believed:
            if key not in self.parameters:
                raise InputError(
                    f"effect {self.name}: {key!r} is marked as believed but has no value"
                )
        for key, parts in self.common.items():
            if key not in self.sigma:
                raise InputError(f"effect {self.name}: {key!r} shares an error but has no sigma")
            check_common(parts, f"effect {self.name}: {key}")


@dataclass(frozen=True, kw_only=True)
class Ice:
    """Sheet with its friction map, active effects, and the stone of the measurement.

    Parameters
    ----------
    friction : friction of every cell
    sheet : its size and cells
    effects : effects that act in addition to the friction of the map
    stone : the stone with which friction and effects were measured
    tracks : tracks of stones since the ice had this `friction`; they act only through an effect,
        and are in no file. None before the first stone
    provenance : provenance in its file (`infrastructure.provenance`); empty for an ice that was
        made or changed since

    Raises
    ------
    InputError : a friction map that does not have the sheet's cells
    """

    friction: FrictionMap
    sheet: Sheet = PAPER_SHEET
    effects: tuple[ActiveEffect, ...] = ()
    stone: Stone = RULE_BOOK_STONE
    tracks: WornTracks | None = field(default=None, repr=False)
    provenance: Mapping[str, Any] = field(default_factory=dict[str, Any], compare=False, repr=False)

    def __post_init__(self) -> None:
        if self.friction.mu.shape != self.sheet.shape:
            raise InputError(
                f"a {self.sheet.length} × {self.sheet.width} m sheet with cells of "
                f"{self.sheet.cell_size} m has {self.sheet.shape[0]} rows and "
                f"{self.sheet.shape[1]} columns, friction has {self.friction.mu.shape}"
            )

    @classmethod
    def uniform(cls, mu: float, sheet: Sheet = PAPER_SHEET, **others: Any) -> Ice:
        """Return ice of the same friction everywhere; `others` are fields of `Ice`."""
        return cls(friction=FrictionMap.uniform(mu, sheet), sheet=sheet, **others)

    def mu_at(self, xy: ArrayLike) -> Floats:
        """Return the map's friction at points (..., 2) in the sheet frame, as in the force law."""
        mu = self.friction.mu
        if self.friction.interpolation == "cell":
            return mu[self.sheet.cell_of(xy)]
        (i, i1), (j, j1), u, v = self.sheet.cells_around(xy)
        return (1 - u) * ((1 - v) * mu[i, j] + v * mu[i, j1]) + u * (
            (1 - v) * mu[i1, j] + v * mu[i1, j1]
        )

    def refined(self, times: int) -> Ice:
        """Return the same ice on narrower cells, with the same friction at every point.

        Parameters
        ----------
        times : number of new cells across an old one; odd, so that old centres are centres again

        Raises
        ------
        InputError : an even number, or less than 1
        """
        if times < 1 or times % 2 == 0:
            raise InputError(f"expected an odd number of new cells across an old one, got {times}")
        sheet = replace(self.sheet, cell_size=self.sheet.cell_size / times)
        centres = np.stack(np.meshgrid(sheet.x_centres, sheet.y_centres), axis=-1)
        friction, cell = self.friction, self.sheet.cell_of(centres)
        mu = np.full(sheet.shape, friction.mu.flat[0])
        finer = replace(
            friction,
            mu=mu if friction.is_uniform else self.mu_at(centres),
            sigma=friction.sigma[cell],
            observed=friction.observed[cell],
        )
        return replace(self, sheet=sheet, friction=finer)

    def effect(self, name: str) -> ActiveEffect | None:
        """Return the first active effect of that name, or None."""
        return next((effect for effect in self.effects if effect.name == name), None)

    def without_effect(self, name: str) -> Ice:
        """Return the same ice without the effects of that name."""
        return replace(self, effects=tuple(e for e in self.effects if e.name != name))

    def with_effect(self, effect: ActiveEffect) -> Ice:
        """Return the same ice with one more effect."""
        return replace(self, effects=(*self.effects, effect))


# --- its file ------------------------------------------------------------------------------------


def write_cells(path: str | Path, ice: Ice) -> None:
    """Write the map as a table with a row for each cell: its place, mu, sigma and whether
    observed.
    """
    sheet, friction = ice.sheet, ice.friction
    rows, columns = sheet.shape
    write_table(
        path,
        {
            "row": np.repeat(np.arange(rows), columns),
            "column": np.tile(np.arange(columns), rows),
            "x": np.round(np.tile(sheet.x_centres, rows), 4),
            "y": np.round(np.repeat(sheet.y_centres, columns), 4),
            "mu": friction.mu.ravel(),
            "sigma": friction.sigma.ravel(),
            "observed": friction.observed.ravel().astype(int),
        },
    )


def save_ice(ice: Ice, path: str | Path, *, provenance: Mapping[str, Any] | None = None) -> None:
    """Write an ice file, completely or not at all.

    Parameters
    ----------
    ice : the ice
    path : file to write
    provenance : provenance of the ice; None: that of the ice itself
    """
    origin = ice.provenance if provenance is None else provenance
    write_json(path, ice_document(replace(ice, provenance=origin)))


def ice_document(ice: Ice) -> dict[str, Any]:
    """Return the ice as in an ice file, for JSON; `parse_ice` reads it."""
    return {
        "format": ICE_FORMAT.name,
        **({"provenance": dict(ice.provenance)} if ice.provenance else {}),
        "sheet": {"length": ice.sheet.length, "width": ice.sheet.width},
        "stone": asdict(ice.stone),
        "friction": {
            "cell_size": ice.sheet.cell_size,
            "interpolation": ice.friction.interpolation,
            "mu": ice.friction.mu.tolist(),
            "sigma": ice.friction.sigma.tolist(),
            "observed": ice.friction.observed.tolist(),
            **({"level": asdict(ice.friction.level)} if ice.friction.level else {}),
        },
        "effects": [
            {
                "name": e.name,
                "parameters": dict(e.parameters),
                "sigma": dict(e.sigma),
                **({"believed": list(e.believed)} if e.believed else {}),
                **({"common": {k: list(c) for k, c in e.common.items()}} if e.common else {}),
            }
            for e in ice.effects
        ],
    }


def preset_names() -> list[str]:
    """Return the names that `load_ice` accepts instead of a file."""
    return sorted(
        p.name.removesuffix(".json") for p in _PRESETS.iterdir() if p.name[-5:] == ".json"
    )


def load_ice(source: str | Path | Ice | Mapping[str, Any]) -> Ice:
    """Read an ice from a file, or take a preset by its name.

    Five presets come with the package, as ice files in ``curling_env/presets``:

    - ``standard``: championship ice. A draw takes 24 to 25 s from hog line to tee and curls 1.1 to
      1.5 m. Friction is 0.0082·s^(-1/4) at the sliding speed s of each contact, air drag 9.5e-4·v²
      and curl 0.0082·v^0.2. `spin_drag` adds the torque that the running band lacks for the
      observed decay of the spin, 0.02·v^(-0.6) rad/s² in all at draw weight.
    - ``fcv1``: the law of the Digital Curling competition's simulator, a point contact with
      dv/dt = -g·[0.00200985/(v + 0.06385782) + 0.00626286], a sideways acceleration of 0.0082·v^0.2
      and dω/dt = -0.025/max(v, 0.001). Its stones lose nothing when they collide (restitution 1,
      friction 0.2, 19.96 kg, inertia ½mR²) and its sheet is the rule book's, 45.72 × 4.75 m.
    - ``fitted``: the law of the standard ice fitted to all published rows of championship ice at
      once: friction 0.00822·s^(-0.269), curl 0.0067·v^0.2. A draw takes 24.6 s and curls 1.2 m.
    - ``club``: the standard ice slower and straighter, like the measured ice of a club: a stone of
      2.09 m/s and 1.01 rad/s runs 25.6 m and curls 0.78 m (Jensen & Shegelski 2004, as quoted by
      Penner). A draw takes 23.8 s from hog line to tee and curls 0.9 m.
    - ``paper``: uniform Coulomb friction of 0.0019 under the paper's own stone.

    `fcv1` has 92 × 10 cells; the others have the paper's sheet, 44.5 × 4.5 m in 89 × 9 cells of
    0.5 m. Only its stones collide without loss; the others have a restitution of 0.85, which has
    not been measured. `curling validate` compares any of them with published measurements.

    Parameters
    ----------
    source : the path of an ice file, the name of a preset, the content of an ice file, or an `Ice`,
        which is returned unchanged

    Raises
    ------
    InputError : no such file or preset, a file that does not describe an ice, or anything else
    """
    if isinstance(source, Ice):
        return source
    presets = preset_names()
    if isinstance(source, Mapping):
        return parse_ice(source)
    if not isinstance(source, str | Path):  # pyright: ignore[reportUnnecessaryIsInstance]
        raise InputError(
            f"expected an Ice, an ice file or one of {', '.join(presets)}, got {str(source)[:40]!r}"
        )
    if str(source) in presets:
        return parse_ice(json.loads((_PRESETS / f"{source}.json").read_text(encoding="utf-8")))
    if not Path(source).exists():
        raise InputError(
            f"no such ice file; expected a file or one of {', '.join(presets)}", source=source
        )
    document = read_json(source)
    with placed(source=source):
        return parse_ice(document)


def parse_ice(document: Any) -> Ice:
    """Return the ice that a document describes.

    Parameters
    ----------
    document : content of an ice file

    Raises
    ------
    InputError : it does not describe an ice
    """
    ice = checked(ICE_FORMAT.accept(document), IceDocument)
    sheet = Sheet(length=ice.sheet.length, width=ice.sheet.width, cell_size=ice.friction.cell_size)
    mu = _table(ice.friction.mu, "friction.mu", sheet.shape)
    stone = {k: v for k, v in msgspec.structs.asdict(ice.stone).items() if v is not None}
    return Ice(
        sheet=sheet,
        stone=Stone(**stone),
        friction=FrictionMap(
            mu=mu,
            sigma=_table(ice.friction.sigma, "friction.sigma", mu.shape),
            observed=_table(ice.friction.observed, "friction.observed", mu.shape) > 0,
            interpolation=ice.friction.interpolation,
            level=ice.friction.level and _level_of(ice.friction.level),
        ),
        effects=tuple(_effect_of(effect, f"effects[{i}]") for i, effect in enumerate(ice.effects)),
        provenance=ice.provenance,
    )


def _level_of(level: LevelDocument) -> LevelError:
    with placed(where="friction.level"):
        return LevelError(sigma=level.sigma, common=level.common)


def _effect_of(effect: EffectDocument, where: str) -> ActiveEffect:
    fields: dict[str, Any] = msgspec.structs.asdict(effect)
    fields["sigma"] = {key: value for key, value in effect.sigma.items() if value is not None}
    with placed(where=where):
        return ActiveEffect(**fields)


def _table(value: Any, where: str, shape: tuple[int, ...]) -> Floats:
    """Return rows of numbers, or a table of that shape filled with one given number."""
    if isinstance(value, float | int):
        return np.full(shape, float(value))
    try:
        table = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        table = np.empty(0)
    if table.ndim != 2:
        raise InputError("expected one number, or rows of equal length", where=where)
    return table
