"""Friction by matching trajectories: all throws and all cells at once.

Each throw rides its measured course (course.py) under the force law (ride.py). Its start and speed
are its own and are projected out; what is left of the residuals is explained by the friction of
the cells, jointly for all throws, under a smooth prior (prior.py) and with noise estimated from
the residuals (noise.py). The ride is exact and is repeated about each new estimate (Gauss–Newton).

Source
------
Differentiating a track and averaging per cell loses a factor 2 to 18 against this; a joint fit
reaches the Cramér–Rao bound (bound.py). Effects of the starting ice stay in the law throughout.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from curling_env.ice import FrictionMap, Ice
from curling_env.physics.law import acceleration
from curling_env.sheet import Sheet
from friction_estimation.camera_bias import NO_BIAS, USUAL_RIPPLE, CameraBias, bias_over
from friction_estimation.inversion.bias_search import (
    CLEAR_GAIN,
    CLEAR_LIKENESS,
    LEAST_RIPPLE,
    LEAST_THROWS,
    LEAST_VARIETY,
    BiasSearch,
    likeness,
    seen_from,
    split_throws,
    variety,
)
from friction_estimation.inversion.course import lay_course
from friction_estimation.inversion.knowledge import Knowledge
from friction_estimation.inversion.noise import Noise, estimate_noise
from friction_estimation.inversion.prior import Belief, Evidence, Posterior, uniform_posterior
from friction_estimation.inversion.refit import SMALL, FreeEffects, free_effects, with_rivals
from friction_estimation.inversion.ride import Passenger, Ride, Track, sensitivities
from friction_estimation.inversion.shared_error import SharedError, nodes_of, shared_error
from friction_estimation.inversion.spin import USUAL_SPIN, fit_spin, shows_heading
from friction_estimation.kinematics import FreeSlide, smooth_motion

Floats = NDArray[np.float64]
Progress = Callable[[str, float], None]
"""Called with what is being done and the part of it that is done, 0 to 1."""
CameraBiasChoice = Literal["auto", "on", "off"]

UNIFORM_ROUNDS, MAP_ROUNDS, REFIT_ROUNDS, BIAS_ROUNDS = 8, 4, 6, 5
"""Gauss–Newton rounds at most; the path is nearly linear in ln μ and two to four are enough, in
the parameters of effects less so."""
LONGEST_STEP = 0.7
"""Largest change of ln μ in one round: a factor 2."""
CONVERGED = 2e-4
"""Change of ln μ, in its standard errors or absolutely, below which a fit is done."""
SLOW_NOISE_MAP = 0.5
"""Longest correlation time of noise beside a map [s]: what lasts longer belongs to the ice."""


def _silent(_what: str, _part: float) -> None:
    pass


@dataclass(frozen=True, kw_only=True)
class Ridden:
    """One throw as it was fitted.

    Parameters
    ----------
    slide : the rows of its track
    passenger : course, spin and the rest that its ride needs
    measured : (k,) distance of each row along the course [m]
    scale : (k,) noise of each row relative to the common noise
    start, speed : fitted distance and speed at the first row [m, m/s]
    offset : its own departure in ln μ
    turn_seen : whether its heading told its spin; else the usual one is taken
    shift : (k,) by which the camera's ripple displaces each row along the course [m]
    keep : (k,) rows that agree with the noise
    left : (k,) measured minus ridden and displaced distance [m]
    """

    slide: FreeSlide
    passenger: Passenger
    measured: Floats
    scale: Floats
    start: float
    speed: float
    offset: float = 0.0
    turn_seen: bool = True
    shift: Floats
    keep: NDArray[np.bool_]
    left: Floats

    @property
    def t(self) -> Floats:
        """Times of the rows since the first [s]."""
        return self.slide.t - self.slide.t[0]


@dataclass(frozen=True, kw_only=True)
class Fit:
    """What a trajectory fit found.

    Parameters
    ----------
    ice : the estimate, effects of the start kept or refitted
    mu, sigma : level of μ over the crossed cells and its standard error
    scatter : standard deviation of ln μ from throw to throw
    noise : of a measured distance
    throws : as fitted
    resolved : independent numbers that the data determine in the map; 1 for a uniform ice
    knowledge : what the throws told, for later throws to add to; holds the prior's hyperparameters
    bias_search : what came of looking for a ripple of the camera; None where nobody looked
    """

    ice: Ice
    mu: float
    sigma: float
    scatter: float
    noise: Noise
    throws: tuple[Ridden, ...]
    resolved: float
    knowledge: Knowledge
    bias_search: BiasSearch | None = None


def fit_trajectories(
    slides: Sequence[FreeSlide],
    start: Ice,
    *,
    uniform: bool = False,
    scatter: bool = True,
    prior: FrictionMap | None = None,
    before: Knowledge | None = None,
    refit: bool = False,
    camera_bias: CameraBiasChoice = "off",
    progress: Progress = _silent,
) -> Fit:
    """Estimate the friction of an ice from the free slides of its throws.

    Parameters
    ----------
    slides : in order of play
    start : sheet, stone, effects and a first guess of the friction
    uniform : whether one μ is wanted instead of a map
    scatter : whether each throw may have a μ of its own about the ice's
    prior : an earlier map of this sheet: the pattern of its mu holds within its sigma and what
        the throws show to have changed; its level is not held to
    before : what earlier throws on the ice told: these throws are added to them
    refit : whether the strengths of the effects that act along the travel are fitted with the map
    camera_bias : whether a ripple of the camera is fitted with the map: ``auto``, if the throws
        clearly show one; ``on``, if they could show one; ``off``
    progress : told how far the fit is
    """
    # The matrices are too small to share: threads of the linear algebra only wait for each other.
    with threadpool_limits(limits=1, user_api="blas"):
        return _fit(slides, start, uniform, scatter, prior, before, refit, camera_bias, progress)


def _fit(
    slides: Sequence[FreeSlide],
    start: Ice,
    uniform: bool,
    scatter: bool,
    prior: FrictionMap | None,
    before: Knowledge | None,
    refit: bool,
    camera_bias: CameraBiasChoice,
    progress: Progress,
) -> Fit:
    track = Track(start)
    played = 0 if before is None else before.throws
    throws = [_board(slide, played + order) for order, slide in enumerate(slides)]
    level = float(np.median([_first_level(throw, start) for throw in throws]))
    one = _fit_level(throws, track, level, scatter, before if uniform else None, progress)
    if uniform:
        mu = float(np.exp(one.level))
        shared = _shared_by_level(one, track, before)
        sigma = one.sigma
        if shared is not None:
            weights = 1.0 / (1.0 / one.information + one.scatter**2)
            share = (weights / weights.sum()) @ (shared / one.information[:, None])
            sigma = float(np.hypot(sigma, np.linalg.norm(share)))
        friction = FrictionMap.uniform(mu, start.sheet, sigma=mu * sigma)
        return Fit(
            ice=replace(start, friction=friction),
            mu=mu,
            sigma=mu * sigma,
            scatter=one.scatter,
            noise=one.noise,
            throws=tuple(one.throws),
            resolved=1.0,
            knowledge=Knowledge(
                reference=0.0,
                cells=np.empty(0, dtype=np.intp),
                information=np.diag(one.information),
                pull=one.pull,
                observed=friction.observed,
                mu=friction.mu,
                noise=one.noise,
                belief=None,
                shared=shared,
            ),
        )
    observed = crossed_cells(one.throws, start)
    shape = start.sheet.shape
    ground = np.zeros(shape[0] * shape[1])
    known: Floats | None = None
    level = one.level
    if prior is not None:
        ground = np.log(prior.mu.ravel())
        ground -= ground[observed.ravel()].mean()
        known = (prior.sigma / prior.mu).ravel()
    if before is not None:
        observed = observed | before.observed
        level = before.reference
        ground = ground if before.ground is None else before.ground
        known = before.known
    sought = Sought(level=level, ground=ground, known=known, observed=observed, before=before)
    nothing = FreeEffects(ice=start, values=np.empty(0))
    free = free_effects(start, one.throws) if refit else nothing
    found = _fit_map(one.throws, track, sought, one.noise, scatter, free, progress)
    search: BiasSearch | None = None
    if camera_bias != "off":
        found, search = _search_bias(found, sought, scatter, camera_bias == "on", progress)
    throws, noise, posterior = found.throws, found.noise, found.posterior
    free, evidence = found.free, found.evidence
    shared = _shared_by_map(found, sought)
    if shared is not None:
        posterior = evidence.blurred(posterior, shared, observed.ravel())
    information, pull, shared = evidence.without_effects(free.values, posterior.belief, shared)
    cells = np.exp(level + posterior.field.reshape(shape))
    friction = replace(
        start.friction,
        mu=cells,
        sigma=cells * posterior.field_sigma.reshape(shape),
        observed=observed,
    )
    mu = float(np.exp(level + posterior.level))
    return Fit(
        ice=replace(start, friction=friction, effects=free.fitted(posterior.effects_sigma)),
        mu=mu,
        sigma=mu * posterior.level_sigma,
        scatter=posterior.belief.scatter,
        noise=noise,
        throws=tuple(throws),
        resolved=posterior.resolved,
        knowledge=Knowledge(
            reference=level,
            cells=evidence.cells,
            information=information,
            pull=pull,
            observed=observed,
            mu=cells,
            noise=noise,
            belief=replace(posterior.belief, ripple=0.0),  # the next session's camera is another
            ground=None if known is None else ground,
            known=known,
            shared=shared,
        ),
        bias_search=search,
    )


def crossed_cells(throws: Sequence[Ridden], ice: Ice) -> NDArray[np.bool_]:
    """Cells that a stone's centre crossed while it was measured, (rows, columns)."""
    observed = np.zeros(ice.sheet.shape, dtype=np.bool_)
    for throw in throws:
        reached = throw.measured[throw.keep]
        on_way = np.arange(reached.min(), reached.max(), 0.02)
        observed[ice.sheet.cell_of(throw.passenger.course.at(on_way))] = True
    return observed


