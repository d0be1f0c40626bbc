"""The player `search`: tries shots in the mind, more and more often those that promise more."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from agents.playing.search.aiming_table import Atlas
from agents.playing.search.kernel_regression import estimate
from agents.playing.search.positions import Floats, Sheet, points_of, position_of
from agents.playing.search.shots import KINDS, Shots, shots_for
from agents.playing.search.value_network import MOST, Network, load_network, skill_of
from agents.playing.search.win_probability import Winning
from curling_env.errors import InputError
from curling_env.game import Call, Player, PlayerView
from curling_env.game.rules import End, RuleSet, Ruling
from curling_env.game.rules.lines import Lines
from curling_env.game.rules.teams import Stones
from curling_env.ice import Ice
from curling_env.sheet import Direction
from curling_env.throw import MAX_SPEED, MAX_SPIN, Throw

BUDGET = 3000
"""Throws tried in the mind before each delivery."""
ROUNDS = 4
"""Rounds into which the trials are divided, equally; after each, fewer shots are left."""
LEFT = 0.25
"""Share of the shots that a round leaves to the next."""
NEIGHBOURS = ((0.8, 0.0), (-0.8, 0.0), (0.0, 0.8), (0.0, -0.8))
"""Beside the best shots further ones are tried, so many errors of weight and line away."""
WIDENED = 8
"""The best shots beside which that is done, in each round but the last."""
HOPELESS = 0.003
"""Chance to win below which the hand is offered."""
USUAL_RATE = 20_000.0
"""Throws tried in a second, until the player has measured its own."""
DOUBT = np.array([0.006, 0.0005, 0.05])
"""What the ice and the stones add to the error of a hand [m/s, rad, rad/s].

