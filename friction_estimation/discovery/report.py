"""A discovery in words and numbers: the report's document and the two ice files."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from curling_env.ice import ActiveEffect, Ice, save_ice
from curling_env.storage import write_json
from friction_estimation.discovery.data.references import Calibration, as_effect
from friction_estimation.discovery.data.session import ENOUGH_THROWS
from friction_estimation.discovery.discover import Discovery
from friction_estimation.discovery.evidence.intervals import standard_errors, with_sides
from friction_estimation.discovery.model.candidates import UNDECIDABLE, Term, without_stone

READABLE = {
    "speed_dependent_friction": "friction that follows the sliding speed",
    "curl": "curl",
    "slope": "a slope of the ice",
    "pebble_wear": "pebble that wears from throw to throw",
    "pebble_wear[along_path]": "pebble that wears where stones have run",
    "stone_bias": "a stone with a friction of its own",
    "sweeping": "sweeping",
    "friction_patch": "a patch of different ice",
    "time_drift": "friction that drifts with time",
    "spin_drag": "spin that fades faster than the band explains",
    "air_drag": "air drag",
    "tracking_offset": "a tracked point beside the stone's centre",
    "lens_distortion": "lens distortion left in the tracks",
    "scale_error": "lengths that are off by a factor",
    "frame_rate_error": "times that are off by a factor",
}

SIGNS = {"pebble_wear[along_path]": "friction follows how often stones have run over the place"}
"""Where an effect shows in another form than its card's."""

OPEN = {"scale_error": "all lengths", "frame_rate_error": "all times"}
CHECKS = {
    "scale_error": "a known length (--known-length; hog line to hog line is 21.945 m, tee to tee "
    "34.747 m)",
    "frame_rate_error": "an interval by a clock (--clock)",
}

NO_HEADING = "No heading was measured, so nothing can be said of curl and of spin."
ONE_WAY = (
    "All throws went one way: a slope along the sheet cannot be told from friction until some come "
    "back."
)
ONE_SPIN = (
    "All stones turned the same way: curl cannot be told from a slope across the sheet until some "
    "turn the other way."
)
NO_SCENE = (
    "The lens was judged without the camera's scene: all lengths, and every size with them, may "
    "still be off by some per cent; give --scene or --known-length."
)
OTHER_ICE = (
    "The ice given fits these throws worse than uniform friction does: it is of other ice, or of "
    "another sheet."
)


def readable(name: str) -> str:
    """A name in plain words."""
    return READABLE.get(name, name.replace("_", " "))


def number(value: float) -> float:
    """Six significant digits: enough for any of these."""
    return float(f"{value:.6g}")


def document(found: Discovery) -> dict[str, Any]:
    """The report, as `report.json` holds it."""
    effects = [_calibration(c) for c in found.calibrations if c.clearly_off and c.references]
    errors = with_sides(found.final, standard_errors(found.final))
    effects += [_named(found, k, errors) for k in range(len(found.proofs))]
    if found.unknown:
        effects.append(_unknown(found))
    if found.events:
        effects.append(_event(found))
    model = found.final_base.model
    sigma = standard_errors(found.final_base)
    mu = float(np.mean(model.ice.friction.mu) * np.exp(model.ln_mu))
    noise = found.final.noise
    return {
        "verdict": sentence(found),
        "effects": effects,
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
            "slow_misfit": number(found.before.ratio),
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
        "candidates": league(found),
        "smallest_detectable": smallest(found),
        "undecidable": _undecidable(found),
        "left_out": list(found.session.left_out),
    }


