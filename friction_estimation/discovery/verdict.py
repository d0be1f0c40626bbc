"""The verdict of a discovery, in a few plain sentences."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from curling_env.physics.state import State
from curling_env.physics.swept_draw import sweeping_gain
from friction_estimation.discovery.assessment import Assessment
from friction_estimation.discovery.data.measurement import LENS
from friction_estimation.discovery.data.references import QUANTITIES
from friction_estimation.discovery.discover import Discovery
from friction_estimation.discovery.evidence.intervals import standard_errors
from friction_estimation.discovery.model.candidates import card_of, way_of
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


def sentence(found: Discovery, assessment: Assessment | None = None) -> str:
    """The verdict, in a few sentences.

    Parameters
    ----------
    found : the discovery
    assessment : what it is worth; with it the verdict ends with the throw that would teach most
    """
    following = assessment.next_throws[:1] if assessment else []
    teaching = [f"Most would be learnt from a throw of {throw.words}." for throw in following]
    return " ".join([_verdict(found), *teaching])


def _verdict(found: Discovery) -> str:
    """What is missing, what is off, and what the session cannot show."""
    if not found.enough:
        count = len(found.session)
        too_few = (
            f"Nothing is named: {count} {'throw slides' if count == 1 else 'throws slide'} freely, "
            f"and fewer than {LEAST_THROWS} cannot tell an effect from chance."
        )
        return f"{too_few} {OTHER_ICE}" if found.fits_worse_than_uniform else too_few
    names = list(dict.fromkeys(readable(effect.label) for effect in found.effects))
    parts: list[str] = []
    if names:
        listed = " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)
        before, after = found.gaps["before"].rest_error, found.gaps["after"].rest_error
        floor = found.gaps["noise_floor"].rest_error
        where, digits = "come to rest", 0
        if found.session.gates is not None:
            where, digits = "are at the last gate", 1
        parts.append(
            f"The model lacks {listed}; with {'them' if len(names) > 1 else 'it'}, throws it never "
            f"saw {where} {100 * after:.{digits}f} cm from the forecast instead of "
            f"{100 * before:.{digits}f} cm (a perfect model: {100 * floor:.{digits}f} cm)"
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
        gain = metres_gained(found)
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


def blind_spots(found: Discovery, *, no_heading: str = NO_HEADING) -> list[str]:
    """Sentences on what the session, as it was played, cannot show.

    Parameters
    ----------
    found : the discovery
    no_heading : what is said where no heading was measured
    """
    sentences: list[str] = []
    states, turns = found.final.states, found.session.turns
    if len(np.unique(np.sign(states[:, State.VY]))) == 1:
        sentences.append(ONE_WAY)
    if not turns.any():
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
