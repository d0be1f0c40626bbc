"""Meaning of every number of an observation, from the environments themselves."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from typing import Any

_ASKED = re.compile(r"^```\{observation\} (\S+)(.*)\n```$", re.MULTILINE)


def filled_in(text: str) -> str:
    """Return a page with a table in place of each request for one.

    The block is ``{observation} NAME OPTION=NUMBER …`` and empty.
    """
    return _ASKED.sub(lambda asked: table(asked[1], asked[2]), text)


def table(name: str, options: str = "") -> str:
    """Return numbers, names and meanings of an environment's flat observation, in Markdown."""
    lines = ["| Numbers | Name | Meaning, and what counts as 1 |", "|---|---|---|"]
    for first, last, label, meaning in rows(names_of(name, options)):
        place = str(first) if first == last else f"{first}–{last}"
        lines.append(f"| {place} | {label} | {meaning} |")
    return "\n".join(lines)


def names_of(name: str, options: str = "") -> tuple[str, ...]:
    """Return the names of the numbers from the environment."""
    import gymnasium

    import curling_env  # noqa: F401  registers the environments

    given: dict[str, Any] = {
        key: int(value) for key, value in (word.split("=") for word in options.split())
    }
    env = gymnasium.make(name, **given)
    return tuple(env.unwrapped.observation.names)  # pyright: ignore[reportAttributeAccessIssue]


def rows(names: tuple[str, ...]) -> Iterator[tuple[int, int, str, str]]:
    """Return first and last number, name and meaning; rows that differ only by their number are
    merged.

    Raises
    ------
    KeyError : a name without a meaning
    """
    at = 0
    while at < len(names):
        pattern, meaning = _meaning(names[at])
        end = at
        while end + 1 < len(names) and pattern.fullmatch(names[end + 1]):
            end += 1
        label = f"`{names[at]}`" if end == at else f"`{names[at]}` … `{names[end]}`"
        yield at, end, label, meaning
        at = end + 1


def _meaning(name: str) -> tuple[re.Pattern[str], str]:
    for pattern, meaning in MEANINGS.items():
        if found := re.fullmatch(pattern, name):
            text = meaning(found) if callable(meaning) else meaning
            kind = pattern if "(?P<effect>" not in pattern else re.escape(name)
            return re.compile(kind), text
    raise KeyError(f"no meaning for {name!r} of an observation")


def _parameter(found: re.Match[str]) -> str:
    """Describe a parameter by the card of its effect."""
    from curling_env.envs.known_ice import observed_parameters
    from curling_env.physics.effects import catalogue

    effect, parameter = found["effect"], found["parameter"]
    card = next(p for p in catalogue()[effect].parameters if p.name == parameter)
    scales = {(c.name, p.name): scale for c, p, scale in observed_parameters()}
    scale = scales[effect, parameter]
    unit = "" if card.unit == "1" else f" {card.unit}"
    return f"[{effect}](../effects/{effect}.md): {card.meaning}; {scale:g}{unit} counts 1"


def _of_stone(_: re.Match[str]) -> str:
    return (
        "[stone_bias](../effects/stone_bias.md) of each stone: its friction and its curl against"
        " the others', two numbers a stone; 0 for a usual one"
    )


_PLACES = "place in the delivery frame: x counts 1 at the side line, y at 7 m from the tee"

MEANINGS: dict[str, str | Callable[[re.Match[str]], str]] = {
    "target x": "intended place of the stone, right of the centre line; half the width counts 1",
    "target y": "the same along play, from the tee, positive beyond it; 7 m count 1",
    "throws left": "share of the episode's throws still to come",
    "clock": "time since the beginning; an hour counts 1 at a task, three hours in games",
    r"next stone stone_bias\..*": "known values of the stone to be thrown: friction and curl"
    " against the others'; 0 for a usual one",
    r"stones delivered": "stones delivered in this end, of all",
    "own stones left": "stones still to deliver, of the team's own",
    "hammer": "1 with the last stone, -1 without",
    "lead": "points ahead; eight count 1",
    "ends left": "ends still to play, of all",
    "extra end": "1 in an extra end",
    "guards protected": "1 while guards may not be removed",
    "own power play left": "1 while it is still available (mixed doubles)",
    "their power play left": "the same of the opponent",
    "throws": "throws since the game began; 160 count 1",
    "mean friction": "logarithm of the mean friction over 0.01; e² times as much counts 1",
    r"friction of band \d+, \w+": "friction of eight bands from the delivery hog line to the far"
    " back line, each by thirds of the width, against the mean; 20 % more counts 1",
    r"wear of band \d+, \w+": "wear of each of these since the game began; 5 % count 1",
    r"(own |their )?stone \d+ stone_bias\..*": _of_stone,
    r"(own |their )?stone \d+ (team|present|x|y)": "three numbers a stone: its team (1 own, -1"
    " other; in games 1 if it is on the sheet), 0 for none, and its " + _PLACES,
    r"(?P<effect>[a-z_]+)( \d+)?\.(?P<parameter>\w+)": _parameter,
}
"""Meaning of names by pattern; the first match counts."""
