"""Discovery from tracks to a verdict: what is missing, what it explains, what stays open."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from curling_env.ice import Ice
from curling_env.trajectory import Trajectory
from friction_estimation.camera.scene import Scene
from friction_estimation.discovery.data.references import Calibration, calibrations_of, corrected
from friction_estimation.discovery.data.session import ENOUGH_THROWS, Session, open_session
from friction_estimation.discovery.evidence.confounding import Alternative, alternatives
from friction_estimation.discovery.evidence.events import SURPRISING, odd_throws
from friction_estimation.discovery.evidence.hold_out import (
    Gap,
    choose_held_out,
    forecast,
    noise_floor,
)
from friction_estimation.discovery.evidence.residual_term import NAME, try_table
from friction_estimation.discovery.evidence.significance import (
    STRUCTURE,
    Proof,
    between_throws,
    friction_structure,
    prove,
)
from friction_estimation.discovery.evidence.unknown import Follows, what_it_follows
from friction_estimation.discovery.model.baseline import base_model
from friction_estimation.discovery.model.candidates import candidates, pushes_of
from friction_estimation.discovery.model.fit import Fit, fit
from friction_estimation.discovery.search.residuals import Misfit
from friction_estimation.discovery.search.score_test import holm, screen
from friction_estimation.discovery.search.selection import (
    RULED_OUT,
    Progress,
    Selection,
    Step,
    closure,
    falls_short,
    fit_with_noise,
    misfit_of,
    place_sides,
    prune,
    refit,
    select,
    silent,
)

BY_CHANCE = 0.05
"""Corrected probability below which an effect is proved."""
CLOSES = 0.9
"""Part of the misfit that named effects must close, noise allowed for."""
CLOSES_BESIDE_UNKNOWN = 0.97
"""Part that they must close where something is left that follows nothing known: a proxy closes up
to 0.97."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Discovery:
    """What was found.

    Parameters
    ----------
    session : all throws that slide freely, less those of `events`
    selection : how the effects were chosen, on the training throws
    named : fit of the training throws with the effects that are named
    base : baseline on the same throws with the same noise
    final_base, final : both fitted to all throws, for the files
    proofs : of the named effects
    unproved : labels that were selected but not proved: proxies of something else
    follows : variables of what is unknown; empty where nothing is
    unknown : whether something is missing that no effect explains
    structure : what the throws' frictions still follow, and the p that it is chance
    events : numbers of throws in which something happened once
    held_out : indices into `session`
    gaps : forecast gap before, after and at the noise floor; empty without held-out throws
    before, after : slow misfit of the training throws
    alternatives : by label, what the data cannot rule out in place of a named effect
    trial_closures : by label, what each candidate of the first round closes by itself
    residual_term : what of the unknown is in the improved ice as a fitted table; None if nothing
    calibrations : of lengths and times, by references; the session's tracks are corrected by them
    fits_worse_than_uniform : whether the ice given, refitted, fits worse than uniform friction
    """

    session: Session
    selection: Selection
    named: Fit
    base: Fit
    final_base: Fit
    final: Fit
    proofs: list[Proof]
    unproved: list[str]
    unknown: bool
    follows: list[Follows]
    structure: tuple[str, float]
    events: list[int]
    held_out: NDArray[np.intp]
    gaps: dict[str, Gap] = field(default_factory=dict)
    before: Misfit
    after: Misfit
    alternatives: dict[str, list[Alternative]] = field(default_factory=dict)
    trial_closures: dict[str, float] = field(default_factory=dict)
    residual_term: dict[str, Any] | None = None
    calibrations: tuple[Calibration, ...] = ()
    fits_worse_than_uniform: bool = False

    @property
    def enough(self) -> bool:
        """Whether there are throws enough to name anything."""
        return len(self.session) >= ENOUGH_THROWS

    @property
    def closure(self) -> float:
        """Part of the slow misfit that the named effects close."""
        return closure(self.before, self.after)

    def runner_up(self, label: str) -> dict[str, Any] | None:
        """The next best candidate of the round in which an effect was chosen."""
        for step in self.selection.steps:
            if step.chosen == label and len(step.trials) > 1:
                second = step.trials[1]
                return {"name": second.term.label, "gain": float(f"{second.gain:.6g}")}
        return None


