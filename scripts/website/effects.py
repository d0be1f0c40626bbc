"""Page for every effect of the catalogue, from its card."""

from __future__ import annotations

import math
import re

from curling_env.physics.effects import EffectCard, Parameter, catalogue

ACTS = {
    "friction": "a factor on the friction of all contacts alike",
    "contact_friction": "a factor on the friction of each contact of the running band",
    "motion": "a separate acceleration, or a factor on the others",
    "map": "the friction map itself",
    "measurement": "the camera's report; no effect on the stone",
    "nothing": "nothing: a remark in an ice file",
}


def pages() -> dict[str, str]:
    """Return a page for each card, and their list."""
    cards = catalogue()
    texts = {f"effects/{name}.md": page(card) for name, card in cards.items()}
    rows = [
        f"| [{card.title}]({name}.md) | `{name}` | {ACTS[card.acts]} |"
        for name, card in cards.items()
    ]
    table = ["| Effect | In ice files | Acts on |", "|---|---|---|", *rows]
    texts["effects/index.md"] = "\n".join(
        [
            "# The effects",
            "",
            "Every effect of ice, stone, air or measurement in the catalogue, each page from the "
            "card in its file. [Your own effect](../effects.md) is one more file.",
            "",
            *table,
            "",
            "```{toctree}",
            ":hidden:",
            "",
            *cards,
            "```",
            "",
        ]
    )
    return texts


def page(card: EffectCard) -> str:
    """Return the content of a card as a page."""
    lines = [f"# {card.title}", "", f"`{card.name}` in ice files.", ""]
    if card.equation:
        lines += ["$$", card.equation, "$$", ""]
    lines += [f"In a line: {_cell(card.formula)}", ""] if card.parameters else []
    facts = {
        "Acts on": ACTS[card.acts],
        "Shows": card.scope,
        "Energy": "it can only take it" if card.dissipative else "it may add some",
        "Source": card.source,
        "Valid for": card.validity,
        "Seen in tracks": card.evidence,
        "To measure it": card.measured_by,
    }
    lines += ["| | |", "|---|---|", *(f"| {k} | {_cell(v)} |" for k, v in facts.items()), ""]
    if card.parameters:
        heads = ("", "Name", "Unit", "Meaning", "From", "To", "Default", "Off at")
        lines += ["## Parameters", "", "| " + " | ".join(heads) + " |", "|---" * len(heads) + "|"]
        lines += [*map(_row, card.parameters), ""]
        usual = [p for p in card.parameters if p.usual is not None]
        if usual:
            lines += ["## On the ice of a usual rink", ""]
            lines += [f"- `{p.name}`: {p.usual:g} {p.unit}{_spread(p)}" for p in usual] + [""]
    for variant in card.search.variants:
        lines += [f"## Variant: {variant.readable}", ""]
        lines += [f"Switched on by `{variant.parameter}`. Seen in tracks: {variant.evidence}.", ""]
    return "\n".join(lines)


def _row(parameter: Parameter) -> str:
    cells = [f"`{parameter.name}`", parameter.unit, parameter.meaning]
    cells += [_bound(parameter.low), _bound(parameter.high)]
    cells += ["" if v is None else f"{v:g}" for v in (parameter.default, parameter.neutral)]
    symbol = f"${parameter.symbol}$" if parameter.symbol else ""
    return "| " + " | ".join([symbol, *map(_cell, cells)]) + " |"


def _spread(parameter: Parameter) -> str:
    return "" if parameter.spread is None else f", give or take {parameter.spread:g}"


def _bound(value: float) -> str:
    return f"{value:g}" if math.isfinite(value) else ""


def _cell(text: str) -> str:
    """Return text with the signs of Markdown escaped."""
    if text.startswith("`"):
        return text
    return re.sub(r"([|*_])", r"\\\1", text)