# --- one throw -----------------------------------------------------------------------------------


def _board(slide: FreeSlide, order: int) -> Ridden:
    """A throw with its course laid, and first values of its start, speed and spin."""
    course, measured = lay_course(slide)
    t = slide.t - slide.t[0]
    early = max(int(np.searchsorted(t, 3.0)), 8)
    fit = np.polynomial.polynomial.polyfit(t[:early], measured[:early], 2)
    # A track's sigma_xy holds what all frames share (pose, lens, outline), which is no weight
    # between frames: every frame weighs alike, and the noise is learnt from the residuals.
    scale = np.ones(len(t))
    spin, power, speed, heading = fit_spin(slide)
    turn_seen = shows_heading(slide)
    if not turn_seen:
        spin = USUAL_SPIN
    passenger = Passenger(
        course=course,
        duration=float(t[-1]),
        spin=spin,
        spin_power=power,
        spin_speed=speed,
        heading=heading,
        clock=slide.track.clock + float(slide.t[0]),
        order=order,
        stone=slide.track.stone,
        sweeps=swept_intervals(t, slide.track.swept[slide.rows]),
    )
    return Ridden(
        slide=slide,
        passenger=passenger,
        measured=measured,
        scale=scale,
        start=float(fit[0]),
        speed=float(fit[1]),
        shift=np.zeros(len(t)),
        turn_seen=turn_seen,
        keep=np.ones(len(t), dtype=np.bool_),
        left=np.zeros(len(t)),
    )