def discover(
    tracks: Sequence[Trajectory],
    ice: Ice | None = None,
    *,
    scene: Scene | None = None,
    references: Sequence[Calibration] = (),
    seed: int = 0,
    progress: Progress = silent,
) -> Discovery:
    """Find what a model of the ice lacks.

    Parameters
    ----------
    tracks : measured throws, in order of play
    ice : the model; uniform Coulomb friction on a symmetric running band by default
    scene : of the camera that filmed the tracks; the lens is then judged in its image
    references : what known lengths and clocks say of the tracks' scale and frame rate
    seed : of the held-out throws and of permutations
    progress : told what is being done and which part of all is behind

    Raises
    ------
    TrackTooShortError : no throw slides freely
    InputError : tracks that lie off the sheet, an ice with an effect that is not known
    """
    decided = {c.name: c for c in (*calibrations_of(ice), *references)}
    known = tuple(decided.values())
    found = _discover(corrected(tracks, known), ice, scene, np.random.default_rng(seed), progress)
    return replace(
        found, calibrations=known, fits_worse_than_uniform=_is_other_ice(ice, found.final_base)
    )


def _discover(
    tracks: Sequence[Trajectory],
    ice: Ice | None,
    scene: Scene | None,
    rng: np.random.Generator,
    progress: Progress,
) -> Discovery:
    """Find what a model lacks, with tracks whose lengths and times are taken as true."""
    progress("reading tracks", 0.0)
    session = open_session(tracks, scene)
    progress("fitting the baseline", 0.05)
    start = base_model(ice, session)
    everything = fit_with_noise(start, session)
    session = everything.session
    if len(session) < ENOUGH_THROWS:
        return _too_few(everything)
    found = _search(everything, rng, progress)
    odd = odd_throws(found.selection.best, session)
    if len(odd) and len(session) - len(odd) >= ENOUGH_THROWS:
        # What happened once must not poison the rest: the other throws are searched by themselves.
        rest = session.only(np.setdiff1d(np.arange(len(session)), odd))
        calm = _search(fit_with_noise(start, rest), rng, progress)
        alone = misfit_of(fit(calm.final.model, session.only(odd), calm.final.noise, shared=False))
        if misfit_of(calm.final).white and (alone.surprise > SURPRISING).all():
            return replace(calm, events=session.throws[odd].tolist())
    return found


def _is_other_ice(ice: Ice | None, base: Fit) -> bool:
    """Whether a given ice, refitted to the throws, fits them worse than uniform friction."""
    if ice is None or (ice.friction.is_uniform and not base.model.terms):
        return False
    uniform = fit(base_model(None, base.session), base.session, base.noise)
    return base.deviance > uniform.deviance + RULED_OUT


def _follow(
    named: Fit,
    after: Misfit,
    structure: tuple[str, float],
    rng: np.random.Generator,
    progress: Progress,
) -> list[Follows]:
    """What is unknown follows: within throws, and from throw to throw."""
    progress("asking what it follows", 0.8)
    follows = [] if after.white else what_it_follows(named, rng)
    if structure[1] < STRUCTURE:
        variable = structure[0].split()[0].replace("direction", "y")
        if variable not in {f.variable for f in follows}:
            own = Follows(variable=variable, share=0.0, p=structure[1], push="along")
            follows.insert(0 if after.white else len(follows), own)
    return follows


def _doubtful(proofs: list[Proof], follows: list[Follows], closes: float, left: float) -> list[str]:
    """Labels of effects that may be proxies of the unknown.

    They push where it still pushes, or explain less than is left unexplained.
    """
    pushes = {f.push for f in follows}
    if not follows and closes < CLOSES_BESIDE_UNKNOWN:
        return [proof.label for proof in proofs]
    return [
        proof.label
        for proof in proofs
        if proof.gain < left or pushes & pushes_of(proof.label.partition("[")[0])
    ]


def _too_few(everything: Fit) -> Discovery:
    misfit = misfit_of(everything)
    # Nothing is tried, but what so few throws would have shown is told.
    looks = screen(everything, candidates(everything.session, everything.model.terms))
    step = Step(looks=looks, trials=[], chosen="")
    selection = Selection(
        base=everything, best=everything, before=misfit, after=misfit, steps=[step]
    )
    return Discovery(
        session=everything.session,
        selection=selection,
        named=everything,
        base=everything,
        final_base=everything,
        final=everything,
        proofs=[],
        unproved=[],
        unknown=False,
        follows=[],
        structure=("", 1.0),
        events=[],
        held_out=np.empty(0, dtype=np.intp),
        before=misfit,
        after=misfit,
    )


