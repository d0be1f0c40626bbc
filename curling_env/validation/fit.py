"""One ice fitted to all published rows of championship ice at once.

The rows contradict each other: a shot that was measured asks for friction that falls with
v^(-0.16), Beijing's films for v^(-1/4), the coaches' rule of six feet for none. So residuals, in
units of each row's own uncertainty, enter by Cauchy's loss: what most rows say decides, and a row
that cannot be met has little weight.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy import optimize  # pyright: ignore[reportMissingTypeStubs]

from curling_env.ice import ActiveEffect, Ice, load_ice
from curling_env.sheet import Sheet
from curling_env.typing import Floats
from curling_env.validation.row import Row
from curling_env.validation.shots import Shots
from curling_env.validation.table import ICE_ROWS

PARAMETERS = ("friction", "exponent", "curl", "spin_drag", "air_drag")
"""Of the law: μ at 1 m/s, how it falls with speed, strength of the curl [m/s²], rate of the spin
drag [rad/s²], coefficient of the drag [1/m]."""
AIR_DRAG, AIR_DRAG_DOUBT = 9.5e-4, 0.3
"""What is believed of the drag, ρ·C_d·A/(2m) [1/m], and its relative uncertainty."""
STARTS = ((1.0, 1.0), (1.0, 1.5), (0.7, 1.0), (0.7, 1.5))
"""Where fits begin: under Cauchy's loss rows that contradict each other make several valleys."""
BEYOND = 20.0
"""Residual of a row that a trial ice gives no value for."""


@dataclass(frozen=True, kw_only=True)
class Fit:
    """An ice fitted to rows.

    Parameters
    ----------
    parameters : of the fitted law, by name
    rows : what it was fitted to
    before, after : (rows,) residuals of the standard ice and of the fitted one
    """

    parameters: dict[str, float]
    rows: Sequence[Row]
    before: Floats
    after: Floats

    def as_text(self) -> str:
        """The fitted law and all residuals, for people."""
        law = ", ".join(f"{name} {value:.4g}" for name, value in self.parameters.items())
        lines = [f"fitted: {law}", "residuals in units of each row's own uncertainty:", ""]
        lines += [
            f"  {before:8.2f} {after:8.2f}  {row.name}"
            for row, before, after in zip(self.rows, self.before, self.after, strict=True)
        ]
        lines += ["", "  standard   fitted"]
        return "\n".join(lines)


def law_ice(
    friction: float, exponent: float, curl: float, spin_drag: float, air_drag: float
) -> Ice:
    """The standard ice with other strengths of its law; see PARAMETERS."""
    base = load_ice("standard")
    strengths = {
        "speed_dependent_friction": {"exponent": exponent},
        "air_drag": {"coefficient": air_drag},
        "curl": {"strength": curl},
        "spin_drag": {"rate": spin_drag},
    }
    effects = tuple(
        ActiveEffect(name=e.name, parameters={**e.parameters, **strengths[e.name]})
        for e in base.effects
    )
    mu = np.full(Sheet().shape, friction)
    return replace(base, friction=replace(base.friction, mu=mu), effects=effects)


def standard_law() -> dict[str, float]:
    """The strengths of the standard ice, by the names of PARAMETERS."""
    base = load_ice("standard")

    def of(effect: str, name: str) -> float:
        found = base.effect(effect)
        assert found is not None  # of the preset
        return found.parameters[name]

    return {
        "friction": float(base.friction.mu[0, 0]),
        "exponent": of("speed_dependent_friction", "exponent"),
        "curl": of("curl", "strength"),
        "spin_drag": of("spin_drag", "rate"),
        "air_drag": of("air_drag", "coefficient"),
    }


def residuals(ice: Ice, rows: Sequence[Row]) -> Floats:
    """Of rows on an ice, in units of their own uncertainty, (rows,)."""
    shots = Shots(ice)
    values = [row.value(shots) for row in rows]
    return np.array(
        [
            BEYOND if value is None else row.residual(value)
            for row, value in zip(rows, values, strict=True)
        ]
    )


def fitted_rows() -> list[Row]:
    """The rows of championship ice, which take part in a fit."""
    return [row for row in ICE_ROWS if row.fitted]


def cost(found: Floats) -> float:
    """Cauchy's loss of residuals, summed."""
    return float(np.log1p(found**2).sum())


def fit_to_rows(
    rows: Sequence[Row] | None = None, *, starts: Sequence[tuple[float, float]] = STARTS
) -> Fit:
    """Fit the law of the standard ice to rows; the best of several beginnings.

    Parameters
    ----------
    rows : those of championship ice by default
    starts : factors on the exponent and the spin drag of the standard ice to begin with
    """
    chosen = fitted_rows() if rows is None else list(rows)
    start = standard_law()
    scale = np.array([0.1 * start[name] for name in PARAMETERS])

    def ice_of(steps: Floats) -> Ice:
        return law_ice(*(float(v) for v in steps * scale))

    def off(steps: Floats) -> Floats:
        drag = math.log(max(steps[-1] * scale[-1], 1e-9) / AIR_DRAG) / AIR_DRAG_DOUBT
        return np.append(residuals(ice_of(steps), chosen), drag)

    solve: Any = optimize.least_squares  # pyright: ignore[reportUnknownMemberType, reportUnknownVariableType]
    found: list[Any] = []
    for exponent, spin_drag in starts:
        begin = np.array([10.0, 10.0 * exponent, 10.0, 10.0 * spin_drag, 10.0])
        found.append(solve(off, begin, loss="cauchy", diff_step=1e-3, bounds=(0.0, np.inf)))
    best = np.asarray(min(found, key=lambda run: run.cost).x, dtype=np.float64)
    return Fit(
        parameters=dict(zip(PARAMETERS, (best * scale).tolist(), strict=True)),
        rows=chosen,
        before=residuals(load_ice("standard"), chosen),
        after=residuals(ice_of(best), chosen),
    )
