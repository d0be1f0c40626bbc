"""Sets of rules by name and year, so that a result states its rules.

docs/rules.md has a table of the differences. In mixed doubles two stones are on the sheet before an
end begins (R16): a guard on the centre line, and a stone in the house. The team whose stone is in
the house delivers second and so has the hammer. In a power play both are to one side. Digital
Curling 4 has six other arrangements.

Source
------
World Curling's rules of 2024 as commonly summarised (sheet, delivery, free guard zone, scoring,
mixed doubles); docs/rules.md lists the points that were not checked against the rule book. Digital
Curling: the game code of the competition's servers. `digital_curling` is that of DC3; of DC4 there
are two readings, that of its library (`digital_curling_4…`) and that of the server at the
competition's address (`dc4_server…`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Literal

from curling_env.errors import InputError
from curling_env.game.rules.lines import HOG_LINE, Lines
from curling_env.game.rules.teams import STONES_PER_TEAM, RestingStone, Stones, Team
from curling_env.sheet import HOUSE_RADIUS, LINE_WIDTH, RING_RADII

Side = Literal["left", "right"]
"""Side of the sheet, from the thrower's view."""
GuardPlace = Literal["middle", "near_house", "near_hog_line"]
"""Position of the guard: one of three places, chosen for a competition by the curl of the ice."""

_MIDWAY = (HOG_LINE - HOUSE_RADIUS) / 2
"""Distance along play of the middle place, midway between hog line and house [m]."""
_GUARD_PLACES = {"middle": 0.0, "near_house": 0.915, "near_hog_line": -0.915}
"""Distance of each place from the middle one: three feet [m]."""
_ARRANGED_GUARDS = (-3.055, -3.345, -3.97, -4.26, -4.885, -5.175)
"""Positions of the guard along play in Digital Curling 4's arrangements: it touches each of World
Curling's places from behind and from before [m].
"""
_ARRANGED_POWER_PLAY = (1.093, 1.087, 1.073, 1.067, 1.053, 1.047)
"""Offset of the guard to the side in a power play of these arrangements [m]."""
ARRANGEMENTS = len(_ARRANGED_GUARDS)
"""Number of Digital Curling 4's arrangements of the placed stones."""


@dataclass(frozen=True, kw_only=True)
class RuleSet:
    """Set of rules.

    Parameters
    ----------
    name : short name, with the year of the rules
    title : name for people
    ends : number of ends of a game, without extra ends
    throwers : player (0 is the first) of each of a team's stones in an end
    placed_stones : true if each team has a stone on the sheet before an end begins
    arrangement : one of Digital Curling 4's six arrangements from 0; None for World Curling's
        places
    free_guard_until : number of first stones of an end that may not put out opposition guards
    no_tick : true if those stones may not move an opposition guard off the centre line
    no_takeout_until : number of first stones of an end that may not put out any stone
    hog_line_exception : true if a stone that struck another may stay on or before the hog line
    blank_keeps_hammer : true if the hammer (in mixed doubles the decision on the placement) stays
        with its team after a blank end
    blank_passes_decision : in mixed doubles, true if a blank end gives the decision to the team
        that did not have it; otherwise to the one that threw first
    power_play : true if each team may once a game have its placed stones to the side
    max_extra_ends : number of extra ends after which a tied game ends without a winner; None for
        no limit
    ends_before_concession : number of complete ends before a team may concede
    stops_when_decided : true if the last end stops once one team cannot catch up
    measure : distances from the tee that differ by less than this count as equal [m]
    touching_counts, whole_guard, centre_line : geometry of contacts, see `Lines`
    guards_stay : true if a guard may not even be moved out of the free guard zone
    centre_guards_only : true if only guards that touch the centre line are protected
    tick_choice : true if the opponent chooses after a tick; otherwise the stones are put back

    Raises
    ------
    InputError : numbers out of range
    """

    name: str
    title: str
    ends: int = 10
    throwers: tuple[int, ...] = (0, 0, 1, 1, 2, 2, 3, 3)
    placed_stones: bool = False
    arrangement: int | None = None
    free_guard_until: int = 5
    no_tick: bool = True
    no_takeout_until: int = 0
    hog_line_exception: bool = True
    blank_keeps_hammer: bool = True
    blank_passes_decision: bool = False
    power_play: bool = False
    max_extra_ends: int | None = None
    ends_before_concession: int = 6
    stops_when_decided: bool = True
    measure: float = 1e-6
    touching_counts: bool = True
    whole_guard: bool = True
    centre_line: float = LINE_WIDTH
    guards_stay: bool = False
    centre_guards_only: bool = False
    tick_choice: bool = True

    def __post_init__(self) -> None:
        if not 1 <= self.ends <= 20:
            raise InputError(f"expected 1 to 20 ends in a game, got {self.ends}")
        if not 1 <= len(self.throwers) + self.placed_stones <= STONES_PER_TEAM:
            raise InputError(
                f"expected 1 to {STONES_PER_TEAM} stones in a team, got {len(self.throwers)}"
            )
        if self.max_extra_ends is not None and self.max_extra_ends < 0:
            raise InputError(f"max_extra_ends must be at least 0, got {self.max_extra_ends}")
        if not self.measure >= 0:
            raise InputError(f"measure must be at least 0 m, got {self.measure}")
        if self.power_play and not self.placed_stones:
            raise InputError("a power play needs placed stones")
        if self.arrangement is not None and not 0 <= self.arrangement < ARRANGEMENTS:
            raise InputError(
                f"expected an arrangement of placed stones from 0 to {ARRANGEMENTS - 1}, got "
                f"{self.arrangement}"
            )

    def lines(self, *, width: float = 4.75, stone_radius: float = 0.145) -> Lines:
        """Return the lines of a sheet according to these rules.

        Parameters
        ----------
        width : distance between the side lines [m]
        stone_radius : radius of a stone [m]
        """
        return Lines(
            width=width,
            stone_radius=stone_radius,
            touching_counts=self.touching_counts,
            whole_guard=self.whole_guard,
            centre_line=self.centre_line,
        )

    @property
    def stones(self) -> int:
        """Number of stones that each team delivers in an end."""
        return len(self.throwers)

    @property
    def deliveries(self) -> int:
        """Number of stones that both teams deliver in an end."""
        return 2 * len(self.throwers)