def _search(everything: Fit, rng: np.random.Generator, progress: Progress) -> Discovery:
    """Select, prove and accept on one session."""
    session = everything.session
    held_out = choose_held_out(session, rng)
    training = session.only(np.setdiff1d(np.arange(len(session)), held_out))
    unseen = session.only(held_out)
    base = fit_with_noise(everything.model, training, everything.noise)
    selection = select(base, progress=lambda what, share: progress(what, 0.1 + 0.6 * share))
    progress("testing throw by throw", 0.7)
    selection = replace(selection, best=between_throws(selection.best, session, rng))
    named, proofs, unproved = _proved(selection, unseen, session, rng)
    base, after = selection.base, misfit_of(named)
    structure = friction_structure(named, rng)
    open_ = not after.white or structure[1] < STRUCTURE
    closes = closure(selection.before, after)
    follows = _follow(named, after, structure, rng, progress) if open_ else []
    doubtful = _doubtful(proofs, follows, closes, after.excess) if open_ else []
    if falls_short(selection.before, after, CLOSES):
        doubtful = [proof.label for proof in proofs]
    if doubtful:
        # A proxy of what is unknown must not stand as a name: the rest is fitted without it.
        unproved = doubtful + unproved
        proofs = [proof for proof in proofs if proof.label not in doubtful]
        model = replace(
            named.model, terms=tuple(t for t in named.model.terms if t.label not in doubtful)
        )
        named, open_ = refit(named, model) if proofs else base, True
        after, structure = misfit_of(named), friction_structure(named, rng)
        # Without its proxies the unknown may be too large for a linear look: then what it
        # follows beside them stands.
        follows = _follow(named, after, structure, rng, progress) or follows
    progress("forecasting throws held out", 0.9)
    gaps = {
        "before": forecast(base.model, unseen, named.noise),
        "after": forecast(named.model, unseen, named.noise),
        "noise_floor": noise_floor(named, unseen),
    }
    closures = {
        trial.term.label: closure(selection.before, misfit_of(trial.fit))
        for trial in (selection.steps[0].trials if selection.steps else [])
    }
    described = try_table(named, follows, unseen) if open_ else None
    table: dict[str, Any] | None = None
    if described is not None:
        table = {
            "rest_error_m_without": float(f"{gaps['after'].rest_error:.4g}"),
            "rest_error_m_with": float(f"{described[1].rest_error:.4g}"),
            "parameters": dict(described[0].model.term(NAME).values),
        }
        named, gaps["after"] = described
        gaps["noise_floor"] = noise_floor(named, unseen)
    progress("fitting all throws", 0.96)
    final = place_sides(fit_with_noise(named.model, session, named.noise))
    final_base = refit(final, base.model)
    others = {proof.label: alternatives(final, proof.label) for proof in proofs}
    return Discovery(
        session=session,
        selection=selection,
        named=named,
        base=base,
        final_base=final_base,
        final=final,
        proofs=proofs,
        unproved=unproved,
        unknown=open_,
        follows=follows,
        structure=structure,
        events=[],
        held_out=held_out,
        gaps=gaps,
        before=selection.before,
        after=after,
        alternatives=others,
        trial_closures=closures,
        residual_term=table,
    )


def _proved(
    selection: Selection, unseen: Session, whole: Session, rng: np.random.Generator
) -> tuple[Fit, list[Proof], list[str]]:
    """The model with only those effects that throws prove one by one."""
    fitted = selection.best
    own = {term.label for term in selection.base.model.terms}
    unproved: list[str] = []
    while True:
        labels = [t.label for t in fitted.model.terms if t.label not in own]
        proofs = [prove(fitted, label, unseen, whole, rng) for label in labels]
        corrected = holm([proof.p for proof in proofs])
        proofs = [replace(p, corrected=c) for p, c in zip(proofs, corrected, strict=True)]
        failed = [p for p in proofs if p.corrected > BY_CHANCE]
        if not failed:
            return fitted, proofs, unproved
        worst = max(failed, key=lambda p: (p.p, -p.gain))
        unproved.append(worst.label)
        fitted = prune(refit(fitted, fitted.model.without(worst.label)), own)
