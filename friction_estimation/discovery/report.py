"""A discovery in words and numbers: the report, and the two ice files."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from curling_env.ice import save_ice
from curling_env.infrastructure.storage import write_json
from curling_env.physics.state import State
from curling_env.physics.sweeping_gain import sweeping_gain
from friction_estimation.discovery.assessment import Assessment
from friction_estimation.discovery.data.measurement import LENS
from friction_estimation.discovery.data.references import QUANTITIES, Calibration, QuantityError
from friction_estimation.discovery.discover import Discovery
from friction_estimation.discovery.evidence.intervals import standard_errors, with_sides
from friction_estimation.discovery.evidence.significance import EffectEvidence
from friction_estimation.discovery.model.candidates import Term, card_of, effect_of, way_of
from friction_estimation.discovery.model.friction_field import FrictionField
from friction_estimation.discovery.tuning import CLEARLY_CHANGED, LEAST_THROWS

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


def readable(label: str) -> str:
    """The effect of a label in plain words, without its stone."""
    way = way_of(label)
    return way.words if way is not None else label.partition("[")[0].replace("_", " ")


def number(value: float) -> float:
    """A value rounded to six significant digits."""
    return float(f"{value:.6g}")


def document(
    found: Discovery,
    assessment: Assessment | None = None,
    provenance: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """The report, as `report.json` holds it.

    Parameters
    ----------
    found : the discovery
    assessment : what it is worth; without it the report does not say
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
        "verdict": sentence(found),
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
        "candidates": ranked_candidates(found),
        "smallest_detectable": smallest_detectable(found),
        "undecidable": _undecidable(found),
        "left_out": list(found.session.left_out),
        **(assessment.as_dict() if assessment else {}),
        **({"provenance": dict(provenance)} if provenance else {}),
    }


def sentence(found: Discovery) -> str:
    """The verdict, in a sentence or two."""
    if not found.enough:
        count = len(found.session)
        return (
            f"Nothing is named: {count} {'throw slides' if count == 1 else 'throws slide'} freely, "
            f"and fewer than {LEAST_THROWS} cannot tell an effect from chance."
        )
    names = list(dict.fromkeys(readable(effect.label) for effect in found.effects))
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
    corrected = [c for c in changes(found) if _is_strength(c)]
    if corrected:
        parts.append("as to the model given, " + ", ".join(map(_change_in_words, corrected)))
    if found.unknown:
        variables = [d.variable for d in found.dependences]
        what = f" that follows {', '.join(variables)}" if variables else ""
        parts.append(f"{'something' if names else 'Something'} unknown{what} is missing")
    for c in found.calibrations:
        if c.clearly_off and c.references:
            off = f"{100 * abs(c.factor - 1):.1f} % too {'long' if c.factor > 1 else 'short'}"
            parts.append(f"{QUANTITIES[c.name].plural} in the tracks are {off}, by what was given")
    if found.events:
        throws = ", ".join(str(throw) for throw in found.events)
        parts.append(f"something happened once in throw {throws}")
    if not parts or (corrected and len(parts) == 1):
        parts.insert(0, "Nothing is missing: what is left is noise, by these throws")
    sentences = ["; ".join(parts)]
    if "sweeping" in [effect.label for effect in found.effects] + [c["name"] for c in corrected]:
        gain = _metres_gained(found)
        sentences += [gain_in_words(gain)] if gain else []
    return " ".join([*(f"{s[0].upper()}{s[1:]}." for s in sentences), *blind_spots(found)])


def changes(found: Discovery) -> list[dict[str, Any]]:
    """Strengths and shapes of the given model that the throws correct."""
    errors = standard_errors(found.final)
    given = {e.name: e.parameters for e in found.given.effects} if found.given else {}
    out: list[dict[str, Any]] = []
    for term in found.final.model.terms:
        for name in term.free if term.name in given and term.stone is None else ():
            before = given[term.name].get(name, term.card.parameter(name).default)
            error = errors[term.label, name]
            if before is None or abs(term.values[name] - before) < CLEARLY_CHANGED * error:
                continue
            out.append(
                {
                    "name": term.name,
                    "parameter": name,
                    "given": number(before),
                    "found": number(term.values[name]),
                    "stderr": number(error),
                }
            )
    return out


def _is_strength(change: Mapping[str, Any]) -> bool:
    """Whether a change is one of strength, and not of shape."""
    card = card_of(change["name"])
    return card is not None and card.parameter(change["parameter"]).neutral is not None


def _change_in_words(change: Mapping[str, Any]) -> str:
    """A corrected parameter in words, such as "curl is 12 % weaker than given"."""
    name, parameter = readable(change["name"]), change["parameter"].replace("_", " ")
    before, after = change["given"], change["found"]
    card = card_of(change["name"])
    neutral = None if card is None else card.parameter(change["parameter"]).neutral
    if neutral is not None and before != neutral and (after - neutral) / (before - neutral) > 0:
        part = (after - neutral) / (before - neutral) - 1.0
        return (
            f"{name} is {100 * abs(part):.0f} % {'stronger' if part > 0 else 'weaker'} than given"
        )
    return f"the {parameter} of {name} is {after:.2g} and not {before:.2g}"


def blind_spots(found: Discovery) -> list[str]:
    """Sentences on what the session, as it was played, cannot show."""
    sentences: list[str] = []
    states, turns = found.final.states, found.session.turns
    if len(np.unique(np.sign(states[:, State.VY]))) == 1:
        sentences.append(ONE_WAY)
    if not turns.any():
        sentences.append(NO_HEADING)
    elif len(np.unique(np.sign(states[turns, State.OMEGA]))) == 1:
        sentences.append(ONE_SPIN)
    lens = [term for term in found.final.model.terms if term.name == LENS]
    if (
        lens
        and "k1" in lens[0].values
        and not any(c.name == "scale_error" for c in found.calibrations)
    ):
        sentences.append(NO_SCENE)
    if found.fits_worse_than_uniform:
        sentences.append(OTHER_ICE)
    return sentences