Matched stones differ by some 0.75 % in friction, and an ice changes during a game.
"""


@dataclass(frozen=True, kw_only=True)
class Choice:
    """A shot that was looked at.

    Parameters
    ----------
    throw : as meant
    shot : in the sport's words
    worth : chance to win the game after it
    error : standard error of that
    """

    throw: Throw
    shot: str
    worth: float
    error: float


class Judge:
    """Says how likely a game is won from positions: the network joined with the ends to come."""

    def __init__(self, network: Network, rules: RuleSet, lines: Lines, skill: float) -> None:
        self.network, self.rules, self.lines, self.skill = network, rules, lines, skill
        self.winning = Winning(rules)

    def chances(self, view: PlayerView, stones: Floats, delivered: int) -> Floats:
        """Chance of the view's team to win from positions of the end in play, (n,).

        Parameters
        ----------
        stones : (n, 16, 2) see `positions`
        delivered : stones of the end delivered
        """
        end, left = _end_of(view), self.rules.deliveries - delivered
        scores_worth = self.winning.of_scores(view.game.lead(end.hammer), view.game.ends_left)
        if left == 0:
            points = np.clip(points_of(self.lines, stones), -MOST, MOST)
            worth = scores_worth[points + MOST]
        else:
            made = self.network.chances(self.lines, stones, left, scores_worth, self.skill)
            worth = made @ scores_worth
        return worth if end.hammer is view.team else 1 - worth


class SearchPlayer(Player):
    """Chooses the shot after which the game is won most often.

    Parameters
    ----------
    budget : throws tried in the mind before each delivery; the same, the same game
    seconds : processor time for each delivery instead; what is chosen then depends on the machine
    network : that says what positions are worth; the package's own without it

    Raises
    ------
    InputError : a budget or a time that allows no search
    """

    name = "search"

    def __init__(
        self,
        budget: int = BUDGET,
        *,
        seconds: float | None = None,
        network: Network | None = None,
    ) -> None:
        if budget < 1 or (seconds is not None and not seconds > 0):
            raise InputError(
                f"a search needs 1 throw or more, or a time above 0, got {budget} and {seconds}"
            )
        self.budget, self.seconds = budget, seconds
        self.network = load_network() if network is None else network
        self._rate = USUAL_RATE
        self._atlases: dict[Direction, tuple[Ice, Atlas]] = {}
        self._judges: dict[tuple[RuleSet, Lines, float], Judge] = {}

    @classmethod
    def with_option(cls, option: str) -> SearchPlayer:
        """`search:500` tries 500 throws before each delivery, `search:0.2s` thinks so long."""
        timed = option.endswith("s")
        try:
            amount = float(option[:-1]) if timed else int(option)
        except ValueError:
            raise InputError(
                "search takes a number of throws or of seconds, as in search:500 or search:0.2s, "
                f"got {option!r}"
            ) from None
        player = cls(seconds=amount) if timed else cls(int(amount))
        player.name = f"search:{option}"
        return player

    def call(self, view: PlayerView) -> Call:
        best = self.choices(view)[0]
        return Call(throw=best.throw, shot=best.shot)

    def choices(self, view: PlayerView) -> list[Choice]:
        """The shots that were looked at longest, the best first."""
        begin = time.process_time()
        budget = self.budget if self.seconds is None else max(int(self._rate * self.seconds), 1)
        search = _Search(view, self._atlas(view), self._judge(view), budget)
        search.run()
        self._rate = search.thrown / max(time.process_time() - begin, 1e-3)
        return search.choices()

    def concedes(self, view: PlayerView) -> bool:
        return self._chance(view, _end_of(view).stones, over=0) < HOPELESS

    def puts_back(self, view: PlayerView, ruling: Ruling) -> bool:
        if ruling.option is None:
            return True
        # The tick was the delivery after those that the view tells of.
        back, left = (self._chance(view, s, over=1) for s in (ruling.option, ruling.stones))
        return back >= left

    def _chance(self, view: PlayerView, stones: Stones, *, over: int) -> float:
        """Chance to win with these stones lying after so many further deliveries."""
        end = _end_of(view)
        after = replace(end, stones=stones, delivered=end.delivered + over)
        return float(self._judge(view).chances(view, position_of(after)[None], after.delivered)[0])

    def _judge(self, view: PlayerView) -> Judge:
        key = (view.game.rules, view.game.lines, skill_of(view.skill.sigma_angle))
        if key not in self._judges:
            self._judges[key] = Judge(self.network, *key)
        return self._judges[key]

    def _atlas(self, view: PlayerView) -> Atlas:
        known = self._atlases.get(view.direction)
        if known is None or known[0] is not view.ice:
            known = (view.ice, Atlas(view.ice, view.direction))
            self._atlases[view.direction] = known
        return known[1]


class _Search:
    """One search, before one delivery."""

    def __init__(self, view: PlayerView, atlas: Atlas, judge: Judge, budget: int) -> None:
        end = _end_of(view)
        self.view, self.judge, self.budget = view, judge, budget
        self.sheet = Sheet(
            ice=view.ice, direction=view.direction, rules=view.game.rules, lines=view.game.lines
        )
        self.delivered, self.stones = end.delivered, position_of(end)
        self.rng = view.rng()
        hand = [view.skill.sigma_speed, view.skill.sigma_angle, view.skill.sigma_spin]
        self.sigma = np.hypot(hand, DOUBT)
        shots = shots_for(atlas, self.sheet, self.stones[None], end.delivered)
        self.shots = self._affordable(shots)
        self.often = np.zeros(len(self.shots))
        self.executed = np.empty((0, 3))
        self.worth = np.empty(0)
        self.mean = np.full(len(self.shots), -np.inf)
        self.error = np.full(len(self.shots), np.inf)

    def run(self) -> None:
        """Round after round, fewer shots are tried more often."""
        chosen = np.arange(len(self.shots))
        for number in range(ROUNDS):
            last = number == ROUNDS - 1
            self._try(chosen, max(self.budget // ROUNDS // len(chosen), 1))
            if not last:
                kept = max(round(len(chosen) * LEFT), 3)
                chosen = self._best(chosen)[:kept]
                chosen = np.concatenate([chosen, self._widen(chosen[:WIDENED])])

    @property
    def thrown(self) -> int:
        """Throws tried so far."""
        return len(self.executed)

    def choices(self) -> list[Choice]:
        tried = np.flatnonzero(np.isfinite(self.mean))
        return [
            Choice(
                throw=_throw(self.shots.throws[k]),
                shot=KINDS[self.shots.kind[k]],
                worth=float(self.mean[k]),
                error=float(self.error[k]),
            )
            for k in self._best(tried)
            if self.often[k] == self.often.max()
        ]

    # --- what it is made of -----------------------------------------------------------------------

    def _affordable(self, shots: Shots) -> Shots:
        """All shots, or as many as a first round can try, drawn by lot."""
        most = max(self.budget // ROUNDS, 3)
        if len(shots) <= most:
            return shots
        return shots[np.sort(self.rng.permutation(len(shots))[:most])]

    def _best(self, chosen: NDArray[np.intp]) -> NDArray[np.intp]:
        return chosen[np.argsort(-self.mean[chosen], kind="stable")]

    def _widen(self, best: NDArray[np.intp]) -> NDArray[np.intp]:
        """Add shots beside the best."""
        offsets = np.array([(dv, da, 0.0) for dv, da in NEIGHBOURS]) * self.sigma
        throws = (self.shots.throws[best][:, None] + offsets).reshape(-1, 3)
        first = len(self.shots)
        self.shots = Shots(
            position=np.zeros(first + len(throws), dtype=np.intp),
            throws=np.concatenate([self.shots.throws, throws]),
            kind=np.concatenate([self.shots.kind, np.repeat(self.shots.kind[best], len(offsets))]),
        )
        more = len(throws)
        self.often = np.concatenate([self.often, np.zeros(more)])
        self.mean = np.concatenate([self.mean, np.full(more, -np.inf)])
        self.error = np.concatenate([self.error, np.full(more, np.inf)])
        return np.arange(first, first + more)

    def _try(self, chosen: NDArray[np.intp], times: int) -> None:
        """Try shots so many times each, all with the same errors, and learn from it."""
        half = self.rng.standard_normal((-(-times // 2), 3))
        errors = np.concatenate([half, -half])[:times] * self.sigma
        executed = (self.shots.throws[chosen][:, None] + errors).reshape(-1, 3)
        self.often[chosen] += times
        self.executed = np.concatenate([self.executed, executed])
        self.worth = np.concatenate([self.worth, self._worth_of(executed)])
        tried = self.often > 0
        self.mean[chosen], self.error[chosen] = estimate(
            self.shots.throws[chosen],
            self.shots.throws[tried],
            self.often[tried],
            self.executed,
            self.worth,
            self.sigma,
        )

    def _worth_of(self, executed: Floats) -> Floats:
        """Chance to win after each execution, (n,)."""
        before = np.broadcast_to(self.stones, (len(executed), *self.stones.shape))
        after = self.sheet.play(before, self.delivered, executed)
        return self.judge.chances(self.view, after, self.delivered + 1)


def _end_of(view: PlayerView) -> End:
    """The end in play.

    Raises
    ------
    InputError : there is none
    """
    if view.game.end is None:
        raise InputError("no end is in play")
    return view.game.end


def _throw(throw: Floats) -> Throw:
    speed, angle, spin = throw.tolist()
    return Throw(
        speed=min(max(speed, 1e-3), MAX_SPEED),
        angle=angle,
        spin=min(max(spin, -MAX_SPIN), MAX_SPIN),
    )