def swept_intervals(t: Floats, swept: Floats) -> Floats:
    """Beginnings and ends of sweeping, (k, 2) [s], from flags per row."""
    flags = np.concatenate([[0], (swept > 0.5).astype(int), [0]])
    edges = np.diff(flags)
    first, last = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    ends = np.append(t, t[-1] + 1.0)
    return np.column_stack([t[first], ends[last]]) if len(first) else np.empty((0, 2))


def _first_level(throw: Ridden, ice: Ice) -> float:
    """Logarithm of μ of one throw from its smoothed deceleration, under the law of the ice."""
    slide = throw.slide
    motion = smooth_motion(slide.t, slide.xy, window=3.0)
    rows = np.flatnonzero(motion.speed > 0.4 * motion.speed.max())[::5]
    heading = throw.passenger.course.heading_at(throw.measured[rows])
    states = np.column_stack(
        [slide.xy[rows], motion.speed[rows, None] * heading, np.full(len(rows), 0.0)]
    )
    one, two = (
        (acceleration(_flat(ice, mu), states)[:, :2] * heading).sum(axis=1) for mu in (0.01, 0.02)
    )
    mu = 0.01 * (1.0 + (motion.acceleration[rows] - one) / (two - one))
    return float(np.log(np.clip(np.median(mu), 5e-4, 0.2)))


def _flat(ice: Ice, mu: float) -> Ice:
    return replace(ice, friction=FrictionMap.uniform(mu, ice.sheet))


@dataclass(frozen=True, kw_only=True)
class _Linear:
    """A throw linearised about its ride, whitened, its start and speed projected out.

    `volume` is 2·ln of the density that noise and release spread out over.
    """

    crossed: NDArray[np.intp]
    friction: Floats
    left: Floats
    effects: Floats
    release_root: Floats
    release_left: Floats
    release_friction: Floats
    release_effects: Floats
    volume: float

    def release_step(self, change: Floats, effects: Floats | None = None) -> Floats:
        """Change of start and speed that goes with a change of ln μ in the crossed cells.

        `effects` is the change of the free parameters, if there are any.
        """
        goal = self.release_left - self.release_friction @ change
        if effects is not None:
            goal = goal - self.release_effects @ effects
        return np.asarray(np.linalg.solve(self.release_root, goal), dtype=np.float64)