def sentence(found: Discovery) -> str:
    """The verdict."""
    if not found.enough:
        count = len(found.session)
        return (
            f"Nothing is named: {count} {'throw slides' if count == 1 else 'throws slide'} freely, "
            f"and fewer than {ENOUGH_THROWS} cannot tell an effect from chance."
        )
    names = list(dict.fromkeys(readable(without_stone(p.label)) for p in found.proofs))
    parts: list[str] = []
    if names:
        listed = " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)
        before, after = found.gaps["before"].rest_error, found.gaps["after"].rest_error
        floor = found.gaps["noise_floor"].rest_error
        parts.append(
            f"The model lacks {listed}; with {'them' if len(names) > 1 else 'it'}, throws it never "
            f"saw come to rest {100 * after:.0f} cm from the forecast instead of "
            f"{100 * before:.0f} cm (a perfect model: {100 * floor:.0f} cm)"
        )
    if found.unknown:
        follows = [f.variable for f in found.follows]
        what = f" that follows {', '.join(follows)}" if follows else ""
        parts.append(f"{'something' if names else 'Something'} unknown{what} is missing")
    for c in found.calibrations:
        if c.clearly_off and c.references:
            off = f"{100 * abs(c.factor - 1):.1f} % too {'long' if c.factor > 1 else 'short'}"
            parts.append(f"{OPEN[c.name]} in the tracks are {off}, by what was given")
    if found.events:
        throws = ", ".join(str(throw) for throw in found.events)
        parts.append(f"something happened once in throw {throws}")
    text = "; ".join(parts) or "Nothing is missing: what is left is noise, by these throws"
    return " ".join([text[0].upper() + text[1:] + ".", *blind_spots(found)])


def blind_spots(found: Discovery) -> list[str]:
    """What the session as it was played cannot show, in sentences."""
    said: list[str] = []
    states, turns = found.final.states, found.session.turns
    if len(np.unique(np.sign(states[:, 3]))) == 1:
        said.append(ONE_WAY)
    if not turns.any():
        said.append(NO_HEADING)
    elif len(np.unique(np.sign(states[turns, 5]))) == 1:
        said.append(ONE_SPIN)
    lens = [t for t in found.final.model.terms if t.label == "lens_distortion"]
    if (
        lens
        and "k1" in lens[0].values
        and not any(c.name == "scale_error" for c in found.calibrations)
    ):
        said.append(NO_SCENE)
    if found.fits_worse_than_uniform:
        said.append(OTHER_ICE)
    return said


def _parameters(term: Term, sigma: Mapping[tuple[str, str], float]) -> dict[str, Any]:
    out: dict[str, Any] = {}
    for p in term.form.parameters:
        if p.name not in term.free and p.default is not None:
            continue  # left at its usual value: it says nothing of these data
        error = sigma.get((term.label, p.name), 0.0)  # an identifier has none
        out[p.name] = {
            "value": number(term.values[p.name]),
            "stderr": number(error),
            "unit": p.unit,
        }
    return out


def _named(found: Discovery, k: int, sigma: Mapping[tuple[str, str], float]) -> dict[str, Any]:
    proof = found.proofs[k]
    term = found.final.model.term(proof.label)
    others = found.alternatives.get(proof.label, [])
    clear = np.argsort(-proof.improvements)[:3]
    numbers = np.sort(found.session.throws)[np.sort(clear)]
    sign = SIGNS.get(proof.label, term.form.sign)
    where = f"{sign}; clearest in throws {', '.join(str(n) for n in numbers)}"
    return {
        "name": term.name,
        "kind": term.form.kind,
        "parameters": _parameters(term, sigma),
        "depends_on": [],
        "where": where,
        "evidence": {
            "label": proof.label,
            "gain": number(proof.gain),
            "p": number(proof.p),
            "p_holm": number(proof.corrected),
            "throws_improved": int((proof.improvements > 0).sum()),
            "throws": len(proof.improvements),
            "closure": number(found.closure),
            "runner_up": found.runner_up(proof.label),
            "separating_throws": {a.name: a.throw for a in others},
        },
        "alternatives": [a.name for a in others],
    }


