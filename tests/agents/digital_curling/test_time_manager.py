"""Any player keeps to its clock."""

from __future__ import annotations

from dataclasses import replace

import pytest

from agents.digital_curling import BUDGETS, CLOCK_BUDGET, TimeManager, stones_to_come
from agents.playing import BUDGET, SearchPlayer, throws_before
from curling_env.game import Call, DrawPlayer, GameSimulator, PlayerView
from curling_env.throw import FROM_HACK, Throw


class CountingSearch(SearchPlayer):
    """Player that records its budgets, and takes its time."""

    def __init__(self, budget: int, clock: list[float], rate: float) -> None:
        super().__init__(budget)
        self.name = f"search:{budget}"
        self.budgets: list[int] = []
        self._now, self._speed = clock, rate

    def call(self, view: PlayerView) -> Call:
        self.budgets.append(self.budget)
        self._now[0] += throws_before(view, self.budget) / self._speed
        return Call(throw=Throw(speed=2.0), shot="thought about")


@pytest.fixture
def view() -> PlayerView:
    simulator = GameSimulator("fcv1", rules="digital_curling", delivery=FROM_HACK)
    return simulator.view(simulator.begin_end(simulator.new_game(0)))


@pytest.fixture
def clock(monkeypatch) -> list[float]:
    now = [0.0]
    monkeypatch.setattr("agents.digital_curling.time_manager.time.perf_counter", lambda: now[0])
    return now


def at(view: PlayerView, stone: int, end: int = 0) -> PlayerView:
    """The view before a stone of the game's last ends."""
    game = view.game
    assert game.end is not None
    later = replace(game.end, number=end, delivered=2 * stone)
    return replace(view, game=replace(game, end=later, line_score=((0, 0),) * end))


def test_stones_to_come_are_those_of_this_clock(view):
    assert stones_to_come(view) == 80
    assert stones_to_come(at(view, 7, end=9)) == 1
    assert stones_to_come(at(view, 3, end=12)) == 5  # of an extra end


@pytest.mark.parametrize("seconds", [1.0, 30.0, 500.0])
@pytest.mark.parametrize("rate", [300.0, 5000.0, 80_000.0])
def test_a_search_never_runs_out_of_time(view, clock, seconds, rate):
    manager = TimeManager(player := CountingSearch(30_000, clock, rate))
    manager.prepare([view])
    begin = clock[0]
    for end in range(10):
        for stone in range(8):
            left = seconds - (clock[0] - begin)
            assert left > 0
            manager.call(at(view, stone, end), left)
    assert clock[0] - begin < seconds - 0.05
    assert set(player.budgets) <= set(BUDGETS)
    if seconds * rate > 1e6:
        assert clock[0] - begin > 0.03 * seconds  # and it uses the time that it has


@pytest.mark.parametrize(("budget", "name"), [(500, "search:500"), (BUDGET, "search:3000")])
def test_only_the_requested_throws_are_simulated(view, clock, budget, name):
    player = CountingSearch(budget, clock, 1e6)
    player.name = name
    manager = TimeManager(player)
    manager.prepare([view])
    manager.call(view, 1e5)
    assert player.budgets[-1] == budget


def test_without_a_requested_number_a_long_clock_allows_thirty_thousand(view, clock):
    player = CountingSearch(BUDGET, clock, 1e6)
    player.name = SearchPlayer.name
    manager = TimeManager(player)
    manager.prepare([view])
    manager.call(view, 1e5)
    assert player.budgets[-1] == CLOCK_BUDGET == 30_000


def test_with_no_time_left_the_stone_is_drawn(view, clock):
    manager = TimeManager(CountingSearch(1000, clock, 10.0))
    manager.prepare([view])
    assert manager.call(view, 5.0).shot == "draw to the button"
    assert manager.call(view, 1e5).shot == "thought about"


def test_so_does_a_player_that_cannot_be_hurried(view, clock):
    class Slow(DrawPlayer):
        def call(self, view: PlayerView) -> Call:
            clock[0] += 2.0
            return Call(throw=Throw(speed=2.0), shot="slow")

    manager = TimeManager(Slow())
    manager.prepare([view])
    assert manager.call(at(view, 7, end=9), 100.0).shot == "slow"
    assert manager.call(at(view, 7, end=9), 3.0).shot == "draw to the button"