def _ride(throw: Ridden, track: Track, gate: Noise) -> tuple[Ridden, Ride]:
    """The throw ridden once more, its residuals and good rows up to date."""
    ride = track.ride(throw.passenger, throw.start, throw.speed, throw.offset)
    left = throw.measured - throw.shift - ride.distance_at(throw.t)
    keep = gate.keep(throw.t, left, throw.scale)
    if keep.sum() < 0.5 * len(keep):  # the path is still far off: nothing can be called wild yet
        keep = np.ones(len(keep), dtype=np.bool_)
    return replace(throw, left=left, keep=keep), ride


def _bent(throw: Ridden, ride: Ride, track: Track, free: FreeEffects) -> Floats:
    """How the distance of each row responds to the free parameters, (k, p)."""
    columns = np.empty((len(throw.t), len(free)))
    here = ride.distance_at(throw.t)
    for k in range(len(free)):
        other = track.under(free.nudged(k))
        moved = other.ride(throw.passenger, throw.start, throw.speed, throw.offset)
        columns[:, k] = (moved.distance_at(throw.t) - here) / SMALL
    return columns


def _linearise(
    throw: Ridden,
    ride: Ride,
    track: Track,
    noise: Noise,
    free: FreeEffects | None = None,
    bias: CameraBias = NO_BIAS,
) -> _Linear:
    """`effects` of what comes back are the free parameters and the nodes of the camera's bias."""
    cells, weights = track.cell_weights(throw.passenger.course.at(ride.distance))
    shares = weights * track.mu.ravel()[cells]
    shares /= shares.sum(axis=1, keepdims=True)
    crossed, release, friction = sensitivities(ride, cells, shares)
    columns = ride.tangents_at(np.hstack([release, friction]), throw.t)
    bent = np.empty((len(throw.t), 0)) if free is None else _bent(throw, ride, track, free)
    seen = bias.seen_along(throw.passenger.course, throw.measured)
    columns = np.column_stack([throw.left, columns, bent, seen])
    white = noise.whiten(throw.t, columns, throw.scale, throw.keep)
    q, root = np.linalg.qr(white[:, 1:3])
    clear = white - q @ (q.T @ white)
    cut = 3 + len(crossed)
    return _Linear(
        crossed=crossed,
        friction=clear[:, 3:cut],
        left=clear[:, 0],
        effects=clear[:, cut:],
        release_root=root,
        release_left=q.T @ white[:, 0],
        release_friction=q.T @ white[:, 3:cut],
        release_effects=q.T @ white[:, cut:],
        volume=noise.volume(throw.t, throw.scale, throw.keep)
        + 2.0 * float(np.log(np.abs(np.diag(root))).sum()),
    )


def _residuals(throws: Sequence[Ridden]) -> list[tuple[Floats, Floats, Floats]]:
    return [(k.t[k.keep], k.left[k.keep], k.scale[k.keep]) for k in throws]


# --- all throws ----------------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class _One:
    """One μ for the sheet: its logarithm, standard error, the scatter, and what told them."""

    throws: list[Ridden]
    noise: Noise
    level: float
    sigma: float
    scatter: float
    information: Floats
    pull: Floats


def _fit_level(
    throws: list[Ridden],
    track: Track,
    level: float,
    scatter: bool,
    before: Knowledge | None,
    progress: Progress,
) -> _One:
    """One μ for the sheet, together with the throws that were fitted before."""
    # Nothing is known of the noise while the path may be off by metres.
    noise = Noise(white=float(np.median([throw.slide.noise for throw in throws])))
    gate = Noise(white=noise.white, slow=1.0, time=5.0)
    old = 0 if before is None else before.throws
    information, pull = np.empty(old + len(throws)), np.empty(old + len(throws))
    if before is not None:
        information[:old], pull[:old] = np.diag(before.information), before.pull
    sigma, spread = 1.0, 0.0
    for number in range(UNIFORM_ROUNDS):
        track.set_level(level)
        linear: list[_Linear] = []
        for k, throw in enumerate(throws):
            throws[k], ride = _ride(throw, track, gate)
            linear.append(_linearise(throws[k], ride, track, noise))
            own = linear[k].friction.sum(axis=1)
            information[old + k] = own @ own
            pull[old + k] = own @ linear[k].left + own @ own * (level + throw.offset)
        found, sigma, spread = uniform_posterior(information, pull, scatter=scatter)
        step = float(np.clip(found - level, -LONGEST_STEP, LONGEST_STEP))
        level += step
        worst = 0.0
        for k, throw in enumerate(throws):
            told = information[old + k]
            shrink = spread**2 / (spread**2 + 1.0 / told)
            offset = shrink * (pull[old + k] / told - found)
            offset = float(np.clip(offset, -LONGEST_STEP, LONGEST_STEP))
            change = np.full(len(linear[k].crossed), step + offset - throw.offset)
            worst = max(worst, abs(change[0]))
            throws[k] = _moved(throws[k], linear[k].release_step(change), offset)
        progress("one friction for the sheet", (number + 1) / UNIFORM_ROUNDS)
        if abs(step) > 0.05:
            continue
        for k, throw in enumerate(throws):
            throws[k], _ = _ride(throw, track.set_level(level), gate)
        last = noise
        noise = gate = estimate_noise(_residuals(throws), slowest=5.0)
        settled = abs(np.log(noise.total / last.total)) < 0.02
        if settled and worst < CONVERGED and abs(step) < max(0.05 * sigma, 1e-6):
            break
    return _One(
        throws=throws,
        noise=noise,
        level=level,
        sigma=sigma,
        scatter=spread,
        information=information,
        pull=pull,
    )