def _calibration(found: Calibration) -> dict[str, Any]:
    what = "length" if found.name == "scale_error" else "time"
    return {
        "name": found.name,
        "kind": "measurement",
        "parameters": {
            "factor": {
                "value": number(found.factor),
                "stderr": number(found.stderr),
                "unit": "1",
            }
        },
        "depends_on": [],
        "where": f"every {what} in the tracks, by a {what} that was given",
        "evidence": {
            "known": [{"measured": r.measured, "true": r.true} for r in found.references],
            "standard_errors": number(abs(found.factor - 1.0) / max(found.stderr, 1e-12)),
        },
        "alternatives": [],
    }


def _undecidable(found: Discovery) -> dict[str, Any]:
    decided = {c.name for c in found.calibrations}
    open_ = [name for name in UNDECIDABLE if name not in decided]
    what = [OPEN[name] for name in open_]
    checks = [CHECKS[name] for name in open_]
    why = (
        f"throws alone cannot show that {' or '.join(what)} are off by a factor: friction absorbs "
        f"it. Give {' and '.join(checks)}."
        if open_
        else "lengths and times were checked against what was given."
    )
    return {"names": open_, "why": why}


def _unknown(found: Discovery) -> dict[str, Any]:
    return {
        "name": "unknown",
        "kind": "unknown",
        "parameters": {},
        "depends_on": [f.variable for f in found.follows],
        "where": "; ".join(f"a push {f.push} that follows {f.variable}" for f in found.follows)
        or "no single variable stands out",
        "evidence": {
            "slow_misfit": number(found.after.ratio),
            "tolerated": found.after.tolerated,
            "shares": {f.variable: number(f.share) for f in found.follows},
            "p": {f.variable: number(f.p) for f in found.follows},
            "proxies": list(dict.fromkeys(without_stone(label) for label in found.unproved)),
            "residual_term": found.residual_term,
        },
        "alternatives": [],
    }


def _event(found: Discovery) -> dict[str, Any]:
    throws = ", ".join(str(throw) for throw in found.events)
    return {
        "name": "unknown",
        "kind": "unknown",
        "parameters": {},
        "depends_on": ["event"],
        "where": f"only in throw {throws}: a pick, a touch or a lost track",
        "evidence": {"throws": found.events},
        "alternatives": [],
    }


def league(found: Discovery) -> list[dict[str, Any]]:
    """Candidates in the order of what they would gain over the baseline."""
    if not found.selection.steps:
        return []
    first = found.selection.steps[0]
    fitted = {trial.term.label: trial for trial in first.trials}
    rows = [
        {
            "name": label,
            "gain": number(trial.gain),
            "needed": number(trial.needed),
            "closure": number(found.trial_closures.get(label, float("nan")))
            if label in found.trial_closures
            else None,
        }
        for label, trial in fitted.items()
    ]
    rows += [
        {"name": look.term.label, "gain": number(look.gain), "needed": None, "closure": None}
        for look in first.looks
        if look.term.label not in fitted
    ]
    return rows


def smallest(found: Discovery) -> dict[str, dict[str, float]]:
    """Smallest effect that these throws could have shown, by candidate and parameter."""
    if not found.selection.steps:
        return {}
    looks = found.selection.steps[-1].looks
    return {
        look.term.label: {name: number(value) for name, value in look.smallest.items()}
        for look in looks
    }


def baseline_ice(found: Discovery) -> Ice:
    """The refitted baseline."""
    fitted = found.final_base
    return fitted.model.improved_ice(standard_errors(fitted))


def improved_ice(found: Discovery) -> Ice:
    """The model with what was found."""
    fitted = found.final
    ice = fitted.model.improved_ice(standard_errors(fitted))
    for calibration in found.calibrations:
        if calibration.clearly_off:
            ice = ice.with_effect(as_effect(calibration))
    if found.unknown and found.residual_term is None:
        ice = ice.with_effect(ActiveEffect(name="unknown"))
    return ice


def write_files(found: Discovery, folder: Path) -> dict[str, Any]:
    """report.json, baseline.json and ice.json; returns the report."""
    report = document(found)
    save_ice(baseline_ice(found), folder / "baseline.json")
    save_ice(improved_ice(found), folder / "ice.json")
    write_json(folder / "report.json", report)
    return report
