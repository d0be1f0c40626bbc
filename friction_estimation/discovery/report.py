"""A discovery in words and numbers: the report, and the two ice files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from curling_env.ice import save_ice
from curling_env.infrastructure.files.schema import FileFormat
from curling_env.infrastructure.files.storage import write_json
from friction_estimation.discovery.data.references import QUANTITIES, Calibration, QuantityError
from friction_estimation.discovery.discover import Discovery
from friction_estimation.discovery.evidence.intervals import standard_errors, with_sides
from friction_estimation.discovery.evidence.next_throws import NextThrow
from friction_estimation.discovery.evidence.significance import EffectEvidence
from friction_estimation.discovery.model.candidates import Term, effect_of
from friction_estimation.discovery.verdict import (
    changes,
    doubts,
    metres_gained,
    number,
    remarks,
    scatter_in_words,
    sentence,
)

REPORT_FORMAT = FileFormat(name="curling-report/1", what="a report", numbered=False)


def document(
    found: Discovery,
    following: Sequence[NextThrow] = (),
    provenance: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """Return the report for `report.json`.

    Parameters
    ----------
    found : the discovery
    following : throws that would teach most beside these
    provenance : where it comes from (`curling_env.infrastructure.provenance`), where that is known
    """
    effects = [_calibration(c) for c in found.calibrations if c.clearly_off and c.references]
    errors = with_sides(found.final, standard_errors(found.final))
    effects += [_named(found, effect, errors) for effect in found.effects]
    if found.unknown:
        effects.append(_unknown(found))
    if found.events:
        effects.append(_event(found))
    model = found.final_base.model
    sigma = standard_errors(found.final_base)
    mu = float(np.mean(model.ice.friction.mu) * np.exp(model.ln_mu))
    noise = found.final.noise
    return {
        "format": REPORT_FORMAT.name,
        "verdict": sentence(found),
        "doubts": doubts(found),
        "remarks": remarks(found),
        "effects": effects,
        "changes": changes(found),
        "gap": {
            **{key: gap.numbers() for key, gap in found.gaps.items()},
            "held_out_throws": found.session.throws[found.held_out].tolist(),
            "closure": number(found.closure),
        },
        "baseline": {
            "mu": number(mu),
            "mu_stderr": number(mu * sigma[("", "ln_mu")]),
            "mu_spread": number(model.spread),
            "spin_coupling": number(
                model.ice.stone.spin_coupling * float(np.exp(model.ln_coupling))
            ),
            "effects": [term.name for term in model.terms],
            "slow_misfit": number(found.selection.before.ratio),
        },
        "remaining": {
            "slow_misfit": number(found.after.ratio),
            "white": bool(found.after.white),
            "mu_spread": number(found.final.model.spread),
            "mu_follows": found.structure[0],
            "mu_follows_p": number(found.structure[1]),
        },
        "noise": {
            "position_m": number(noise.position),
            "heading_rad": number(float(noise.total[2])),
            "memory_s": number(max(noise.memory[:2]) if noise.remembers else 0.0),
        },
        "candidates": ranked_candidates(found),
        "smallest_detectable": smallest_detectable(found),
        "undecidable": _undecidable(found),
        "left_out": list(found.session.left_out),
        "next_throws": [throw.as_dict() for throw in following],
        **({"provenance": dict(provenance)} if provenance else {}),
    }


def _effect(
    name: str,
    where: str,
    evidence: Mapping[str, Any],
    *,
    kind: str = "unknown",
    parameters: Mapping[str, tuple[float, float, str]] = MappingProxyType({}),
    depends_on: Sequence[str] = (),
    alternatives: Sequence[str] = (),
) -> dict[str, Any]:
    """Return an effect of the report; its parameters are values, standard errors and units."""
    return {
        "name": name,
        "kind": kind,
        "parameters": {
            key: {"value": number(value), "stderr": number(stderr), "unit": unit}
            for key, (value, stderr, unit) in parameters.items()
        },
        "depends_on": list(depends_on),
        "where": where,
        "evidence": dict(evidence),
        "alternatives": list(alternatives),
    }


def _parameters(
    term: Term, sigma: Mapping[tuple[str, str], float]
) -> dict[str, tuple[float, float, str]]:
    """Return the parameters of a term; of a map its spread where stones ran."""
    field = term.map_field
    if field is not None:  # the map itself is in the ice file
        spread = float(field.ln_mu.ravel()[field.crossed].std())
        return {
            "spread": (spread, spread / float(np.sqrt(2.0 * len(field))), "1"),
            "length": (field.length, 0.25 * field.length, "m"),
        }
    return {
        p.name: (term.values[p.name], sigma.get((term.label, p.name), 0.0), p.unit)
        for p in term.card.parameters
        if p.name in term.free or p.default is None  # else without data
    }


def _named(
    found: Discovery, effect: EffectEvidence, sigma: Mapping[tuple[str, str], float]
) -> dict[str, Any]:
    term = found.final.model.term(effect.label)
    others = found.alternatives.get(effect.label, [])
    clear = np.argsort(-effect.improvements)[:3]
    numbers = np.sort(found.session.throws)[np.sort(clear)]
    sign = (term.variant or term.card).evidence
    return _effect(
        term.name,
        f"{sign}; clearest in throws {', '.join(str(n) for n in numbers)}",
        {
            "label": effect.label,
            "gain": number(effect.gain),
            "p": number(effect.p),
            "throws_improved": int((effect.improvements > 0).sum()),
            "throws": len(effect.improvements),
            "closure": number(found.closure),
            "runner_up": found.runner_up(effect.label),
            "separating_throws": {a.name: a.throw for a in others},
            **({"metres_gained": metres_gained(found)} if term.name == "sweeping" else {}),
        },
        kind="physics" if term.card.is_physical else "measurement",
        parameters=_parameters(term, sigma),
        alternatives=[a.name for a in others],
    )


def _calibration(found: Calibration) -> dict[str, Any]:
    what = QUANTITIES[found.name].singular
    return _effect(
        found.name,
        f"every {what} in the tracks, according to the given {what}",
        {
            "known": [{"measured": r.measured, "true": r.true} for r in found.references],
            "standard_errors": number(abs(found.factor - 1.0) / max(found.stderr, 1e-12)),
        },
        kind="measurement",
        parameters={"factor": (found.factor, found.stderr, "1")},
    )


def _undecidable(found: Discovery) -> dict[str, Any]:
    decided = {c.name for c in found.calibrations}
    open_: list[QuantityError] = [name for name in QUANTITIES if name not in decided]
    what = [QUANTITIES[name].plural for name in open_]
    checks = [QUANTITIES[name].check for name in open_]
    why = (
        f"throws alone cannot show that {' or '.join(what)} are off by a factor: friction absorbs "
        f"it. Give {' and '.join(checks)}."
        if open_
        else "lengths and times were checked against the given ones."
    )
    return {"names": open_, "why": why}


def _unknown(found: Discovery) -> dict[str, Any]:
    return _effect(
        "unknown",
        "; ".join(f"a push {d.push} that follows {d.followed}" for d in found.dependences)
        or scatter_in_words(found)
        or "no single variable stands out",
        {
            "slow_misfit": number(found.after.ratio),
            "tolerated": found.after.tolerated,
            "shares": {d.variable: number(d.share) for d in found.dependences},
            "p": {d.variable: number(d.p) for d in found.dependences},
            "proxies": list(dict.fromkeys(effect_of(label) for label in found.unproved)),
        },
        depends_on=[d.variable for d in found.dependences],
    )


def _event(found: Discovery) -> dict[str, Any]:
    throws = ", ".join(str(throw) for throw in found.events)
    where = f"only in throw {throws}: a pick, a touch or a lost track"
    return _effect("unknown", where, {"throws": found.events}, depends_on=["event"])


def ranked_candidates(found: Discovery) -> list[dict[str, Any]]:
    """Candidates in the order of their gain over the baseline."""
    first = found.selection.rounds[0]
    fitted = {trial.term.label for trial in first.trials}
    rows = [
        {"name": t.term.label, "gain": number(t.gain), "needed": number(t.needed)}
        for t in first.trials
    ]
    return rows + [
        {"name": score.term.label, "gain": number(score.gain), "needed": None}
        for score in first.scores
        if score.term.label not in fitted
    ]


def smallest_detectable(found: Discovery) -> dict[str, dict[str, float]]:
    """Return the smallest detectable effects, by candidate and parameter."""
    return {
        score.term.label: {name: number(value) for name, value in score.smallest.items()}
        for score in found.selection.rounds[-1].scores
    }


def write_files(
    found: Discovery,
    folder: Path,
    *,
    following: Sequence[NextThrow] = (),
    provenance: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """Write report.json, baseline.json and ice.json, and return the report.

    Parameters
    ----------
    found : the discovery
    folder : existing folder to write to
    following, provenance : as of `document`
    """
    report = document(found, following, provenance)
    origin = provenance or {}  # not that of the given ice
    save_ice(found.baseline_ice(), folder / "baseline.json", provenance=origin)
    save_ice(found.improved_ice(), folder / "ice.json", provenance=origin)
    write_json(folder / "report.json", report)
    return report