@dataclass(frozen=True, kw_only=True)
class Sought:
    """The map that is sought, and what is known of it before these throws.

    Parameters
    ----------
    level : ln μ from which the map counts
    ground : (cells,) of ln μ above the level, about which it is believed to vary
    known : (cells,) its relative standard error; None where it is not a measured one
    observed : (rows, columns) cells that any throw crossed
    before : what earlier throws told
    """

    level: float
    ground: Floats
    known: Floats | None
    observed: NDArray[np.bool_]
    before: Knowledge | None

    @property
    def played(self) -> int:
        """How many throws are in what was told before."""
        return 0 if self.before is None else self.before.throws


@dataclass(frozen=True, kw_only=True)
class _Mapped:
    """A map as it was fitted, and what it was fitted with."""

    throws: list[Ridden]
    track: Track
    field: Floats
    noise: Noise
    posterior: Posterior
    evidence: Evidence
    free: FreeEffects
    bias: CameraBias = NO_BIAS


def _fit_map(
    throws: list[Ridden],
    track: Track,
    sought: Sought,
    gate: Noise,
    scatter: bool,
    free: FreeEffects,
    progress: Progress,
) -> _Mapped:
    """The map of ln μ about the level, jointly with an offset of each throw and free effects."""
    before, level = sought.before, sought.level
    throws = list(throws)
    field = sought.ground if before is None else np.log(before.mu.ravel()) - level
    track.set_field(level, field)
    # The rows of a smoothed track differ by far less than they err: what one friction for the sheet
    # leaves of them is the first measure of their noise, and a map may not explain it all.
    if gate.spacing > 0.0:
        noise = Noise(white=gate.total, spacing=gate.spacing)
    else:
        noise = Noise(white=float(np.median([throw.slide.noise for throw in throws])))
    scatter = scatter and sought.played + len(throws) >= 3
    belief = None if before is None else before.belief
    mapped: _Mapped | None = None
    rounds = REFIT_ROUNDS if len(free) else MAP_ROUNDS
    for number in range(rounds):
        linear = _linearise_all(throws, track, gate, noise, free, NO_BIAS)
        evidence = _gather(linear, throws, field, track, sought, free, NO_BIAS)
        final = number == rounds - 1
        if belief is None:
            belief = evidence.first_belief(scatter=scatter)
        elif final:
            belief = evidence.best_belief(belief, scatter=scatter)
        mapped = _step(linear, evidence, belief, throws, track, field, sought, free, NO_BIAS, noise)
        throws, track, field, free = mapped.throws, mapped.track, mapped.field, mapped.free
        for k, throw in enumerate(throws):
            throws[k], _ = _ride(throw, track, gate)
        progress("the friction map", (number + 1) / rounds)
        # After one round the path is still bent by its first linearisation: no noise yet.
        if 0 < number < rounds - 1:
            noise = estimate_noise(_residuals(throws), slowest=SLOW_NOISE_MAP, start=noise)
            gate = noise
    assert mapped is not None
    return mapped