def _parameters(term: Term, sigma: Mapping[tuple[str, str], float]) -> dict[str, Any]:
    if term.map_field is not None:
        return _parameters_of_map(term.map_field)
    out: dict[str, Any] = {}
    for p in term.card.parameters:
        if p.name not in term.free and p.default is not None:
            continue  # at its default: these data say nothing of it
        error = sigma.get((term.label, p.name), 0.0)  # an identifier has none
        out[p.name] = {
            "value": number(term.values[p.name]),
            "stderr": number(error),
            "unit": p.unit,
        }
    return out


def _parameters_of_map(field: FrictionField) -> dict[str, Any]:
    """How uneven the ice is where stones ran; the map itself is in the ice file."""
    spread = float(field.ln_mu.ravel()[field.crossed].std())
    return {
        "spread": {
            "value": number(spread),
            "stderr": number(spread / np.sqrt(2.0 * len(field))),
            "unit": "1",
        },
        "length": {
            "value": number(field.length),
            "stderr": number(0.25 * field.length),
            "unit": "m",
        },
    }


def _named(
    found: Discovery, effect: EffectEvidence, sigma: Mapping[tuple[str, str], float]
) -> dict[str, Any]:
    term = found.final.model.term(effect.label)
    others = found.alternatives.get(effect.label, [])
    clear = np.argsort(-effect.improvements)[:3]
    numbers = np.sort(found.session.throws)[np.sort(clear)]
    sign = (term.variant or term.card).evidence
    where = f"{sign}; clearest in throws {', '.join(str(n) for n in numbers)}"
    return {
        "name": term.name,
        "kind": "physics" if term.card.is_physical else "measurement",
        "parameters": _parameters(term, sigma),
        "depends_on": [],
        "where": where,
        "evidence": {
            "label": effect.label,
            "gain": number(effect.gain),
            "p": number(effect.p),
            "p_holm": number(effect.corrected),
            "throws_improved": int((effect.improvements > 0).sum()),
            "throws": len(effect.improvements),
            "closure": number(found.closure),
            "runner_up": found.runner_up(effect.label),
            "separating_throws": {a.name: a.throw for a in others},
            **({"metres_gained": _metres_gained(found)} if term.name == "sweeping" else {}),
        },
        "alternatives": [a.name for a in others],
    }


def _metres_gained(found: Discovery) -> dict[str, Any] | None:
    """What sweeping gains a draw on the improved ice, at the end of the session."""
    session = found.session
    gain = sweeping_gain(
        found.improved_ice(),
        clock=float(session.clocks.max()),
        order=int(session.orders.max()) + 1,
        stone=int(session.stones[-1]),
    )
    if gain is None:
        return None
    return {"value": number(gain.metres), "stderr": number(gain.stderr), "unit": "m"}


def gain_in_words(gain: Mapping[str, Any]) -> str:
    """How far sweeping carries a draw.

    Parameters
    ----------
    gain : ``metres_gained`` of a report
    """
    way = "{:.2f} ± {:.2f} m further" if gain["value"] >= 0 else "{:.2f} ± {:.2f} m less far"
    how_far = way.format(abs(gain["value"]), gain["stderr"])
    return f"a draw swept over the last third of its way runs {how_far}"


def _calibration(found: Calibration) -> dict[str, Any]:
    what = QUANTITIES[found.name].singular
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
    open_: list[QuantityError] = [name for name in QUANTITIES if name not in decided]
    what = [QUANTITIES[name].plural for name in open_]
    checks = [QUANTITIES[name].check for name in open_]
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
        "depends_on": [d.variable for d in found.dependences],
        "where": "; ".join(f"a push {d.push} that follows {d.variable}" for d in found.dependences)
        or "no single variable stands out",
        "evidence": {
            "slow_misfit": number(found.after.ratio),
            "tolerated": found.after.tolerated,
            "shares": {d.variable: number(d.share) for d in found.dependences},
            "p": {d.variable: number(d.p) for d in found.dependences},
            "proxies": list(dict.fromkeys(effect_of(label) for label in found.unproved)),
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


def ranked_candidates(found: Discovery) -> list[dict[str, Any]]:
    """Candidates in the order of their gain over the baseline."""
    if not found.selection.rounds:
        return []
    first = found.selection.rounds[0]
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
        {"name": score.term.label, "gain": number(score.gain), "needed": None, "closure": None}
        for score in first.scores
        if score.term.label not in fitted
    ]
    return rows


def smallest_detectable(found: Discovery) -> dict[str, dict[str, float]]:
    """The smallest effect that these throws would have shown, by candidate and parameter."""
    if not found.selection.rounds:
        return {}
    return {
        score.term.label: {name: number(value) for name, value in score.smallest.items()}
        for score in found.selection.rounds[-1].scores
    }


def write_files(
    found: Discovery,
    folder: Path,
    *,
    assessment: Assessment | None = None,
    provenance: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """Write report.json, baseline.json and ice.json, and return the report.

    Parameters
    ----------
    found : the discovery
    folder : existing folder to write to
    assessment, provenance : as of `document`
    """
    report = document(found, assessment, provenance)
    origin = provenance or {}  # not that of the ice that was given
    save_ice(found.baseline_ice(), folder / "baseline.json", provenance=origin)
    save_ice(found.improved_ice(), folder / "ice.json", provenance=origin)
    write_json(folder / "report.json", report)
    return report
