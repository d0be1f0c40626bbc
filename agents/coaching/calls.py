"""Called shots, as a coach types them in the column `called` of `throws.csv`.

A call is a line of words in any order; capital letters do not matter:

    what       draw (or come around), guard, freeze; hit (or takeout), hit-and-stay (or stick),
               hit-and-roll, double, runback, raise, tap back, tick, peel, throw-through
    where      0.3,-1.2 in metres from the tee: right, then past (negative: short); also 2ft,-4ft;
               or in words: 4 ft short 1 ft left; or a place by its name: button, top four,
               back eight, left twelve, four foot, right corner guard; a guard without a place is a
               centre guard, a draw without one is to the button
    handle     in or out, by the athlete's hand
    broom      broom 0.6 right: its position on the far tee line, from the centre line; or
               ice 4 ft: how far from the target, to the side that the handle asks for
    weight     13.4 s (or 13.4): the time from hog line to hog line; 3.7 split: from the back line
               to the hog line; or for hits a name: hack, bumper, board, control, normal, firm, peel
    turns      3 turns: intended number of turns of the stone

For example `draw button in`, `draw 0.3,-1.2 out broom 1.1 right`, `guard in`, `4 ft short`,
`hit 0,1.2 normal out`. Other text is a note, not a call. All lengths are from the thrower's view;
without a unit they are metres.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Literal

from curling_env.sheet import BACK_LINE_Y, HOG_TO_TEE, RING_RADII, TEE_Y
from curling_env.units import FOOT, INCH, Units, chosen_units, length, side

Shot = Literal[
    "draw",
    "guard",
    "freeze",
    "takeout",
    "hit-and-stay",
    "peel",
    "hit-and-roll",
    "double",
    "runback",
    "raise",
    "tap-back",
    "tick",
    "throw-through",
]
"""Kind of shot; the first six by the names of the planner's tasks."""
Handle = Literal["in-turn", "out-turn"]
WeightClass = Literal["guard", "draw", "hit"]
"""Class of throws whose errors are pooled."""

GUARD = (0.0, -3.2)
"""Position of the centre guard, as in the planner: right and past the tee [m]."""
CORNER = 1.22
"""Distance of a corner guard from the centre line [m]: inside the edge of the 8-foot ring."""
MAX_SIDEWAYS = 2.5
"""Maximum distance of a place or a broom from the centre line [m]."""
MAX_TURNS = 20.0
"""Maximum number of turns."""
_TWELVE, _EIGHT, _FOUR, _BUTTON = RING_RADII
_RINGS = {
    "four": (_FOUR + _BUTTON) / 2,
    "eight": (_EIGHT + _FOUR) / 2,
    "twelve": (_TWELVE + _EIGHT) / 2,
}
_SIDES = {"top": (0.0, -1.0), "back": (0.0, 1.0), "left": (-1.0, 0.0), "right": (1.0, 0.0)}

PLACES: dict[str, tuple[float, float]] = {
    **dict.fromkeys(("button", "pin", "tee", "house"), (0.0, 0.0)),
    **{
        f"{where} {ring}": (x * radius, y * radius)
        for where, (x, y) in _SIDES.items()
        for ring, radius in _RINGS.items()
    },
    "biter": (0.0, -_TWELVE - 0.1),
    "tight guard": (0.0, -2.4),
    "high guard": (0.0, -4.6),
    "centre guard": GUARD,
    "left corner guard": (-CORNER, GUARD[1]),
    "right corner guard": (CORNER, GUARD[1]),
}
"""Named places: right and past the tee [m]."""

SHOTS: dict[str, Shot] = {
    "draw": "draw",
    "guard": "guard",
    "freeze": "freeze",
    "hit": "takeout",
    "takeout": "takeout",
    "take-out": "takeout",
    "hit-and-stay": "hit-and-stay",
    "peel": "peel",
    "come-around": "draw",
    "hit-and-roll": "hit-and-roll",
    "double": "double",
    "triple": "double",
    "runback": "runback",
    "raise": "raise",
    "promote": "raise",
    "tap-back": "tap-back",
    "tap": "tap-back",
    "tick": "tick",
    "wick": "tick",
    "throw-through": "throw-through",
}
WEIGHTS = ("hack", "bumper", "board", "backline", "control", "normal", "firm")
"""Names of weights for hits. Teams mean different speeds by them, so only their own throws show the
speed.
"""
HANDLES: dict[str, Handle] = {
    "in": "in-turn",
    "in-turn": "in-turn",
    "inturn": "in-turn",
    "out": "out-turn",
    "out-turn": "out-turn",
    "outturn": "out-turn",
}