def _search_bias(
    without: _Mapped, sought: Sought, scatter: bool, must: bool, progress: Progress
) -> tuple[_Mapped, BiasSearch]:
    """A ripple of the camera, looked for from the map that was fitted without one.

    Parameters
    ----------
    must : whether a ripple is fitted even where it is not clear that there is one

    Returns
    -------
    the map with the ripple, or the one without where none is fitted; and what came of it
    """
    throws, belief = without.throws, without.posterior.belief
    apart = _variety(throws)
    if len(throws) < LEAST_THROWS or apart < LEAST_VARIETY:
        return without, BiasSearch(outcome="inseparable", variety=apart)
    bias = bias_over([k.passenger.course.at(k.measured[k.keep])[:, 1] for k in throws])
    other = _fit_bias(without, bias, sought, scatter, progress)
    if other is None:
        usual = _beside_rivals(without, bias, [without.noise], sought)[0].all()
        clear_from = seen_from(usual, belief)
        return without, BiasSearch(outcome="none", variety=apart, seen_from=clear_from)
    # A noise that was estimated beside a ripple may favour it, so that a map without one is also
    # tried with that.
    now, usual = _beside_rivals(other, other.bias, [other.noise, without.noise], sought,
                                without.throws)  # fmt: skip
    found = other.posterior.belief
    evidence, before = now.all(), usual.all()
    plain = evidence.best_belief(replace(found, ripple=0.0), scatter=found.scatter > 0.0)
    best = min(evidence.misfit(plain) + evidence.constant, before.misfit(belief) + before.constant)
    gain = best - evidence.misfit(found) - evidence.constant
    declined = BiasSearch(
        outcome="none", variety=apart, seen_from=seen_from(evidence, found), gain=gain
    )
    if gain < CLEAR_GAIN and not must:
        return without, declined
    halves = split_throws(np.array([k.speed for k in now.throws]), _directions(now.throws))
    like = likeness(evidence, [now.of(half) for half in halves], found)
    if like < CLEAR_LIKENESS and not must:
        return without, replace(declined, likeness=like)
    return other, replace(declined, outcome="found", likeness=like, bias=other.bias)


def _fit_bias(
    without: _Mapped, bias: CameraBias, sought: Sought, scatter: bool, progress: Progress
) -> _Mapped | None:
    """Map and ripple of the camera together, from the map without one; None if there is none."""
    throws, track, field = list(without.throws), without.track, without.field
    free, noise = without.free, without.noise
    gate = noise
    scatter = scatter and sought.played + len(throws) >= 3
    belief: Belief | None = None
    mapped: _Mapped | None = None
    for number in range(BIAS_ROUNDS):
        linear = _linearise_all(throws, track, gate, noise, free, bias)
        evidence = _gather(linear, throws, field, track, sought, free, bias)
        if belief is None:
            near = replace(without.posterior.belief, ripple=USUAL_RIPPLE)
            belief = evidence.best_belief(near, scatter=scatter, coarse=True)
            if belief.ripple >= LEAST_RIPPLE:
                belief = evidence.first_belief(scatter=scatter, ripple=USUAL_RIPPLE)
        else:
            final = number == BIAS_ROUNDS - 1
            belief = evidence.best_belief(belief, scatter=scatter, coarse=not final)
        if belief.ripple < LEAST_RIPPLE:
            return None
        mapped = _step(linear, evidence, belief, throws, track, field, sought, free, bias, noise)
        throws, track, field = mapped.throws, mapped.track, mapped.field
        free, bias = mapped.free, mapped.bias
        for k, throw in enumerate(throws):
            throws[k], _ = _ride(throw, track, gate)
        progress("a ripple of the camera", (number + 1) / BIAS_ROUNDS)
        if number < BIAS_ROUNDS - 1:
            noise = gate = estimate_noise(_residuals(throws), slowest=SLOW_NOISE_MAP, start=noise)
    return mapped


def _directions(throws: Sequence[Ridden]) -> Floats:
    """Signs of the throws' travel along the sheet."""
    return np.array([np.sign(throw.passenger.course.heading[0, 1]) for throw in throws])


def _variety(throws: Sequence[Ridden]) -> float:
    """How unlike the throws passed the same places; see `bias_search.variety`."""
    places: list[Floats] = []
    squares: list[Floats] = []
    for throw, way in zip(throws, _directions(throws), strict=True):
        ridden = throw.measured - throw.left
        onward = slice(None, None, int(way))
        places.append(throw.passenger.course.at(ridden)[onward, 1])
        squares.append(way * np.gradient(ridden, throw.t)[onward] ** 2)
    return variety(places, squares)


@dataclass(frozen=True, kw_only=True)
class _Witnesses:
    """Throws linearised with a camera's bias free, and effects that bend throws in a like way."""

    throws: Sequence[Ridden]
    linear: Sequence[_Linear]
    mapped: _Mapped
    sought: Sought
    free: FreeEffects
    bias: CameraBias

    def all(self) -> Evidence:
        """What all throws say."""
        return self._gathered(range(len(self.throws)), self.sought)

    def of(self, rows: Sequence[int]) -> Evidence:
        """What some of them say, forgetting earlier ones."""
        return self._gathered(rows, replace(self.sought, before=None))

    def _gathered(self, rows: Sequence[int], sought: Sought) -> Evidence:
        return _gather(
            [self.linear[k] for k in rows], [self.throws[k] for k in rows], self.mapped.field,
            self.mapped.track, sought, self.free, self.bias,
        )  # fmt: skip


