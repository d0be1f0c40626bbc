"""What the coaching functions found, as tables and sentences that a coach reads."""

from __future__ import annotations

from collections.abc import Sequence

from agents.coaching.athletes import AthleteErrors, ErrorSummary, Interval
from agents.coaching.misses.causes import CAUSES, INTERVAL, Cause, Part, Pattern, SessionCauses
from agents.coaching.stones import StoneFactor, StoneMatch, StonePair
from curling_env.units import Units, length, short_length, side, speed
from friction_estimation.reports.throws_section import NOT_SEEN, ThrowRows

CAUSE_WORDS: dict[Cause, str] = {
    "weight": "weight",
    "line": "line",
    "rotation": "rotation",
    "ice": "ice read wrong",
    "sweeping": "sweeping",
    "neither": "unexplained",
}
"""What the causes are called."""
SMALL = 0.02
"""A part of a miss below which it is nought [m]."""
NOTED_MEAN = 0.1
"""A mean part from which on it is worth telling [m]."""


def offset(right: float, past: float, units: Units = Units.METRES) -> str:
    """A way on the ice in words: along play first, without what is small beside the rest.

    Parameters
    ----------
    right, past : to the right, and along play [m]
    units : what lengths are told in
    """
    least = max(SMALL, 0.2 * max(abs(right), abs(past)))
    parts = [
        side(value, units, right=name)
        for value, name in ((past, "past"), (right, "right"))
        if abs(value) >= least
    ]
    return ", ".join(parts) or "0"


# --- hand or ice ---------------------------------------------------------------------------------


def causes_rows(found: SessionCauses, units: Units = Units.METRES) -> ThrowRows:
    """A row for each throw: its miss, and what each cause added to it."""
    causes: list[Cause] = [c for c in CAUSES if any(c in one.parts for one in found.throws)]
    if not found.believed and not any(
        one.parts["ice"].size > SMALL for one in found.throws if "ice" in one.parts
    ):
        causes.remove("ice")
    head = ["throw", "athlete", "called", "miss", *(CAUSE_WORDS[c] for c in causes), "mostly"]
    rows = [
        [
            str(one.throw),
            one.athlete,
            one.call.text,
            offset(float(one.miss[0]), float(one.miss[1]), units),
            *(part_in_words(one.parts.get(cause), units) for cause in causes),
            CAUSE_WORDS[one.main],
        ]
        for one in found.throws
    ]
    return _without_empty(head, rows, numeric=("throw",))


def part_in_words(part: Part | None, units: Units = Units.METRES) -> str:
    """What a cause added, with half its 95 % interval along its larger way."""
    if part is None:
        return NOT_SEEN
    larger = max((part.right, part.past), key=lambda one: abs(one.value))
    half = INTERVAL * (larger.sigma or 0.0)
    told = offset(part.right.value, part.past.value, units)
    return f"{told} ± {short_length(half, units)}" if half >= 0.005 else told


def pattern_in_words(pattern: Pattern, units: Units = Units.METRES) -> str:
    """What some throws have in common, in a sentence or two."""
    who = "All throws" if pattern.athlete is None else pattern.athlete
    count = "one throw" if pattern.throws == 1 else f"{pattern.throws} throws"
    ordered = sorted(pattern.shares, key=lambda cause: -pattern.shares[cause].value)
    shares = [
        f"{100 * pattern.shares[cause].value:.0f} % {CAUSE_WORDS[cause]}"
        for cause in ordered
        if abs(pattern.shares[cause].value) >= 0.005
    ]
    words = (
        f"{who} ({count}): {length(pattern.typical_miss, units)} from the target (root mean "
        f"square); of that {', '.join(shares)}."
    )
    again = [
        f"{CAUSE_WORDS[cause]} {offset(right, past, units)}"
        for cause, ways in pattern.mean.items()
        if pattern.throws > 2
        for right, past in [
            tuple(
                way.value
                if abs(way.value) > max(INTERVAL * (way.sigma or 0.0), NOTED_MEAN)
                else 0.0
                for way in ways
            )
        ]
        if right or past
    ]
    return f"{words} Again and again: {'; '.join(again)}." if again else words


