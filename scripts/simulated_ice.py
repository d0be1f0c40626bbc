"""Ice defined by formulas, with stones as points: friction μ(x, y)·v^(−p), constant spin decay.

Independent of the package, so that the package's results can be compared with it.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from scipy.ndimage import map_coordinates

from curling_env.ice import ActiveEffect, FrictionMap, Ice
from curling_env.sheet import PAPER_SHEET, Stone
from curling_env.typing import Floats

G = 9.80665
HOG, TEE = 10.9725, 17.3735
STEP = 1 / 30
"""Step of the integration [s]."""
MAP_LENGTH = 2.0
"""Correlation length of the errors of a map [m], as in `curling_env.analysis.tuning`."""
GRID = 0.1
"""Spacing of a table of friction [m]."""
POINT_STONE = Stone(band_radius=0.0)


@dataclass(frozen=True, kw_only=True)
class TrueIce:
    """Ice defined by formulas.

    Parameters
    ----------
    mu : mean friction at 1 m/s
    waves : (k, 4) amplitude of ln μ, wave numbers along x and y [1/m], phase
    exponent : friction falls as v^(−exponent)
    curl, curl_exponent, spin_exponent : sideways push curl·v^curl_exponent·(|ω|/1.5)^spin_exponent
        [m/s²]
    drag : loss of spin [rad/s²]
    """

    mu: float = 0.0085
    waves: Floats = field(default_factory=lambda: np.zeros((0, 4)))
    exponent: float = 0.2
    curl: float = 0.0075
    curl_exponent: float = 0.2
    spin_exponent: float = 0.15
    drag: float = 0.01

    @cached_property
    def table(self) -> Floats | None:
        """Return ln μ every `GRID` metres, by y and x; None for ice without a pattern."""
        if not len(self.waves):
            return None
        x, y = np.arange(-3.0, 3.0, GRID), np.arange(-25.0, 30.0, GRID)
        return self.ln_mu(*np.meshgrid(x, y))

    def ln_mu_on_the_way(self, x: Floats, y: Floats) -> Floats | float:
        """Return ln μ at points, interpolated in the table."""
        if self.table is None:
            return float(np.log(self.mu))
        at = np.stack([(y + 25.0) / GRID, (x + 3.0) / GRID])
        return map_coordinates(self.table, at, order=1, mode="nearest")

    def ln_mu(self, x: Floats, y: Floats) -> Floats:
        """Return ln μ at points."""
        total = np.full(np.shape(x), np.log(self.mu))
        for size, along_x, along_y, phase in self.waves:
            total = total + size * np.cos(along_x * x + along_y * y + phase)
        return total

    def as_ice(
        self,
        rng: np.random.Generator | None = None,
        *,
        sigma: float = 0.0,
        curl_sigma: float = 0.0,
    ) -> Ice:
        """Return the ice file that a session on this ice would give.

        Parameters
        ----------
        rng : source of its errors; None for none
        sigma : standard error of ln μ, correlated over two metres as assumed for ice files
        curl_sigma : relative standard error of the curl
        """
        sheet = replace(PAPER_SHEET, cell_size=0.5)
        x, y = np.meshgrid(sheet.x_centres, sheet.y_centres)
        ln_mu, curl = self.ln_mu(x, y), self.curl
        if rng is not None:
            ln_mu = ln_mu + sigma * random_waves(rng, 1.0, length=MAP_LENGTH).ln_mu(x, y)
            curl *= 1 + curl_sigma * rng.standard_normal()
        mu = np.exp(ln_mu)
        return Ice(
            sheet=sheet,
            stone=POINT_STONE,
            friction=FrictionMap(
                mu=mu, sigma=sigma * mu, observed=np.ones(sheet.shape, dtype=np.bool_)
            ),
            effects=(
                ActiveEffect(
                    name="speed_dependent_friction", parameters={"exponent": self.exponent}
                ),
                ActiveEffect(
                    name="curl",
                    parameters={
                        "strength": curl,
                        "speed_exponent": self.curl_exponent,
                        "spin_exponent": self.spin_exponent,
                    },
                    sigma={"strength": abs(self.curl) * curl_sigma} if curl_sigma else {},
                ),
                ActiveEffect(
                    name="spin_drag", parameters={"rate": self.drag, "speed_exponent": 0.0}
                ),
            ),
        )


def random_waves(rng: np.random.Generator, size: float, *, length: float) -> TrueIce:
    """Return an ice of μ 1 whose ln μ varies by `size` over a length [m]."""
    count = 40
    numbers = rng.standard_normal((count, 2)) / length
    waves = np.column_stack(
        [np.full(count, size * (2 / count) ** 0.5), numbers, rng.uniform(0, 2 * np.pi, count)]
    )
    return TrueIce(mu=1.0, waves=waves)


def random_ice(rng: np.random.Generator, *, patterned: float = 0.03) -> TrueIce:
    """Return a random realistic ice.

    Parameters
    ----------
    patterned : spread of ln μ over the sheet
    """
    return replace(
        random_waves(rng, patterned, length=3.0),
        mu=0.0085 * np.exp(0.06 * rng.standard_normal()),
        exponent=rng.uniform(0.1, 0.3),
        curl=rng.uniform(0.005, 0.009),
    )


def believed_of(rng: np.random.Generator, ice: TrueIce, *, off: float = 0.04) -> TrueIce:
    """Return the ice that a team assumes: without a pattern, and with another level and curl.

    Parameters
    ----------
    off : standard deviation of the level's error, in ln; that of the curl is three times as large
    """
    return replace(
        ice,
        waves=np.zeros((0, 4)),
        mu=ice.mu * np.exp(off * rng.standard_normal()),
        curl=ice.curl * np.exp(3 * off * rng.standard_normal()),
    )


@dataclass(frozen=True, kw_only=True)
class Own:
    """Deviations of n throws from the ice, each (n,).

    Parameters
    ----------
    friction, curl : factors
    later, since : another factor of the friction, from that time on [s]
    """

    friction: Floats
    curl: Floats
    later: Floats
    since: Floats


def plain(n: int) -> Own:
    """Return deviations of n throws that have none."""
    return Own(friction=np.ones(n), curl=np.ones(n), later=np.ones(n), since=np.zeros(n))


def slide(ice: TrueIce, throws: Floats, own: Own | None = None) -> tuple[Floats, list[Floats]]:
    """Return the resting places of throws, and their states at every step.

    Parameters
    ----------
    ice : the ice
    throws : (n, 4) speed, angle, spin and x on the hog line; they run along +y
    own : their deviations

    Returns
    -------
    ends : (n, 2) x, y [m]
    states : (n, 6) each: x, y, vx, vy, heading, spin
    """
    own = plain(len(throws)) if own is None else own
    speed, angle, spin, x = throws.T
    state = np.column_stack(
        [
            *(x, np.full(len(x), -HOG)),
            *(-speed * np.sin(angle), speed * np.cos(angle)),
            *(np.zeros(len(x)), spin),
        ]
    )
    states, moving = [state], np.ones(len(x), dtype=bool)
    for step in range(int(60 / STEP)):
        t = step * STEP
        slopes = [_rates(ice, state, own, t)]
        for share in (0.5, 0.5, 1.0):
            slopes.append(_rates(ice, state + share * STEP * slopes[-1], own, t + share * STEP))
        change = STEP / 6 * (slopes[0] + 2 * slopes[1] + 2 * slopes[2] + slopes[3])
        after = state + np.where(moving[:, None], change, 0.0)
        v = np.hypot(after[:, 2], after[:, 3])
        slow = moving & ((v < 0.01) | (after[:, 2] * state[:, 2] + after[:, 3] * state[:, 3] < 0))
        after[slow, 2:4] = 0.0
        after[slow, 5] = 0.0
        moving &= ~slow
        state = after
        states.append(state)
        if not moving.any():
            break
    return state[:, :2].copy(), states


def _rates(ice: TrueIce, state: Floats, own: Own, t: float) -> Floats:
    x, y, vx, vy, _, spin = state.T
    v = np.maximum(np.hypot(vx, vy), 1e-3)
    factor = own.friction * np.where(t >= own.since, own.later, 1.0)
    slow = G * factor * np.exp(ice.ln_mu_on_the_way(x, y)) * v**-ice.exponent
    turning = (np.abs(spin) / 1.5) ** ice.spin_exponent * np.sign(spin)
    left = own.curl * ice.curl * v**ice.curl_exponent * turning
    return np.column_stack(
        [
            vx,
            vy,
            (-slow * vx - left * vy) / v,
            (-slow * vy + left * vx) / v,
            spin,
            -ice.drag * np.sign(spin),
        ]
    )


def seen_rests(ice: TrueIce, throws: Floats, own: Own | None = None) -> Floats:
    """Return resting places, right of the centre line and past the tee, (n, 2) [m]."""
    return slide(ice, throws, own)[0] - [0.0, TEE]


def aimed(ice: TrueIce, targets: Floats, spins: Floats, x: Floats) -> Floats:
    """Return throws (n, 4) that rest at targets (n, 2) on an ice, by Newton's method."""
    throws = np.column_stack([np.full(len(x), 2.2), np.zeros(len(x)), spins, x])
    for _ in range(12):
        steps = np.diag([0.01, 0.002, 0.0, 0.0])
        stacked = np.concatenate([throws, throws + steps[0], throws + steps[1]])
        now, faster, turned = np.split(seen_rests(ice, stacked), 3)
        slopes = np.stack([(faster - now) / 0.01, (turned - now) / 0.002], axis=2)
        change = np.linalg.solve(slopes, (targets - now)[..., None])[..., 0]
        throws[:, :2] += np.clip(change, -0.3, 0.3)
        throws[:, 0] = np.clip(throws[:, 0], 0.5, 4.0)
        if np.abs(targets - now).max() < 1e-4:
            break
    return throws