def _beside_rivals(
    mapped: _Mapped,
    bias: CameraBias,
    noises: Sequence[Noise],
    sought: Sought,
    others: Sequence[Ridden] | None = None,
) -> list[_Witnesses]:
    """The throws of a map as witnesses for a ripple of the camera, once for each noise.

    All are judged by the same rows: those kept here and, where `others` are given, there.
    """
    free = with_rivals(mapped.free, mapped.throws)
    pairs = zip(mapped.throws, others or mapped.throws, strict=True)
    throws = [replace(k, keep=k.keep & j.keep) for k, j in pairs]
    rides = [mapped.track.ride(k.passenger, k.start, k.speed, k.offset) for k in throws]
    spacing = max(noise.spacing for noise in noises)
    return [
        _Witnesses(
            throws=throws,
            linear=[
                _linearise(k, ride, mapped.track, replace(noise, spacing=spacing), free, bias)
                for k, ride in zip(throws, rides, strict=True)
            ],
            mapped=mapped,
            sought=sought,
            free=free,
            bias=bias,
        )
        for noise in noises
    ]


def _linearise_all(
    throws: list[Ridden],
    track: Track,
    gate: Noise,
    noise: Noise,
    free: FreeEffects,
    bias: CameraBias,
) -> list[_Linear]:
    """All throws linearised; `throws` are brought up to date."""
    linear: list[_Linear] = []
    for k, throw in enumerate(throws):
        throws[k], ride = _ride(throw, track, gate)
        linear.append(_linearise(throws[k], ride, track, noise, free, bias))
    return linear


def _step(
    linear: Sequence[_Linear],
    evidence: Evidence,
    belief: Belief,
    throws: Sequence[Ridden],
    track: Track,
    field: Floats,
    sought: Sought,
    free: FreeEffects,
    bias: CameraBias,
    noise: Noise,
) -> _Mapped:
    """One Gauss–Newton step of map, offsets, effects, bias and releases."""
    posterior = evidence.posterior(belief, sought.observed.ravel())
    change = posterior.field - field
    limit = min(1.0, LONGEST_STEP / max(float(np.abs(change).max()), 1e-9))
    effects = limit * (posterior.effects - free.values)
    ripple = limit * (posterior.ripple - bias.values)
    bias = replace(bias, values=bias.values + ripple, sigma=posterior.ripple_sigma)
    others = np.concatenate([effects, ripple])
    moved: list[Ridden] = []
    for k, throw in enumerate(throws):
        offset = throw.offset + limit * (posterior.offsets[sought.played + k] - throw.offset)
        own = limit * change[linear[k].crossed] + offset - throw.offset
        after = _moved(throw, linear[k].release_step(own, others), float(offset))
        seen = bias.seen_along(throw.passenger.course, throw.measured)
        moved.append(replace(after, shift=seen @ bias.values))
    field = field + limit * change
    free = free.at(free.values + effects)
    return _Mapped(
        throws=moved,
        track=track.under(free.now).set_field(sought.level, field),
        field=field,
        noise=noise,
        posterior=posterior,
        evidence=evidence,
        free=free,
        bias=bias,
    )


def _gather(
    linear: Sequence[_Linear],
    throws: Sequence[Ridden],
    field: Floats,
    track: Track,
    sought: Sought,
    free: FreeEffects,
    bias: CameraBias,
) -> Evidence:
    """Normal equations of all throws in the cells crossed, the throws' offsets, free effects and
    the nodes of the camera's bias.
    """
    before = sought.before
    cells = [part.crossed for part in linear]
    crossed = np.unique(np.concatenate(cells if before is None else [before.cells, *cells]))
    m = len(crossed)
    played = sought.played
    throw_end = m + played + len(linear)
    size = throw_end + len(free) + len(bias)
    information, pull = np.zeros((size, size)), np.zeros(size)
    asked = 0.0
    if before is not None:
        places = np.append(np.searchsorted(crossed, before.cells), m + np.arange(played))
        information[np.ix_(places, places)] = before.information
        pull[places] = before.pull
    for k, part in enumerate(linear):
        own = np.append(np.searchsorted(crossed, part.crossed), m + played + k)
        places = np.append(own, np.arange(throw_end, size))
        columns = np.column_stack([part.friction, part.friction.sum(axis=1), part.effects])
        present = np.concatenate(
            [field[part.crossed], [throws[k].offset], free.values, bias.values]
        )
        square = columns.T @ columns
        information[np.ix_(places, places)] += square
        pull[places] += columns.T @ part.left + square @ present
        goal = part.left + columns @ present
        asked += float(goal @ goal) + part.volume
    return Evidence(
        information, pull, crossed, track.ice.sheet, ground=sought.ground, known=sought.known,
        effects=len(free), nodes=bias.nodes, asked=asked,
    )  # fmt: skip


