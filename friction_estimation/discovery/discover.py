"""Discovery from tracks to findings: missing effects, their evidence, and open questions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from curling_env.errors import FitError, InputError
from curling_env.ice import ActiveEffect, Ice
from curling_env.trajectory import Trajectory
from curling_env.typing import Floats, Indices, Progress, no_progress, part_of_progress
from friction_estimation.camera.scene import Scene
from friction_estimation.discovery.data.references import Calibration, calibrations_of, corrected
from friction_estimation.discovery.data.session import Session, open_session, refuse_too_many_cells
from friction_estimation.discovery.evidence.confounding import Alternative, alternatives
from friction_estimation.discovery.evidence.hold_out import (
    ForecastGap,
    choose_held_out,
    forecast,
    noise_floor,
)
from friction_estimation.discovery.evidence.intervals import (
    common_errors,
    map_errors,
    standard_errors,
)
from friction_estimation.discovery.evidence.unknown.explanation import fit_beside
from friction_estimation.discovery.model.baseline import base_model
from friction_estimation.discovery.model.candidates import candidates
from friction_estimation.discovery.model.fit import SessionFit, fit, fit_to, singular_fit_refused
from friction_estimation.discovery.model.minimum import minimum_of
from friction_estimation.discovery.naming import Named, name_effects
from friction_estimation.discovery.search.maps import renew_map
from friction_estimation.discovery.search.patches import place_sides
from friction_estimation.discovery.search.residuals import throw_tolerance_of
from friction_estimation.discovery.search.selection import (
    Selection,
    SelectionRound,
    fit_with_noise,
    misfit_of,
    refine,
    refit,
    score_candidates,
    select,
)
from friction_estimation.discovery.tuning import (
    CLEARLY_SEEN,
    EVENT_SHARE,
    LAST_STEPS,
    LEAST_GAIN,
    LEAST_THROWS,
    MOST_EVENTS,
)


@dataclass(frozen=True, kw_only=True, eq=False)
class Discovery(Named):
    """The findings of a discovery.

    Parameters
    ----------
    session : all throws that slide freely, without those of `events`
    selection : how the effects were chosen, on the training throws
    final_base, seen : fits of baseline and improved model to all throws
    final : the same of the improved model, for the files, with the unknown acting on the throws
    events : numbers of throws in which something happened once
    held_out : indices of the held-out throws in `session`
    gaps : forecast gaps ``before``, ``after`` and at the ``noise_floor``; empty without held-out
        throws
    alternatives : for each label the effects that the data cannot rule out in its place
    calibrations : factors of lengths and times by which the tracks were corrected
    fits_worse_than_uniform : whether the given ice, fitted, fits worse than uniform friction
    given : the model as it was given; None for uniform friction
    """

    session: Session
    selection: Selection
    final_base: SessionFit
    seen: SessionFit
    final: SessionFit
    events: list[int] = field(default_factory=list[int])
    held_out: Indices = field(default_factory=lambda: np.empty(0, dtype=np.intp))
    gaps: dict[str, ForecastGap] = field(default_factory=dict[str, ForecastGap])
    alternatives: dict[str, list[Alternative]] = field(default_factory=dict[str, list[Alternative]])
    calibrations: tuple[Calibration, ...] = ()
    fits_worse_than_uniform: bool = False
    given: Ice | None = None

    @property
    def enough(self) -> bool:
        """Return whether there are enough throws to name anything."""
        return len(self.session) >= LEAST_THROWS

    @property
    def closure(self) -> float:
        """Share of the slow misfit that the named effects explain; 1 where there was none."""
        before = self.selection.before
        return 1.0 if before.white else 1.0 - self.after.excess / before.excess

    def runner_up(self, label: str) -> dict[str, Any] | None:
        """Return the second-best candidate of the round in which an effect was chosen."""
        for round_ in self.selection.rounds:
            if round_.chosen == label and len(round_.trials) > 1:
                second = round_.trials[1]
                return {"name": second.term.label, "gain": float(f"{second.gain:.6g}")}
        return None

    def baseline_ice(self) -> Ice:
        """Return the baseline as fitted to all throws."""
        return ice_of(self.final_base)

    def improved_ice(self) -> Ice:
        """Return the model with all found effects, fitted to all throws."""
        ice = ice_of(self.final)
        for calibration in self.calibrations:
            if calibration.clearly_off:
                ice = ice.with_effect(calibration.as_effect())
        if self.unknown:
            ice = ice.with_effect(ActiveEffect(name="unknown"))
        return ice


def ice_of(fitted: SessionFit) -> Ice:
    """Return the ice of a fit, with its standard errors and their correlations.

    Raises
    ------
    FitError : the fit has a friction or an effect that no ice has
    """
    level, common = common_errors(fitted)
    try:
        return fitted.model.improved_ice(
            standard_errors(fitted), map_errors(fitted), level=level, common=common
        )
    except InputError as error:
        raise FitError(
            f"no plausible ice explains these throws: {fitted.worst_throw()}; check its "
            f"positions, times and headings ({error})"
        ) from error


def discover(
    tracks: Sequence[Trajectory],
    ice: Ice | None = None,
    *,
    scene: Scene | None = None,
    references: Sequence[Calibration] = (),
    seed: int = 0,
    progress: Progress = no_progress,
) -> Discovery:
    """Find what a model of the ice lacks.

    Parameters
    ----------
    tracks : measured throws, in order of play
    ice : model of the ice; uniform Coulomb friction on a symmetric running band by default
    scene : scene of the camera that filmed the tracks; distortion of its lens is then estimated in
        its image
    references : calibrations of lengths and times by known ones; they replace those of the ice
    seed : seed of the choice of held-out throws
    progress : progress

    Raises
    ------
    TrackTooShortError : no throw slides freely
    InputError : tracks that lie off the sheet, an ice with an effect that is not known
    FitError : throws to which no ice can be fitted
    """
    calibrations = {c.name: c for c in (*calibrations_of(ice), *references)}
    known = tuple(calibrations.values())
    # The matrices are too small to share: more threads of linear algebra only wait for each other.
    with threadpool_limits(limits=1, user_api="blas"), singular_fit_refused():
        refuse_too_many_cells(ice)
        progress("reading tracks", 0.0)
        session = open_session(corrected(tracks, known), scene)
        progress("fitting the baseline", 0.05)
        everything = fit_with_noise(base_model(ice, session), session)
        found = search_session(everything, np.random.default_rng(seed), progress)
    return replace(
        found,
        calibrations=known,
        fits_worse_than_uniform=_is_other_ice(ice, found.final_base),
        given=ice,
    )


def search_session(
    everything: SessionFit, rng: np.random.Generator, progress: Progress = no_progress
) -> Discovery:
    """Find what a model fitted to all throws of a session lacks.

    Parameters
    ----------
    everything : the fit
    rng : source of the choice of held-out throws
    progress : progress
    """
    if everything.model.terms and not misfit_of(everything).white:
        everything = refine(everything)
    everything = renew_map(everything)
    start, session = everything.model, everything.session
    if len(session) < LEAST_THROWS:
        return _too_few(everything)
    selection, held_out = _select(everything, rng, progress)
    odd = exceptional_throws(selection.best, session)
    if len(odd) and len(session) - len(odd) >= LEAST_THROWS:
        # A single event must not distort the rest: the other throws are searched separately.
        rest = session.only(np.setdiff1d(np.arange(len(session)), odd))
        others = fit_with_noise(start, rest)
        calm = _accept(others, *_select(others, rng, progress), progress)
        alone = misfit_of(fit(calm.final.model, session.only(odd), calm.final.noise, shared=False))
        if misfit_of(calm.final).white and (alone.surprise > CLEARLY_SEEN).all():
            return replace(calm, events=session.throws[odd].tolist())
    return _accept(everything, selection, held_out, progress)


def _is_other_ice(ice: Ice | None, base: SessionFit) -> bool:
    """Return whether a given ice fits the throws worse than uniform friction does."""
    if ice is None or (ice.friction.is_uniform and not base.model.terms):
        return False
    uniform = fit(base_model(None, base.session), base.session, base.noise)
    return base.deviance > uniform.deviance + LEAST_GAIN


def _too_few(everything: SessionFit) -> Discovery:
    """Return the findings of too few throws: no effect is tried, but the detection limits are
    known.
    """
    misfit = misfit_of(everything)
    scores = score_candidates(everything, candidates(everything.session, everything.model.terms))
    selection = Selection(
        base=everything,
        best=everything,
        before=misfit,
        rounds=[SelectionRound(scores=scores, trials=[], chosen="")],
    )
    return Discovery(
        fit=everything,
        after=misfit,
        session=everything.session,
        selection=selection,
        final_base=everything,
        seen=everything,
        final=everything,
    )


def _select(
    everything: SessionFit, rng: np.random.Generator, progress: Progress
) -> tuple[Selection, Indices]:
    """Select effects on the training throws; return also the indices of the held-out ones."""
    session = everything.session
    held_out = choose_held_out(session, rng)
    training = session.only(np.setdiff1d(np.arange(len(session)), held_out))
    base = fit_with_noise(everything.model, training, everything.noise, near=(everything,))
    return select(base, progress=part_of_progress(progress, 0.1, 0.7)), held_out


def _accept(
    everything: SessionFit, selection: Selection, held_out: Indices, progress: Progress
) -> Discovery:
    """Test and accept the effects of a selection.

    Parameters
    ----------
    everything : fit of the baseline to all throws
    selection, held_out : as of `Discovery`
    progress : progress
    """
    session = everything.session
    unseen = session.only(held_out)
    progress("testing throw by throw", 0.7)
    found = name_effects(selection, unseen, session, progress)
    progress("forecasting throws held out", 0.9)
    base, noise = selection.base.model, found.fit.noise
    gaps = {
        "before": forecast(base, unseen, noise),
        "after": forecast(found.fit.model, unseen, noise),
        "noise_floor": noise_floor(found.fit, unseen),
    }
    progress("fitting all throws", 0.96)
    seen = _fit_all(found.fit, everything)
    final = fit_beside(seen, found.pushes) if found.pushes else seen
    return Discovery(
        **vars(found),
        session=session,
        selection=selection,
        final_base=refit(seen, base),
        final=final,
        seen=seen,
        held_out=held_out,
        gaps=gaps,
        alternatives={e.label: alternatives(final, e.label) for e in found.effects},
    )


def _fit_all(named: SessionFit, everything: SessionFit) -> SessionFit:
    """Return the named model fitted to all throws.

    Parameters
    ----------
    named : its fit to the training throws
    everything : fit of the baseline to all throws
    """
    fitted = fit_with_noise(
        named.model,
        everything.session,
        named.noise,
        near=(everything, named),
        iterations=LAST_STEPS,
    )
    return place_sides(renew_map(fitted))


# --- single events, such as a pick, a touch or a lost track ---------------------------------------


def exceptional_throws(best: SessionFit, session: Session) -> Indices:
    """Return the indices of a few throws without which the others agree.

    An exceptional throw would distort the fit of all others. Around the fit with all selected
    effects, throws are excluded one by one, and the misfit of the others is compared with their
    misfit before.

    Parameters
    ----------
    best : fit of some of the throws with all selected effects
    session : all throws
    """
    whole = place_sides(fit_to(best, session))
    values = np.isfinite(session.observed).sum(axis=1)
    dof = np.add.reduceat(values, session.starts[:-1]) * throw_tolerance_of(session)
    odd: list[int] = []
    excess = _excess_without(whole, odd, dof)
    if excess < CLEARLY_SEEN * np.sqrt(2.0 * dof.sum()):
        return np.empty(0, dtype=np.intp)
    for _ in range(max(1, int(MOST_EVENTS * len(session)))):
        others = [i for i in range(len(session)) if i not in odd]
        odd.append(min(others, key=lambda i: _excess_without(whole, [*odd, i], dof)))
        if _excess_without(whole, odd, dof) < (1.0 - EVENT_SHARE) * excess:
            return np.sort(np.array(odd, dtype=np.intp))
    return np.empty(0, dtype=np.intp)


def _excess_without(whole: SessionFit, odd: list[int], dof: Floats) -> float:
    """χ² of the other throws beyond its expectation, fitted without the exceptional ones."""
    grams, _ = whole.linear.each()
    others = np.setdiff1d(np.arange(len(grams)), odd)
    step = minimum_of(grams[others].sum(axis=0) + whole.linear.prior).step
    move = np.append(-step, 1.0)
    chi2 = np.einsum("i,kij,j->k", move, grams[others], move)
    return float(np.maximum(chi2 - dof[others], 0.0).sum())
