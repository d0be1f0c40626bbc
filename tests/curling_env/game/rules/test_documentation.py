"""The table of docs/rules.md agrees with every set of rules."""

from __future__ import annotations

from pathlib import Path

import pytest

from curling_env.game import RULE_SETS, RuleSet

PAGE = (Path(__file__).parents[4] / "docs" / "rules.md").read_text(encoding="utf-8")


def table() -> tuple[list[str], dict[str, list[str]]]:
    """The tables of the page side by side: names of sets, and their cells by the row's title."""
    names: list[str] = []
    cells: dict[str, list[str]] = {}
    for part in PAGE.split("\n\n| |")[1:]:
        rows = [
            [cell.strip() for cell in line.strip("|").split("|")]
            for line in part.split("\n\n", 1)[0].splitlines()
        ]
        names += [cell.strip("`") for cell in rows[0]]
        for row in rows[2:]:
            cells.setdefault(row[0], []).extend(row[1:])
    return names, cells


def cells_of(rules: RuleSet) -> dict[str, str]:
    """Return the expected text of the page, by the beginning of its row."""
    whom = "opposition guards"
    whom += " on the centre line" if rules.centre_guards_only else ""
    whom = "every stone" if rules.no_takeout_until else whom
    tick = "the opponent chooses" if rules.tick_choice else "all are put back"
    after = rules.ends_before_concession
    blank = "the hammer stays" if rules.blank_keeps_hammer else "the team that threw first"
    blank = "the team that did not decide" if rules.blank_passes_decision else blank
    yes = {True: "yes", False: "no"}
    return {
        "Ends": str(rules.ends),
        "Stones delivered by a team": str(rules.stones),
        "Order of throws": "one player"
        if set(rules.throwers) == {0}
        else " ".join(str(player + 1) for player in rules.throwers),
        "Stones on the sheet before": "one a team" if rules.placed_stones else "none",
        "Protected at first": whom,
        "… until this many": str(max(rules.free_guard_until, rules.no_takeout_until)),
        "… from": "leaving the zone" if rules.guards_stay else "being put out",
        "No-tick": yes[rules.no_tick],
        "… after a tick": tick if rules.no_tick else "–",
        "A guard lies": "wholly" if rules.whole_guard else "with its centre",
        "A stone that just touches": "is in it" if rules.touching_counts else "is not",
        "A stone that struck another": "yes" if rules.hog_line_exception else "no",
        "After a blank end": blank,
        "Power play": "once a team" if rules.power_play else "–",
        "Tied after": "extra ends",
        "A team may concede": f"at its turn, after {after} ends" if after else "at its turn",
        "The last end stops": yes[rules.stops_when_decided],
    }


@pytest.mark.parametrize("rules", RULE_SETS.values(), ids=list(RULE_SETS))
def test_the_table_is_the_rules(rules):
    names, rows = table()
    assert names == list(RULE_SETS)
    column = names.index(rules.name)
    for begins, cell in cells_of(rules).items():
        (row,) = (cells for title, cells in rows.items() if title.startswith(begins))
        whole = begins in ("Protected at first", "… from", "… after a tick")
        assert row[column] == cell if whole else row[column].startswith(cell), begins