def session_in_words(found: SessionCauses, units: Units = Units.METRES) -> list[str]:
    """The pattern of a session, of each athlete, and what was left out."""
    patterns = [found.pattern] if found.pattern is not None else []
    if len(found.athletes) > 1 or (found.athletes and found.athletes[0].throws < len(found.throws)):
        patterns += found.athletes
    sentences = [pattern_in_words(pattern, units) for pattern in patterns]
    if found.throws:
        sentences.append(
            "Each cause is told as where it carried the stone; the parts add up to the miss, and ± "
            "is half a 95 % interval."
        )
    sentences += [f"left out: throw {throw}: {why}" for throw, why in found.left_out.items()]
    return sentences + list(found.remarks)


# --- athletes ------------------------------------------------------------------------------------


def athletes_rows(athletes: Sequence[AthleteErrors], units: Units = Units.METRES) -> ThrowRows:
    """A row for all throws of each athlete, then one for each handle and weight."""
    head = ["athlete", "throws", "handle", "shot", "weight", "± weight", "line", "± line"]
    head += ["rotation", "± rotation"]
    rows: list[list[str]] = []
    for one in athletes:
        for group in (one.overall, *(g for g in one.groups if _is_finest(one, g))):
            rows.append(
                [
                    one.name if group is one.overall else "",
                    str(group.throws),
                    group.handle or ("all" if group is one.overall else ""),
                    group.weight or "",
                    *_weight(one, group, units),
                    _value(group.bias[1], units),
                    short_length(group.spread[1].value, units),
                    *_rotation(one, group),
                ]
            )
    return _without_empty(head, rows, numeric=("throws",))


def athletes_in_words(athletes: Sequence[AthleteErrors], units: Units = Units.METRES) -> list[str]:
    """What is worth saying of each athlete."""
    sentences: list[str] = []
    for one in athletes:
        told: list[str] = []
        weight, line, _ = one.overall.bias
        if not weight.low <= 0 <= weight.high:
            told.append(f"throws {_weight(one, one.overall, units)[0].split(' (')[0]}")
        if not line.low <= 0 <= line.high:
            told.append(f"sends stones {side(line.value, units)} of the line")
        by_handle = [g for g in one.groups if g.handle is not None and g.weight is None]
        if line.low <= 0 <= line.high and not by_handle:
            by_handle = [g for g in one.groups if g.handle is not None and _is_finest(one, g)]
        for group in by_handle:
            low, high = group.bias[1].low, group.bias[1].high
            if line.low <= 0 <= line.high and not low <= 0 <= high:
                told.append(f"{group.handle}s {side(group.bias[1].value, units)}")
        name = one.name or "Throws of nobody"
        count = f"{one.overall.throws} throws in {_sessions(one.sessions)}"
        sentences.append(
            f"{name} ({count}): {', '.join(told) or 'nothing that happens again and again'}."
        )
    if athletes:
        sentences.append(
            "Weight, line and rotation are told with their 95 % intervals; the columns with ± are "
            "the spread from throw to throw, without that of the measurement."
        )
    return sentences


def _sessions(count: int) -> str:
    return "one session" if count == 1 else f"{count} sessions"


def _is_finest(one: AthleteErrors, group: ErrorSummary) -> bool:
    """Whether a group is one of those that are not told again as part of another."""
    whole = (group.handle is None) + (group.weight is None)
    some = {(g.handle is None) + (g.weight is None) for g in one.groups}
    return whole == min(some, default=0) and group.throws < one.overall.throws


def _weight(one: AthleteErrors, group: ErrorSummary, units: Units) -> tuple[str, str]:
    """Bias and spread of the weight, as times where that is known."""
    bias, spread = group.bias[0], group.spread[0]
    each = one.seconds_per_speed
    if each is None:
        sign = "+" if bias.value > 0 else "−"
        return f"{sign}{speed(abs(bias.value), units)}", speed(spread.value, units)
    value = each * bias.value
    sign = 1.0 if value > 0 else -1.0
    low, high = sorted((sign * each * bias.low, sign * each * bias.high))
    return (
        f"{abs(value):.2f} s {'light' if value > 0 else 'heavy'} ({_range(low, high, 2)})",
        f"{abs(each) * spread.value:.2f} s",
    )