@dataclass(frozen=True, kw_only=True)
class Call:
    """Called shot; None stands for parts that were not called.

    Parameters
    ----------
    text : the call as typed
    shot : kind of shot
    target : place where the stone should rest, or of the stone to hit: right of the centre line and
        past the tee, from the thrower's view [m]
    handle : by the athlete's hand
    broom : position of the broom on the far tee line, right of the centre line [m]
    ice : distance of the broom from the target, to the side that handle and hand ask for [m]
    hog_to_hog : the weight as a time [s]
    split : the weight as the time from the back line to the hog line [s]
    weight : the weight of a hit by its name
    turns : full turns of the stone
    """

    text: str
    shot: Shot
    target: tuple[float, float] | None = None
    handle: Handle | None = None
    broom: float | None = None
    ice: float | None = None
    hog_to_hog: float | None = None
    split: float | None = None
    weight: str | None = None
    turns: float | None = None

    @property
    def rests(self) -> bool:
        """Return whether the stone should come to rest at the target, not hit a stone there."""
        return self.shot in ("draw", "guard", "freeze")

    @property
    def weight_class(self) -> WeightClass:
        """Class of throws with which its errors are pooled."""
        if not self.rests:
            return "hit"
        return "guard" if self.shot == "guard" else "draw"

    def in_words(self) -> str:
        """Return the call as a coach would say it."""
        parts = ["hit" if self.shot == "takeout" else self.shot.replace("tap-", "tap ")]
        if self.target is not None:
            parts.append(place_in_words(self.target))
        if self.weight is not None:
            parts.append(f"{self.weight} weight")
        if self.hog_to_hog is not None:
            parts.append(f"{self.hog_to_hog:.1f} s")
        if self.split is not None:
            parts.append(f"split {self.split:.2f} s")
        if self.handle is not None:
            parts.append(self.handle)
        if self.turns is not None:
            parts.append(f"{self.turns:g} turns")
        if self.broom is not None:
            where = side(self.broom)
            parts.append(f"broom {'on the centre line' if where == 'on the line' else where}")
        elif self.ice is not None:
            parts.append(f"{length(self.ice)} of ice")
        return ", ".join(parts)


def place_in_words(place: tuple[float, float]) -> str:
    """Return a place by its name, or past or short of the tee and beside the centre line."""
    for name, (right, past) in PLACES.items():
        if abs(place[0] - right) < 1e-6 and abs(place[1] - past) < 1e-6:
            return name
    along = "level with the tee"
    if abs(place[1]) >= 0.005:
        along = f"{length(place[1])} {'past' if place[1] > 0 else 'short of'} the tee"
    return along if abs(place[0]) < 0.005 else f"{along}, {side(place[0])}"


def read_call(text: str) -> Call | None:
    """Parse a called shot.

    Parameters
    ----------
    text : the call as typed

    Returns
    -------
    None for text that is not a call: a word outside the grammar, something given twice, an
    impossible place, or neither a shot nor a place
    """
    try:
        return _Words(text).read()
    except _NoCallError:
        return None


def call_error(text: str) -> str:
    """Return why a text is no call, naming the word that is not known; empty for a call."""
    try:
        _Words(text).read()
    except _NoCallError as error:
        return str(error)
    return ""


def typed_call(text: str) -> str:
    """Return a call as it was typed, with the chosen unit behind the lengths that have none."""
    return text if chosen_units() is Units.METRES else _with_unit(text, "ft")


def shown_call(text: str) -> str:
    """Return a stored call, whose lengths without a unit are metres, to be shown beside feet."""
    return text if chosen_units() is Units.METRES else _with_unit(text, "m")


