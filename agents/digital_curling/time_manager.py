"""Thinking time of a player from the clock of the game: a share of the time left, never more."""

from __future__ import annotations

import time

from agents.playing.search import SearchPlayer, throws_before
from agents.playing.search.tuning import BUDGET
from curling_env.game import Call, Player, PlayerView
from curling_env.game.opponents import DrawPlayer

SHARE = 0.6
"""Share of the time left that is planned with; the rest is a reserve for a busy machine."""
RESERVE = 0.1
"""Time for each stone reserved for the network [s]."""
BUDGETS = (100, 300, 1000, 3000, 10_000, 30_000, 100_000)
"""Possible numbers of simulated throws. They are far apart, so that a slightly different clock
leads to the same choice, and so to the same game.
"""
CLOCK_BUDGET = 30_000
"""Maximum number of simulated throws that the clock may allow `search` if no number is
requested.
"""
FIRST_RATE = 5000.0
"""Assumed number of throws a second until the player has been measured, an old machine's."""


class TimeManager:
    """Player that keeps to a clock.

    A search gets the number of throws that its share of the time allows, up to its own number, or
    to `CLOCK_BUDGET` if none was requested. Another player thinks as it always does. If not even
    that fits, the stone is drawn to the button.

    Parameters
    ----------
    player : player that decides
    """

    def __init__(self, player: Player) -> None:
        self.player = player
        self._rate = FIRST_RATE
        self._longest = 0.0
        self._quick = DrawPlayer()
        self._most = 0
        if isinstance(player, SearchPlayer):
            unsaid = player.name == SearchPlayer.name and player.budget == BUDGET
            self._most = CLOCK_BUDGET if unsaid else player.budget

    def call(self, view: PlayerView, seconds_left: float) -> Call:
        """Return a call, decided in a share of the time left.

        Parameters
        ----------
        view : the game as the player sees it
        seconds_left : time on the clock of the player's team, for all of its stones
        """
        share = SHARE * (seconds_left / stones_to_come(view) - RESERVE)
        if not self._set_budget(view, share):
            return self._quick.call(view)
        begin = time.perf_counter()
        call = self.player.call(view)
        self._note(view, time.perf_counter() - begin)
        return call

    def prepare(self, views: list[PlayerView]) -> None:
        """Do all one-time compiling and planning, and measure the speed of the player.

        Parameters
        ----------
        views : games like the one to come; the player sees each twice
        """
        for view in views:
            self._quick.call(view)
            for share in (0.0, 1.0):
                self._set_budget(view, share)
                begin = time.perf_counter()
                self.player.concedes(view)
                self.player.call(view)
                self._longest = 0.0
                self._note(view, time.perf_counter() - begin)

    def _set_budget(self, view: PlayerView, share: float) -> bool:
        """Set the thinking time of the player [s]; return whether it can decide in it."""
        player = self.player
        if not isinstance(player, SearchPlayer):
            return share >= 2 * self._longest
        if player.seconds is not None:
            return share >= 2 * min(player.seconds, self._longest)
        most = share * self._rate
        fitting = [budget for budget in BUDGETS if throws_before(view, budget) <= most]
        player.budget = min(self._most, fitting[-1] if fitting else BUDGETS[0])
        return bool(fitting)

    def _note(self, view: PlayerView, seconds: float) -> None:
        """Learn from the duration of a decision."""
        self._longest = max(self._longest, seconds)
        if isinstance(self.player, SearchPlayer) and seconds > 0:
            rate = throws_before(view, self.player.budget) / seconds
            # A slow decision counts immediately, a quick one gradually.
            self._rate = min(rate, 0.9 * self._rate + 0.1 * rate)


def stones_to_come(view: PlayerView) -> int:
    """Return the number of stones that the team still throws on its clock; an extra end has its own
    clock.
    """
    later = max(view.game.ends_left - 1, 0)
    return view.own_stones_left + later * view.game.rules.stones
