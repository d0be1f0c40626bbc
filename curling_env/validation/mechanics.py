"""Values of the rows that need no measurement: closed forms, budgets and scales to keep."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from scipy import integrate, special  # pyright: ignore[reportMissingTypeStubs]

from curling_env.ice import ActiveEffect, Ice, load_ice
from curling_env.physics.contacts import contact_law
from curling_env.physics.law import acceleration
from curling_env.physics.motion import GRAVITY
from curling_env.physics.slides import NO_BOUNDS, slide
from curling_env.physics.state import State
from curling_env.sheet import HOG_TO_FAR_TEE, RULE_BOOK_STONE, Stone
from curling_env.throw import Release, Throw
from curling_env.typing import Floats
from curling_env.validation.collisions import collide
from curling_env.validation.draws import hog_to_hog, metres_per_second
from curling_env.validation.shots import Shots

MU = 0.01
RATIOS = np.geomspace(0.01, 100.0, 81)
"""Speed of the centre over that of the rim; the even number of steps leaves 1 among them."""
CLUSTERS = 200
"""Number of clusters of touching stones, whose collisions are added up."""


def thin_ring(ratio: Floats) -> tuple[Floats, Floats]:
    """Return drag and torque of a thin ring under constant friction, by elliptic integrals.

    Parameters
    ----------
    ratio : (n,) speed of the centre over that of the rim

    Returns
    -------
    F/(μmg) and τ/(μmgr), (n,) each

    Source
    ------
    m = 4ε/(1 + ε)²: F = [(ε − 1)K + (1 + ε)E]/(πε), τ = [(1 − ε)K + (1 + ε)E]/π, both 2/π at 1.
    """
    functions: Any = special
    m = 4 * ratio / (1 + ratio) ** 2
    # Complement 1 − m, which keeps its digits if the rim is as fast as the centre.
    k = functions.ellipkm1(((1 - ratio) / (1 + ratio)) ** 2 + 1e-300)
    e = functions.ellipe(m)
    drag = ((ratio - 1) * k + (1 + ratio) * e) / (np.pi * ratio)
    return drag, ((1 - ratio) * k + (1 + ratio) * e) / np.pi


def off_the_ring(_: Shots) -> float:
    """Return the largest difference of the law's drag and torque from the thin ring's, over all
    ratios.
    """
    stone = RULE_BOOK_STONE
    states = np.zeros((len(RATIOS), 5))
    states[:, 3], states[:, 4] = RATIOS, 1.0 / stone.band_radius
    found = acceleration(Ice.uniform(MU), states)
    drag, torque = thin_ring(RATIOS)
    turning = GRAVITY * stone.mass * stone.band_radius / stone.inertia
    return float(
        max(
            np.abs(-found[:, 1] / (MU * GRAVITY) - drag).max(),
            np.abs(-found[:, 2] / (MU * turning) - torque).max(),
        )
    )


def off_by_scipy(_: Shots) -> float:
    """Return the distance between our rest and that of SciPy's DOP853 on the elliptic integrals
    [m].
    """
    stone, speed, spin = RULE_BOOK_STONE, 1.0, 4.0
    turning = GRAVITY * stone.mass * stone.band_radius / stone.inertia

    def change(_: float, s: Floats) -> list[float]:
        v, w = max(s[1], 1e-9), max(s[2], 1e-9)
        drag, torque = thin_ring(np.array([v / (w * stone.band_radius)]))
        return [s[1], -MU * GRAVITY * float(drag[0]), -MU * turning * float(torque[0])]

    def rests(_: float, s: Floats) -> float:
        return s[1] - 1e-4

    setattr(rests, "terminal", True)  # noqa: B010
    solve: Any = integrate.solve_ivp  # pyright: ignore[reportUnknownMemberType, reportUnknownVariableType]
    run = solve(
        change, (0.0, 100.0), [0.0, speed, spin], "DOP853", events=rests, rtol=1e-10, atol=1e-12
    )
    release = Throw(speed=speed, angle=0.0, spin=spin).release()
    ours = slide(Ice.uniform(MU), release, bounds=NO_BOUNDS)
    return abs(ours.y - release.y - float(run.y[0, -1]))


def spin_decay(_: Shots) -> float:
    """Return the power p of ω ∝ v^p on a band alone, over theory, for a stone that hardly spins."""
    stone, exponent = RULE_BOOK_STONE, 0.25
    falls = ActiveEffect(name="speed_dependent_friction", parameters={"exponent": exponent})
    ice = Ice.uniform(0.008, effects=(falls,))
    bounds = NO_BOUNDS.copy()
    bounds[3] = 0.0
    release = Throw(speed=2.0, angle=0.0, spin=0.2).release()
    run = slide(ice, release, bounds=bounds)
    power = math.log(run.omega / release.omega) / math.log(run.vy / release.vy)
    return power / ((1 - exponent) * stone.spin_coupling / 2)


def energy_of_draw(_: Shots) -> float:
    """Return the work along a draw's path by the law, over the energy at the release, minus one."""
    ice = load_ice("standard")
    per_mass = ice.stone.inertia / ice.stone.mass
    speed = Shots(ice).draw_speed
    path = None if speed is None else Shots(ice).followed(speed, 200.0)
    assert path is not None  # of a preset
    assert path.theta is not None
    t = path.t[:-1]  # the last interval is shorter
    v = np.gradient(path.xy[:-1], t, axis=0, edge_order=2)
    omega = np.gradient(path.theta[:-1], t, edge_order=2)
    states = np.column_stack([path.xy[:-1], v, omega])
    force = acceleration(ice, states)
    power = (force[:, :2] * v).sum(axis=1) + per_mass * force[:, 2] * omega
    energy = 0.5 * (v**2).sum(axis=1) + 0.5 * per_mass * omega**2
    return float((np.trapezoid(power, t) + energy[0] - energy[-1]) / energy[0])