def _with_unit(text: str, unit: str) -> str:
    def written(found: re.Match[str]) -> str:
        has_units = re.search(rf"\d\s*{_UNIT}(?![a-z])", found[0], re.IGNORECASE)
        return found[0] if has_units else re.sub(_NUMBER, rf"\g<0>{unit}", found[0])

    for pattern in (_BROOM, _ICE, _PAIR, _SIDED):
        text = pattern.sub(written, text.replace("\u2212", "-"))
    return text


class _NoCallError(Exception):
    """The text is not a call."""


def _twice(what: str) -> _NoCallError:
    return _NoCallError(f"the call has {what} twice")


_NUMBER = r"[-+]?(?:\d+(?:\.\d+)?|\.\d+)"
_UNIT = r"(?:metres|meters|metre|meter|feet|foot|inches|inch|ft|cm|m|'|\")"
_LENGTH = rf"({_NUMBER})\s*({_UNIT})?"
_UNITS = {
    "": 1.0,
    **dict.fromkeys(("m", "metre", "metres", "meter", "meters"), 1.0),
    "cm": 0.01,
    **dict.fromkeys(("ft", "foot", "feet", "'"), FOOT),
    **dict.fromkeys(("inch", "inches", '"'), INCH),
}
_END = r"(?![\w.])"
_PAIR = re.compile(rf"{_LENGTH}\s*,\s*{_LENGTH}{_END}", re.IGNORECASE)
_SIDED = re.compile(rf"{_LENGTH}\s*(right|left|short|past|behind|long){_END}", re.IGNORECASE)
_BROOM = re.compile(
    rf"broom\s+(?:(?:centre|center)(?: line)?|{_LENGTH}\s*(right|left)?){_END}", re.IGNORECASE
)
_SECONDS = re.compile(rf"({_NUMBER})\s*(?:seconds|second|sec|s){_END}")
_SPLIT = re.compile(rf"(?:split\s+({_NUMBER})\s*s?|({_NUMBER})\s*s?\s+split){_END}")
_ICE = re.compile(rf"(?:ice\s+{_LENGTH}|{_LENGTH}\s+(?:of\s+)?ice){_END}", re.IGNORECASE)
_BARE_SECONDS = re.compile(rf"(?<![\w.,-])(\d{{1,2}}\.\d+){_END}(?!\s*,)")
_TURNS = re.compile(rf"({_NUMBER})\s*(?:turns|turn|rotations|rotation){_END}")
_WORD = re.compile(r"[^\s,;]+")
_FILLERS = frozenset(
    ("to", "the", "at", "on", "weight", "handle", "and", "of", "from", "a", "hog", "line")
)
_STONE = (
    r"(?:the |a )?(?:(?:left|right|centre|center|corner|long|tight|high|shot|red|yellow|our|their)"
    r" )*(?:guard|stone|rock|shot)s?\b"
)
"""A stone that a shot goes round, or hits."""
_SPELLINGS = (
    (re.compile(r"\bhit[ -](?:(?:and|&|n)[ -])?(?:stay|stick)\b"), "hit-and-stay"),
    (re.compile(r"\bhit[ -](?:(?:and|&|n)[ -])?roll\b"), "hit-and-roll"),
    (re.compile(r"\bnose hit\b|\bhit (?:on the )?nose\b"), "hit-and-stay"),
    (re.compile(r"\btap[ -]?back\b"), "tap-back"),
    (re.compile(r"\bcome[ -]?around\b"), "come-around"),
    (re.compile(r"\brun[ -]?back\b"), "runback"),
    (re.compile(r"\bthrow[ -](?:through|away)\b"), "throw-through"),
    (re.compile(r"\bdouble (?:take[ -]?out|peel)\b"), "double"),
    (re.compile(r"\b(?:double|triple) raise\b|\braise (?:take[ -]?out)\b"), "runback"),
    (re.compile(r"(?<![\w-])(?:behind|around|off) " + _STONE), ""),
    (re.compile(r"\b(come-around|peel|tick|raise|hit|runback|freeze (?:to|on)) " + _STONE), r"\1"),
    (re.compile(r"\brunback double\b"), "runback"),
    (re.compile(r"\btap[ -]?up\b|\bangle raise\b"), "raise"),
    (re.compile(r"\b(tick|tap|draw|peel) shot\b"), r"\1"),
    (re.compile(r"\bhit-and-roll (?:to the )?(?:left|right)\b"), "hit-and-roll"),
    (re.compile(r"\bfreeze (?:to|on) (?:red|yellow|shot)\b"), "freeze"),
    (re.compile(r"\b(four|eight|twelve)(?:[- ]foot)? (left|right)\b"), r"\2 \1"),
    (re.compile(r"\bback[ -]?line weight\b"), "backline weight"),
    (re.compile(r"\bt[ -]line\b"), "tee"),
    (re.compile(r"\btake out\b"), "takeout"),
    (re.compile(r"\b(in|out)[ -]turn\b"), r"\1-turn"),
    (re.compile(r"\b(top|back|left|right) (4|four)(?:[- ]?(?:ft|foot))?\b"), r"\1 four"),
    (re.compile(r"\b(top|back|left|right) (8|eight)(?:[- ]?(?:ft|foot))?\b"), r"\1 eight"),
    (re.compile(r"\b(top|back|left|right) (12|twelve)(?:[- ]?(?:ft|foot))?\b"), r"\1 twelve"),
    (re.compile(r"\bfull (four|eight|twelve|4|8|12)\b(?: foot)?"), r"\1 foot"),
    (re.compile(r"\b(top|back) (?:of )?(?:the )?(?:house|rings)\b"), r"\1 twelve"),
    (re.compile(r"\btop button\b"), "button"),
    (re.compile(r"\blong (?:cent(?:re|er) )?guard\b"), "high guard"),
    (re.compile(r"\bin (?=\d{1,2}\.\d+$)"), ""),
    (re.compile(r"\bcenter\b"), "centre"),
    (re.compile(r"\bcorner guard (left|right)\b"), r"\1 corner guard"),
    (re.compile(r"\btee line\b"), "tee"),
)

