"""A discovery in words: verdict, alternatives, and limits of the session."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from curling_env.analysis.swept_draw import sweeping_gain
from curling_env.physics.state import State
from friction_estimation.discovery.data.measurement import LENS
from friction_estimation.discovery.data.references import QUANTITIES
from friction_estimation.discovery.discover import Discovery
from friction_estimation.discovery.evidence.intervals import standard_errors
from friction_estimation.discovery.model.candidates import card_of, way_of
from friction_estimation.discovery.tuning import CLEARLY_OFF, LARGEST_SPREAD, LEAST_THROWS

GATES_SHOW = (
    "Gate times show one friction for the sheet and its dependence on speed, but no sweeping; "
    "differences from place to place and forces across the sheet need tracks from film."
)
NO_HEADING = "No heading was measured, so curl and spin remain unknown."
ONE_WAY = (
    "All throws went one way: a slope along the sheet cannot be distinguished from friction until "
    "some come back."
)
ONE_SPIN = (
    "All stones turned the same way: curl cannot be distinguished from a slope across the sheet "
    "until some turn the other way."
)
NO_SCENE = (
    "The lens was tested without the camera's scene: all lengths and sizes may be off by some per "
    "cent; give --scene or --known-length."
)
NEARER = 0.95
"""Maximum ratio of forecast errors, after to before, of an improved model."""
OTHER_ICE = (
    "The given ice fits these throws worse than uniform friction; check that it is of this ice "
    "and this sheet."
)


def readable(label: str) -> str:
    """Return the effect of a label in plain words, without its stone."""
    way = way_of(label)
    return way.words if way is not None else label.partition("[")[0].replace("_", " ")


def number(value: float) -> float:
    """Round a value to six significant digits."""
    return float(f"{value:.6g}")


def sentence(found: Discovery) -> str:
    """Return the verdict in one sentence."""
    count = len(found.session)
    if not found.enough:
        return (
            f"No effect is named: {count} {'throw slides' if count == 1 else 'throws slide'} "
            f"freely, and naming one needs {LEAST_THROWS} or more."
        )
    before, after, floor = (
        100.0 * found.gaps[name].rest_error for name in ("before", "after", "noise_floor")
    )
    where = "stop" if found.session.gates is None else "pass the last gate"
    lacking = _missing_effects(found)
    parts = [f"the model lacks {_and(lacking)}"] if lacking else []
    parts += _off(found)
    what = ", and ".join(parts)
    if not parts:
        corrected = _corrections(found)
        what = f"nothing is missing{', but ' * bool(corrected)}{_and(corrected)}"
    how_far = f"{where} {_centimetres(after)} cm from the forecast"
    if after < NEARER * before:
        how_far = f"now {how_far}, not {_centimetres(before)}"
    else:
        how_far = f"{how_far}, and a perfect model would be off by {_centimetres(floor)}"
    return f"{what[0].upper()}{what[1:]}: fresh throws {how_far}."


def _missing_effects(found: Discovery) -> list[str]:
    """Return the effects that the model lacks, each with its alternatives."""
    named: dict[str, list[str]] = {}
    for effect in found.effects:
        others = [readable(other.name) for other in found.alternatives.get(effect.label, [])]
        named.setdefault(readable(effect.label), []).extend(others)
    lacking = [" or else ".join(dict.fromkeys([name, *others])) for name, others in named.items()]
    if found.unknown:
        variables = [in_words(d.followed) for d in found.dependences]
        scatter = scatter_in_words(found)
        follows = f" that follows {_and(variables)}" if variables else ""
        lacking.append(f"something unknown{follows or (scatter and f', by which {scatter}')}")
    return lacking


def scatter_in_words(found: Discovery) -> str:
    """Describe friction that differs from throw to throw; empty where more, or less, is left."""
    spread = found.final.model.spread
    if found.dependences or not found.after.white or spread <= LARGEST_SPREAD:
        return ""
    return f"friction differs by {100 * spread:.0f} % from throw to throw"


def _off(found: Discovery) -> list[str]:
    """Return wrong scales of the tracks, and exceptional throws, in words."""
    parts = [
        f"{QUANTITIES[c.name].plural} in the tracks are {100 * abs(c.factor - 1):.1f} % too "
        f"{'long' if c.factor > 1 else 'short'} by what was given"
        for c in found.calibrations
        if c.clearly_off and c.references
    ]
    if found.events:
        parts.append(f"a single event disturbed throw {_and([str(t) for t in found.events])}")
    return parts


def in_words(variable: str) -> str:
    """Return a variable that the unknown follows, in words."""
    words = {
        "t": "the time since release",
        "clock": "the time of the session",
        "x": "the line",
        "y": "the place along the sheet",
        "direction": "the direction of play",
        "theta": "the heading of the handle",
        "order": "the order of play",
        "swept": "the sweeping",
    }
    return words.get(variable, f"the {variable}")


def _and(words: Sequence[str]) -> str:
    """Join a list in words."""
    return " and ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)


def _centimetres(value: float) -> str:
    """Return a distance in centimetres, rounded for people."""
    return f"{value:.0f}" if value >= 2.0 else f"{value:.1f}"


def doubts(found: Discovery) -> list[str]:
    """Return a sentence for each alternative to a named effect, with a throw that would decide, and
    one if the fit to all throws leaves friction that differs too much between them.
    """
    sentences = [
        f"{name[0].upper()}{name[1:]} or {readable(other.name)}? These throws do not decide"
        f"{f'; this one would: {other.throw}' if other.throw else ''}."
        for effect in found.effects
        for name in [readable(effect.label)]
        for other in found.alternatives.get(effect.label, [])
    ]
    spread = found.final.model.spread
    if found.effects and not found.unknown and spread > LARGEST_SPREAD:
        sentences.append(
            f"In the fit to all throws friction differs by {100 * spread:.0f} % from throw to "
            "throw, more than on any one ice: an effect may be wrong, or in the wrong place."
        )
    return sentences


def remarks(found: Discovery) -> list[str]:
    """Return corrections of a given model, the gain of sweeping, and limits of the session."""
    sentences: list[str] = []
    corrected = _corrections(found)
    if corrected and (found.effects or found.unknown):
        sentences.append(f"In the given model, {_and(corrected)}.")
    strengths = [c["name"] for c in changes(found) if _is_strength(c)]
    if "sweeping" in [effect.label for effect in found.effects] + strengths:
        gain = metres_gained(found)
        sentences += [f"A{gain_in_words(gain)[1:]}."] if gain else []
    return [*sentences, *blind_spots(found)]


def terminal_text(report: Mapping[str, Any]) -> str:
    """Return a report for a terminal: verdict, alternatives and remarks, one per line."""
    lines = [report["verdict"], *report["doubts"], *report["remarks"]]
    lines += [
        f"Most informative next throw: {t['words']}." for t in report.get("next_throws", [])[:1]
    ]
    return "\n".join(lines)


def _corrections(found: Discovery) -> list[str]:
    """Return corrected strengths of the given model, in words."""
    return [_change_in_words(c) for c in changes(found) if _is_strength(c)]


def changes(found: Discovery) -> list[dict[str, Any]]:
    """Return corrected strengths and shapes of the given model."""
    errors = standard_errors(found.final)
    given = {e.name: e.parameters for e in found.given.effects} if found.given else {}
    out: list[dict[str, Any]] = []
    for term in found.final.model.terms:
        for name in term.free if term.name in given and term.stone is None else ():
            before = given[term.name].get(name, term.card.parameter(name).default)
            error = errors[term.label, name]
            if before is None or abs(term.values[name] - before) < CLEARLY_OFF * error:
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
    """Return whether a change is one of strength, not of shape."""
    card = card_of(change["name"])
    return card is not None and card.parameter(change["parameter"]).neutral is not None


def _change_in_words(change: Mapping[str, Any]) -> str:
    """Return a corrected parameter in words, such as "curl is 12 % weaker than given"."""
    name, parameter = readable(change["name"]), change["parameter"].replace("_", " ")
    before, after = change["given"], change["found"]
    card = card_of(change["name"])
    neutral = None if card is None else card.parameter(change["parameter"]).neutral
    if neutral is not None and before != neutral and (after - neutral) / (before - neutral) > 0:
        part = (after - neutral) / (before - neutral) - 1.0
        return (
            f"{name} is {100 * abs(part):.0f} % {'stronger' if part > 0 else 'weaker'} than given"
        )
    return f"the {parameter} of {name} is {after:.2g}, not {before:.2g}"


def blind_spots(found: Discovery, *, no_heading: str = NO_HEADING) -> list[str]:
    """Return sentences on the limits of the session.

    Parameters
    ----------
    found : the discovery
    no_heading : sentence for sessions in which no heading was measured
    """
    sentences: list[str] = []
    states, turns = found.final.states, found.session.turns
    if len(np.unique(np.sign(states[:, State.VY]))) == 1:
        sentences.append(ONE_WAY)
    if found.session.gates is not None:
        sentences.append(GATES_SHOW)
    elif not turns.any():
        sentences.append(no_heading)
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


def metres_gained(found: Discovery) -> dict[str, Any] | None:
    """Return the gain of a draw by sweeping on the improved ice, at the end of the session."""
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
    """Describe the effect of sweeping on a draw.

    Parameters
    ----------
    gain : ``metres_gained`` of a report
    """
    way = "{:.2f} ± {:.2f} m further" if gain["value"] >= 0 else "{:.2f} ± {:.2f} m shorter"
    how_far = way.format(abs(gain["value"]), gain["stderr"])
    return f"a draw swept over the last third of its path runs {how_far}"