_MIXED_DOUBLES = RuleSet(
    name="mixed_doubles_2024",
    title="Mixed doubles, World Curling 2024",
    ends=8,
    throwers=(0, 1, 1, 1, 0),
    placed_stones=True,
    free_guard_until=0,
    no_tick=False,
    no_takeout_until=3,
    blank_keeps_hammer=False,
    power_play=True,
)
_DIGITAL_CURLING = RuleSet(
    name="digital_curling",
    title="Digital Curling 3 (fours, the competition's server)",
    throwers=(0,) * 8,
    no_tick=False,
    hog_line_exception=False,
    ends_before_concession=0,
    stops_when_decided=False,
    touching_counts=False,
)
_NO_TICK: dict[str, Any] = {"no_tick": True, "tick_choice": False, "centre_line": 0.0}
_DC4_SERVER = replace(
    _DIGITAL_CURLING,
    name="dc4_server",
    title="Digital Curling 4 (fours, its server)",
    hog_line_exception=True,
    touching_counts=True,
    whole_guard=False,
)

RULE_SETS = {
    rules.name: rules
    for rules in (
        RuleSet(name="world_curling_2024", title="Fours, World Curling 2024"),
        _MIXED_DOUBLES,
        _DIGITAL_CURLING,
        replace(
            _DIGITAL_CURLING,
            name="digital_curling_4",
            title="Digital Curling 4 (fours, its library)",
            guards_stay=True,
        ),
        replace(
            _DIGITAL_CURLING,
            name="digital_curling_4_no_tick",
            title="Digital Curling 4 without ticks (fours, its library)",
            centre_guards_only=True,
            **_NO_TICK,
        ),
        _DC4_SERVER,
        replace(
            _DC4_SERVER,
            name="dc4_server_no_tick",
            title="Digital Curling 4 without ticks (fours, its server)",
            **_NO_TICK,
        ),
        replace(
            _MIXED_DOUBLES,
            name="dc4_server_mixed_doubles",
            title="Digital Curling 4 (mixed doubles, its server)",
            arrangement=0,
            blank_passes_decision=True,
            ends_before_concession=0,
            stops_when_decided=False,
        ),
    )
}
"""Sets of rules by name."""


def rule_set(name: str | RuleSet, **changes: Any) -> RuleSet:
    """Return a set of rules by its name, with some of its fields changed: ``rule_set(name,
    ends=8)``.

    Raises
    ------
    InputError : an unknown name, or an invalid change
    """
    if isinstance(name, RuleSet):
        return replace(name, **changes) if changes else name
    if not isinstance(name, str) or name not in RULE_SETS:  # pyright: ignore[reportUnnecessaryIsInstance]
        raise InputError(f"unknown set of rules {name!r}; expected one of {', '.join(RULE_SETS)}")
    return replace(RULE_SETS[name], **changes) if changes else RULE_SETS[name]


def placed_stones(
    rules: RuleSet,
    lines: Lines,
    hammer: Team,
    *,
    power_play: Side | None = None,
    guard: GuardPlace = "middle",
) -> Stones:
    """Return the guard of the team that throws first, and the other team's stone in the house.

    Parameters
    ----------
    rules : a set of rules with placed stones
    lines : lines of the sheet, for the stone's radius
    hammer : the team with the hammer, whose stone is in the house
    power_play : the side of both, or None
    guard : place of the guard, unless the rules have an arrangement

    Returns
    -------
    The guard, centred on its place, and the stone in the house. The latter has its back edge on
    the back of the 4-foot ring; in a power play it touches the tee line from before, centred on
    the edge of the 8-foot ring.
    """
    side = {"left": -1.0, "right": 1.0, None: 0.0}[power_play]
    x = side * RING_RADII[1]
    y = RING_RADII[2] - lines.stone_radius if power_play is None else -lines.stone_radius
    guard_x, guard_y = x, _MIDWAY + _GUARD_PLACES[guard]
    if rules.arrangement is not None:
        guard_x = side * _ARRANGED_POWER_PLAY[rules.arrangement]
        guard_y = _ARRANGED_GUARDS[rules.arrangement]
    number = rules.stones
    return (
        RestingStone(hammer.other, number, guard_x, guard_y),
        RestingStone(hammer, number, x, y),
    )