_BARE_RINGS = tuple(
    (
        re.compile(
            rf"(?<!top )(?<!back )(?<!left )(?<!right )(?<![\w.-])"
            rf"(?:{number}(?:[- ]?(?:ft|foot)| ring)|{name}(?:[- ]?(?:ft|foot)| ring)?){_END}"
        ),
        meant,
    )
    for number, name, meant in (
        (4, "four", "button"),
        (8, "eight", "top eight"),
        (12, "twelve", "top twelve"),
    )
)
"""Rings without a side; read after lengths such as “4 foot short”."""

KNOWN_WORDS = frozenset(
    word
    for words in (PLACES, SHOTS, HANDLES, WEIGHTS, _FILLERS, _UNITS)
    for name in words
    for word in name.split()
).union(
    ("short", "past", "behind", "long", "broom", "center", "sec", "s", "second", "seconds"),
    ("turn", "turns", "rotation", "split", "ice"),
)
"""Words with a meaning in a call."""


class _Words:
    """Rest of a line that is still to be parsed."""

    def __init__(self, text: str) -> None:
        self._text = text
        rest = " ".join(text.lower().replace("\u2212", "-").split())
        for written, meant in _SPELLINGS:
            rest = written.sub(meant, rest)
        self._rest = rest

    def read(self) -> Call:
        """Return the call; raise if absent."""
        broom, ice, split = self._broom(), self._ice(), self._split()
        target = self._pair()
        sided = self._sided()
        if target is not None and sided is not None:
            raise _twice("a place")
        target = sided if target is None else target
        seconds, turns = self._number(_SECONDS), self._number(_TURNS)
        for written, meant in _BARE_RINGS:
            self._rest = written.sub(meant, self._rest)
        if seconds is None:
            seconds = self._number(_BARE_SECONDS)
        named, shot = self._named_place()
        words = [word for word in _WORD.findall(self._rest) if word not in _FILLERS]
        shots: list[Shot] = [SHOTS[word] for word in words if word in SHOTS]
        handles: list[Handle] = [HANDLES[word] for word in words if word in HANDLES]
        weights = [word for word in words if word in WEIGHTS]
        for word in words:
            if word not in SHOTS and word not in HANDLES and word not in WEIGHTS:
                raise _NoCallError(f"“{word}” is not a word of a call")
        # "draw weight", "peel weight" and the like name a shot twice, consistently.
        shots = list(dict.fromkeys([*shots, *shot]))
        for name, those in (("a shot", shots), ("a handle", handles), ("a weight", weights)):
            if len(those) > 1:
                raise _twice(name)
        if named is not None:
            if target is not None:
                raise _twice("a place")
            target = named
        if not shots and target is None and not weights:
            raise _NoCallError("a shot or a place is missing, such as “draw” or “button”")
        what: Shot = shots[0] if shots else "takeout" if weights else "draw"
        if target is None and what in ("draw", "guard"):
            target = GUARD if what == "guard" else (0.0, 0.0)
        call = Call(
            text=self._text,
            shot=what,
            target=target,
            handle=handles[0] if handles else None,
            broom=broom,
            ice=ice,
            hog_to_hog=seconds,
            split=split,
            weight=weights[0] if weights else None,
            turns=turns,
        )
        if not _is_possible(call):
            raise _NoCallError("a stone cannot lie there, or have that weight or broom")
        return call

    def _take(self, pattern: re.Pattern[str]) -> list[re.Match[str]]:
        found = list(pattern.finditer(self._rest))
        self._rest = pattern.sub(" ", self._rest)
        return found

    def _one(self, pattern: re.Pattern[str], what: str) -> re.Match[str] | None:
        found = self._take(pattern)
        if len(found) > 1:
            raise _twice(what)
        return found[0] if found else None

    def _broom(self) -> float | None:
        found = self._one(_BROOM, "a broom")
        if found is None:
            return None
        number, unit, where = found.groups()
        return _metres(number or "0", unit) * (-1.0 if where == "left" else 1.0)

    def _ice(self) -> float | None:
        found = self._one(_ICE, "the ice")
        if found is None:
            return None
        first, first_unit, second, second_unit = found.groups()
        return _metres(first or second, first_unit or second_unit)

    def _split(self) -> float | None:
        found = self._one(_SPLIT, "a split")
        return None if found is None else float(found[1] or found[2])

    def _pair(self) -> tuple[float, float] | None:
        found = self._one(_PAIR, "a place")
        if found is None:
            return None
        x, x_unit, y, y_unit = found.groups()
        # In "2,-4 ft" both numbers are feet.
        return _metres(x, x_unit or y_unit), _metres(y, y_unit or x_unit)

    def _sided(self) -> tuple[float, float] | None:
        right, past = None, None
        for number, unit, where in (match.groups() for match in self._take(_SIDED)):
            value = _metres(number, unit)
            if where in ("left", "right") and right is None:
                right = -value if where == "left" else value
            elif where not in ("left", "right") and past is None:
                past = -value if where == "short" else value
            else:
                raise _twice("a place")
        if right is None and past is None:
            return None
        return right or 0.0, past or 0.0

    def _number(self, pattern: re.Pattern[str]) -> float | None:
        found = self._one(pattern, "a number")
        return None if found is None else float(found[1])

    def _named_place(self) -> tuple[tuple[float, float] | None, list[Shot]]:
        """Return a named place, and the shot that its name implies."""
        for name in sorted(PLACES, key=len, reverse=True):
            if self._one(re.compile(rf"(?<![\w-]){name}(?![\w-])"), "a place"):
                return PLACES[name], ["guard"] if name.endswith("guard") else []
        return None, []


def _metres(number: str, unit: str | None) -> float:
    return float(number) * _UNITS[unit or ""]


def _is_possible(call: Call) -> bool:
    """Return whether the target is possible for a stone, and the weight and broom for a throw."""
    if call.target is not None:
        right, past = call.target
        if abs(right) > MAX_SIDEWAYS or not -HOG_TO_TEE < past < BACK_LINE_Y - TEE_Y + 0.2:
            return False
    if call.broom is not None and abs(call.broom) > MAX_SIDEWAYS:
        return False
    if call.ice is not None and not 0.0 <= call.ice <= 2 * MAX_SIDEWAYS:
        return False
    if call.split is not None and not 1.5 <= call.split <= 7.0:
        return False
    if call.hog_to_hog is not None and not 4.0 <= call.hog_to_hog <= 30.0:
        return False
    return call.turns is None or 0.0 < call.turns <= MAX_TURNS
