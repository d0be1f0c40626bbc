"""Missing effects found by a discovery, for people at the rink, and what would settle them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any

import msgspec

from curling_env.infrastructure.files.schema import Short, Text, checked
from curling_env.physics.effects import catalogue
from friction_estimation.discovery.report import REPORT_FORMAT
from friction_estimation.discovery.verdict import readable


class FoundEffect(msgspec.Struct, kw_only=True):
    """An effect in a report, as far as it is used here."""

    name: Short
    kind: Short = "physics"
    where: Text = ""
    alternatives: list[Short] = msgspec.field(default_factory=list[str])
    depends_on: list[Short] = msgspec.field(default_factory=list[str])
    evidence: dict[str, Any] = msgspec.field(default_factory=dict[str, Any])


class FoundThrow(msgspec.Struct, kw_only=True):
    """A throw worth making."""

    words: Text
    teaches: dict[Short, float] = msgspec.field(default_factory=dict[str, float])


class Report(msgspec.Struct, kw_only=True):
    """A discovery's report, as far as it is used here; `discovery.report` writes it."""

    verdict: Annotated[str, msgspec.Meta(max_length=20_000)]
    remarks: Annotated[list[Text], msgspec.Meta(max_length=50)] = msgspec.field(
        default_factory=list[Text]
    )
    effects: Annotated[list[FoundEffect], msgspec.Meta(max_length=200)]
    next_throws: Annotated[list[FoundThrow], msgspec.Meta(max_length=50)] = msgspec.field(
        default_factory=list[FoundThrow]
    )


@dataclass(frozen=True, kw_only=True)
class Missing:
    """Something that the model of the ice lacked.

    Parameters
    ----------
    title : what it is, such as ``the curl``
    words : by what it shows, and where
    unsure : what it may be instead; empty where the throws show it clearly
    settled_by : the throw that would tell them apart; empty where none is known
    """

    title: str
    words: str
    unsure: tuple[str, ...] = ()
    settled_by: str = ""


@dataclass(frozen=True, kw_only=True)
class Findings:
    """Findings of a discovery for people at the rink.

    Parameters
    ----------
    verdict : its sentence
    remarks : further sentences, such as what the session cannot show
    missing : what the model lacked; empty where nothing is missing
    next_throws : the throws that would teach most, in the order in which to make them, and for each
        what it teaches
    """

    verdict: str
    remarks: tuple[str, ...] = ()
    missing: tuple[Missing, ...]
    next_throws: tuple[tuple[str, str], ...]


def findings(report: Mapping[str, Any]) -> Findings:
    """Return the findings of a discovery's report, in plain words.

    Parameters
    ----------
    report : content of a `report.json`

    Raises
    ------
    InputError : it is no report of a discovery
    """
    found = checked(REPORT_FORMAT.accept(report), Report)
    return Findings(
        verdict=found.verdict,
        remarks=tuple(found.remarks),
        missing=tuple(_missing(effect) for effect in found.effects),
        next_throws=tuple((throw.words, _teaches(throw)) for throw in found.next_throws),
    )


def _missing(effect: FoundEffect) -> Missing:
    if effect.name == "unknown":
        follows = ", ".join(effect.depends_on)
        return Missing(
            title="something that no known effect explains",
            words=effect.where or (f"it follows {follows}" if follows else ""),
        )
    card = catalogue().get(effect.name)
    separating = effect.evidence.get("separating_throws")
    settled = ""
    if effect.alternatives and isinstance(separating, dict):
        settled = str(separating.get(effect.alternatives[0], ""))
    if not settled and card is not None and effect.alternatives:
        settled = card.measured_by
    return Missing(
        title=readable(effect.name),
        words=effect.where,
        unsure=tuple(readable(name) for name in effect.alternatives),
        settled_by=settled,
    )


def _teaches(throw: FoundThrow) -> str:
    if not throw.teaches:
        return ""
    name, share = max(throw.teaches.items(), key=lambda item: item[1])
    return f"it removes {100 * share:.0f} % of what is not known of {readable(name)}"
