"""Sets of rules by name and year, so that a result says by which rules it was played.

docs/rules.md has a table of the differences.

Source
------
World Curling's rules of 2024 as commonly summarised (sheet, delivery, free guard zone, scoring,
mixed doubles); docs/rules.md says what was not checked against the rule book. Digital Curling: the
game code of the competition's servers. `digital_curling` is that of DC3; of DC4 there are two
readings, that of its library (`digital_curling_4…`) and that of the server at the competition's
address (`dc4_server…`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from curling_env.errors import InputError
from curling_env.game.rules.lines import Lines
from curling_env.game.rules.teams import STONES_PER_TEAM
from curling_env.sheet import LINE_WIDTH

ARRANGEMENTS = 6
"""Digital Curling 4's arrangements of the placed stones; see `placement`."""


@dataclass(frozen=True, kw_only=True)
class RuleSet:
    """A set of rules.

    Parameters
    ----------
    name : short name, with the year of the rules
    title : name for people
    ends : number of ends of a game, without extra ends
    throwers : which player (0 is the first) delivers each of a team's stones in an end
    placed_stones : whether each team has a stone on the sheet before an end begins
    arrangement : where Digital Curling 4 has them, one of its six arrangements from 0; None for
        World Curling's places
    free_guard_until : opposition guards are protected while so many first stones are delivered
    no_tick : whether, meanwhile, no opposition guard may be moved off the centre line
    no_takeout_until : no stone at all may be put out while so many first stones are delivered
    hog_line_exception : whether a stone that struck another may lie on or before the hog line
    blank_keeps_hammer : whether the hammer (in mixed doubles the decision on the placement)
        stays with its team after a blank end
    blank_passes_decision : in mixed doubles, whether a blank end gives the decision to the team
        that did not have it; else to the one that threw first
    power_play : whether each team may once a game have its placed stones to the side
    max_extra_ends : number of extra ends after which a tied game ends without a winner; None for
        no limit
    ends_before_concession : number of complete ends before a team may concede
    stops_when_decided : whether the last end stops once one team cannot catch up
    measure : distances from the tee that differ by less than this count as equal [m]
    touching_counts, whole_guard, centre_line : what touches what, see `Lines`
    guards_stay : whether a guard may not even be moved out of the free guard zone
    centre_guards_only : whether only guards that touch the centre line are protected
    tick_choice : whether the opponent chooses after a tick; else the stones are put back

    Raises
    ------
    InputError : numbers with which no game can be played
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
            raise InputError(f"a game has 1 to 20 ends, got {self.ends}")
        if not 1 <= len(self.throwers) + self.placed_stones <= STONES_PER_TEAM:
            raise InputError(f"a team has 1 to {STONES_PER_TEAM} stones, got {len(self.throwers)}")
        if self.max_extra_ends is not None and self.max_extra_ends < 0:
            raise InputError(f"max_extra_ends must be at least 0, got {self.max_extra_ends}")
        if not self.measure >= 0:
            raise InputError(f"measure must be at least 0 m, got {self.measure}")
        if self.power_play and not self.placed_stones:
            raise InputError("a power play needs placed stones")
        if self.arrangement is not None and not 0 <= self.arrangement < ARRANGEMENTS:
            raise InputError(
                f"the arrangements of placed stones are 0 to {ARRANGEMENTS - 1}, "
                f"got {self.arrangement}"
            )

    def lines(self, *, width: float = 4.75, stone_radius: float = 0.145) -> Lines:
        """The lines of a sheet as these rules read them.

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

    @property
    def most_points(self) -> int:
        """The most a team can score in an end."""
        return len(self.throwers) + self.placed_stones


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
    """A set of rules by its name, with some of its fields changed: ``rule_set(name, ends=8)``.

    Raises
    ------
    InputError : an unknown name, or a change with which no game can be played
    """
    if isinstance(name, RuleSet):
        return replace(name, **changes) if changes else name
    if not isinstance(name, str) or name not in RULE_SETS:  # pyright: ignore[reportUnnecessaryIsInstance]
        raise InputError(f"no set of rules is named {name!r}; there are {', '.join(RULE_SETS)}")
    return replace(RULE_SETS[name], **changes) if changes else RULE_SETS[name]