def clusters(_: Shots, what: str) -> float:
    """Return the worst relative violation of conservation over many clusters of colliding stones.

    Parameters
    ----------
    what : momentum, angular momentum (both: change), or energy (gain)
    """
    rng = np.random.default_rng(82)
    stone = RULE_BOOK_STONE
    reach = contact_law(stone).reach
    per_mass = stone.inertia / stone.mass
    worst = 0.0
    for _cluster in range(CLUSTERS):
        stones = np.zeros((3, 6))
        turn = rng.uniform(0.0, 2 * np.pi)
        stones[1, :2] = reach * np.array([np.cos(turn), np.sin(turn)])
        stones[2, :2] = reach * np.array([np.cos(turn + 1.1), np.sin(turn + 1.1)])
        stones[:, State.VX : State.VY + 1] = rng.normal(0.0, 1.0, (3, 2))
        stones[:, State.OMEGA] = rng.normal(0.0, 2.0, 3)
        before = _budget(stones, per_mass)
        change = _budget(collide(stone, stones), per_mass)[what] - before[what]
        size = change if what == "energy" else np.abs(change)
        worst = max(worst, float(size.max()) / max(1e-3, float(before["energy"].max())))
    return worst


def _budget(stones: Floats, per_mass: float) -> dict[str, Floats]:
    xy, v, omega = stones[:, :2], stones[:, State.VX : State.VY + 1], stones[:, State.OMEGA]
    turning = xy[:, 0] * v[:, 1] - xy[:, 1] * v[:, 0] + per_mass * omega
    energy = 0.5 * (v**2).sum() + 0.5 * per_mass * (omega**2).sum()
    return {
        "momentum": v.sum(axis=0),
        "angular momentum": np.array([turning.sum()]),
        "energy": np.array([energy]),
    }


def scaled_world(ice: Ice, length: float, time: float) -> Ice:
    """Return uniform ice scaled in length and time, in which every path looks the same.

    Parameters
    ----------
    ice : uniform ice with at most a power law of friction, air drag, curl and spin drag
    length, time : factors on every length and every time
    """
    n = 0.0
    effects: list[ActiveEffect] = []
    for effect in ice.effects:
        given = dict(effect.parameters)
        if effect.name == "speed_dependent_friction":
            n = given["exponent"]
        elif effect.name == "air_drag":
            given["coefficient"] /= length
        elif effect.name == "curl":
            q = given["speed_exponent"]
            given["strength"] *= length ** (1 - q) / time ** (2 - q)
        elif effect.name == "spin_drag":
            given["rate"] *= (length / time) ** given["speed_exponent"] / time**2
        effects.append(ActiveEffect(name=effect.name, parameters=given))
    stone = ice.stone
    other = Stone(
        radius=stone.radius,
        band_radius=stone.band_radius * length,
        inertia=stone.inertia * length**2,
        mass=stone.mass,
    )
    mu = float(ice.friction.mu[0, 0]) * length ** (1 + n) / time ** (2 + n)
    return Ice.uniform(mu, effects=tuple(effects), stone=other)


def off_in_scaled_world(_: Shots) -> float:
    """Return the largest relative difference of a draw's ends if lengths are scaled by 1.3, times
    by 0.8.

    Distance, curl, time and turns are compared.
    """
    length, time, ice = 1.3, 0.8, load_ice("standard")
    other = scaled_world(ice, length, time)

    def ends(where: Ice, speed: float, spin: float) -> Floats:
        release = Release(x=0.0, y=0.0, vx=0.0, vy=speed, theta=0.0, omega=spin)
        run = slide(where, release, bounds=NO_BOUNDS)
        return np.array([run.x, run.y, run.time, run.theta])

    here = ends(ice, 1.5, 1.0) * [length, length, time, 1.0]
    there = ends(other, 1.5 * length / time, 1.0 / time)
    return float(np.abs(there / here - 1).max())


def metres_by_power_law(_: Shots) -> float | None:
    """Return metres a second, hog to hog, of a draw of 13.0 s under a power law of −¼ alone."""
    falls = ActiveEffect(name="speed_dependent_friction", parameters={"exponent": 0.25})
    ice = Ice.uniform(0.008, effects=(falls,), stone=Stone(band_radius=0.0))
    scaled = Shots(ice).scaled_until(hog_to_hog, 13.0)
    return None if scaled is None else metres_per_second(scaled, to_rest=False)


def drift_over_theory(_: Shots) -> float | None:
    """Return the drift by a slope across Coulomb ice over αD/(2μ)."""
    tilt = 1e-5
    shots = Shots(Ice.uniform(MU, stone=Stone(band_radius=0.0)))
    speed = shots.weight(HOG_TO_FAR_TEE)
    run = None if speed is None else shots.with_effect("slope", x=tilt, y=0.0).run(speed)
    return None if run is None else run.x / (tilt * HOG_TO_FAR_TEE / (2 * MU))