def _range(low: float, high: float, digits: int) -> str:
    return f"{low:.{digits}f} to {high:.{digits}f}".replace("-", "−")


def _value(bias: Interval, units: Units) -> str:
    half = short_length((bias.high - bias.low) / 2, units)
    return f"{side(bias.value, units)} ± {half}"


def _rotation(one: AthleteErrors, group: ErrorSummary) -> tuple[str, str]:
    bias, spread, each = group.bias[2], group.spread[2], one.turns_per_spin
    if not (one.errors[:, 2] == one.errors[:, 2]).any():
        return NOT_SEEN, NOT_SEEN
    if each is None:
        return f"{bias.value:+.2f} rad/s".replace("-", "−"), f"{spread.value:.2f} rad/s"
    value = round(each * bias.value, 1) + 0.0
    word = "more" if value > 0 else "fewer"
    told = f"{abs(value):.1f} turns {word}" if value else "0"
    return told, f"{each * spread.value:.1f} turns"


# --- stones --------------------------------------------------------------------------------------


def stones_rows(found: StoneMatch, units: Units = Units.METRES) -> ThrowRows:
    """A row for each stone, the keenest first."""
    head = ["stone", "throws", "friction", "on a draw", "curl"]
    rows = [
        [
            one.stone,
            str(one.throws),
            _percent(one.friction, "heavier", "keener"),
            _carry(one, units),
            NOT_SEEN if one.curl is None else _percent(one.curl, "more", "less"),
        ]
        for one in found.stones
    ]
    return _without_empty(head, rows, numeric=("throws",))


def _percent(one: Interval, above: str, below: str) -> str:
    value = 100 * (one.value - 1)
    sign = 1.0 if value > 0 else -1.0
    low, high = sorted(100 * sign * (x - 1) for x in (one.low, one.high))
    return f"{abs(value):.1f} % {above if value > 0 else below} ({_range(low, high, 1)})"


def _carry(one: StoneFactor, units: Units) -> str:
    word = "further" if one.carry.value > 0 else "shorter"
    half = (one.carry.high - one.carry.low) / 2
    return f"{short_length(one.carry.value, units)} {word} ± {short_length(half, units)}"


def stones_in_words(found: StoneMatch, units: Units = Units.METRES) -> list[str]:
    """Pairs, and which throws would tell the rest apart."""
    pairs = "; ".join(
        f"{p.first} and {p.second} ({short_length(p.apart, units)} apart)" for p in found.pairs
    )
    sentences = [f"Pairs that run most alike on a draw: {pairs}."]
    if found.undecided:
        shown = "; ".join(map(_undecided, found.undecided[:6]))
        rest = len(found.undecided) - 6
        more = f"; and {rest} more" if rest > 0 else ""
        sentences.append(f"Not told apart yet: {shown}{more}.")
        sentences.append(
            "Draws tell most, from the hog line to rest and unswept, all down the same line: in- "
            "and out-turns in turn, and the stones in the order A B B A, so that ice that changes "
            "favours none."
        )
    else:
        sentences.append("Every pair is told: they differ, or are alike enough for any player.")
    sentences += [f"left out: throw {throw}: {why}" for throw, why in found.left_out.items()]
    return sentences + list(found.remarks)


def _undecided(pair: StonePair) -> str:
    count = "one more draw" if pair.more == 1 else f"{pair.more} more draws"
    return f"{pair.first} and {pair.second} ({count} of each)"


def _without_empty(head: list[str], rows: list[list[str]], *, numeric: Sequence[str]) -> ThrowRows:
    """A table without columns that nothing fills."""
    kept = [k for k in range(len(head)) if any(row[k] not in ("", NOT_SEEN, "0") for row in rows)]
    return ThrowRows(
        head=[head[k] for k in kept],
        rows=[[row[k] for k in kept] for row in rows],
        numeric={i for i, k in enumerate(kept) if head[k] in numeric},
    )