def _stated(throws: Sequence[Ridden], sheet: Sheet, noise: Noise) -> SharedError | None:
    """What the tracks say to err by together."""
    stated = [k.slide.track.sigma_xy for k in throws]
    return shared_error(
        sheet,
        [k.passenger.course.at(k.measured)[:, 1] for k in throws],
        [
            sigma[k.slide.rows] if sigma.size else sigma
            for k, sigma in zip(throws, stated, strict=True)
        ],
        noise.total,
    )


def _seen_together(
    throw: Ridden, ride: Ride, track: Track, noise: Noise, error: SharedError | None
) -> Floats:
    """How a throw's whitened rows respond to what all throws err by together, (rows, n + 1).

    The last column is the turn of a stone whose heading was not seen: it is taken to be the usual
    one, and as likely as not to be none.
    """
    nodes = nodes_of(track.ice.sheet)
    bent = np.zeros(len(throw.t))
    if not throw.turn_seen:
        still = replace(throw.passenger, spin=0.0)
        other = track.ride(still, throw.start, throw.speed, throw.offset)
        bent = other.distance_at(throw.t) - ride.distance_at(throw.t)
    basis = NO_BIAS if error is None else error.basis
    part = _linearise(replace(throw, left=bent), ride, track, noise, None, basis)
    if error is None:
        return np.column_stack([np.zeros((len(part.left), len(nodes))), part.left])
    return np.column_stack([part.effects @ error.root, part.left])


def _shared_by_level(one: _One, track: Track, before: Knowledge | None) -> Floats | None:
    """Pull of what all throws err by together on each throw's ln μ, (throws, n) for n units."""
    error = _stated(one.throws, track.ice.sheet, one.noise)
    told = None if before is None else before.shared
    if told is None and error is None and all(throw.turn_seen for throw in one.throws):
        return None
    rows: list[Floats] = []
    for throw in one.throws:
        ride = track.ride(throw.passenger, throw.start, throw.speed, throw.offset)
        own = _linearise(throw, ride, track, one.noise).friction.sum(axis=1)
        rows.append(own @ _seen_together(throw, ride, track, one.noise, error))
    shared = np.array(rows)
    if before is None:
        return shared
    return np.vstack([np.zeros((before.throws, shared.shape[1])) if told is None else told, shared])


def _shared_by_map(found: _Mapped, sought: Sought) -> Floats | None:
    """Pull of what all throws err by together on everything fitted, (size, n) for n units."""
    evidence, track = found.evidence, found.track
    told = None if sought.before is None else sought.before.shared
    error = _stated(found.throws, track.ice.sheet, found.noise)
    if told is None and error is None and all(throw.turn_seen for throw in found.throws):
        return None
    shared = np.zeros((len(evidence.pull), len(nodes_of(track.ice.sheet)) + 1))
    if sought.before is not None and told is not None:
        cells = np.searchsorted(evidence.cells, sought.before.cells)
        shared[np.append(cells, evidence.m + np.arange(sought.played))] = told
    last = evidence.m + evidence.throws
    for k, throw in enumerate(found.throws):
        ride = track.ride(throw.passenger, throw.start, throw.speed, throw.offset)
        part = _linearise(throw, ride, track, found.noise, found.free, found.bias)
        seen = _seen_together(throw, ride, track, found.noise, error)
        cells = np.searchsorted(evidence.cells, part.crossed)
        places = np.concatenate(
            [cells, [evidence.m + sought.played + k], np.arange(last, len(shared))]
        )
        columns = np.column_stack([part.friction, part.friction.sum(axis=1), part.effects])
        shared[places] += columns.T @ seen
    return shared


def _moved(throw: Ridden, step: Floats, offset: float) -> Ridden:
    """The throw with its start, speed and offset changed by what a fit found."""
    limit = min(1.0, 0.3 * throw.speed / max(abs(float(step[1])), 1e-12))
    return replace(
        throw,
        start=throw.start + limit * float(step[0]),
        speed=throw.speed + limit * float(step[1]),
        offset=offset,
    )
