"""Player `search`: it simulates candidate shots, the promising ones more and more often."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from agents.playing.search.aiming_table import AimingTable
from agents.playing.search.calling_style import FOR_POINTS, NEUTRAL_STYLE, CallingStyle
from agents.playing.search.evaluator import PositionEvaluator, end_of
from agents.playing.search.ice_error import ice_error
from agents.playing.search.kernel_regression import estimate
from agents.playing.search.networks import network_for
from agents.playing.search.positions import EndSimulator, position_of
from agents.playing.search.reply import values_after_reply
from agents.playing.search.shots import KINDS, Shots, shots_for
from agents.playing.search.tuning import (
    BUDGET,
    CONCEDE_BELOW,
    FIRST_RATE,
    KEPT_SHARE,
    MIN_POWER_PLAY_GAIN,
    MIN_REPLY_THROWS,
    MIN_THROWS_BEFORE_REPLIES,
    NEIGHBOURS,
    REPLIES_AGAIN,
    REPLIES_ALWAYS,
    REPLIES_ONCE,
    REPLY_FACTOR,
    REPLY_MARGIN,
    REPLY_REPEATS,
    REPLY_ROUNDS,
    REPLY_SHOTS,
    REPLY_STONES,
    ROUNDS,
    WIDENED_SHOTS,
)
from agents.playing.search.value_network import ValueNetwork, skill_feature
from curling_env.errors import InputError
from curling_env.game import Call, Player, PlayerView
from curling_env.game.rules import RuleSet, Ruling
from curling_env.game.rules.lines import Lines
from curling_env.game.rules.rulesets import Side
from curling_env.game.rules.teams import Stones
from curling_env.ice import Ice
from curling_env.sheet import Direction
from curling_env.throw import MAX_SPIN, Delivery, Throw
from curling_env.typing import Floats, Indices


@dataclass(frozen=True, kw_only=True)
class ShotEstimate:
    """Simulated shot.

    Parameters
    ----------
    throw : intended throw
    shot : name of the shot in the sport's words
    win_probability : probability of winning the game after it
    standard_error : standard error of that probability
    """

    throw: Throw
    shot: str
    win_probability: float
    standard_error: float


MAX_SECONDS, MAX_THROWS = 600.0, 1_000_000
"""Maximum time and number of simulated throws before one delivery."""


class SearchPlayer(Player):
    """Player that chooses the shot that wins the game most often.

    Parameters
    ----------
    budget : number of simulated throws before each delivery, and a multiple of it before the last
        but one of an end, see `throws_before`; the same budget gives the same game
    seconds : processor time for each delivery instead of a budget [s]; the choice then depends on
        the machine
    network : network that values positions; by default the package's for such ends, see `networks`
    calls : preferences of the player, in addition to the odds

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
        network: ValueNetwork | None = None,
        calls: CallingStyle = NEUTRAL_STYLE,
    ) -> None:
        if budget < 1 or (seconds is not None and not seconds > 0):
            raise InputError(
                f"expected at least 1 throw, or a time above 0, got {budget} and {seconds}"
            )
        self.budget, self.seconds, self.calls = budget, seconds, calls
        self._network = network
        self._rate = FIRST_RATE
        self._tables: dict[tuple[Direction, Delivery], tuple[Ice, AimingTable]] = {}
        self._evaluators: dict[tuple[int, RuleSet, Lines, float], PositionEvaluator] = {}

    @classmethod
    def with_option(cls, option: str) -> SearchPlayer:
        """Set the effort: `search:500` simulates 500 throws before each delivery, `search:0.2s`
        takes 0.2 s.

        `search:500:points` plays every end for its points, whatever the score of the game.
        """
        thought, colon, aim = option.partition(":")
        timed = thought.endswith("s")
        try:
            amount = float(thought[:-1]) if timed else int(thought)
            if colon and aim != "points":
                raise ValueError
        except ValueError:
            raise InputError(
                "expected a number of throws or seconds, as in search:500, search:0.2s or "
                f"search:500:points, got {option[:40]!r}"
            ) from None
        if not 0 < amount <= (MAX_SECONDS if timed else MAX_THROWS):
            raise InputError(
                f"expected at most {MAX_SECONDS:g} s or {MAX_THROWS} throws, got {option[:40]!r}"
            )
        calls = FOR_POINTS if aim else NEUTRAL_STYLE
        player = cls(seconds=amount, calls=calls) if timed else cls(int(amount), calls=calls)
        player.name = f"search:{option}"
        return player

    def network(self, rules: RuleSet, ice: Ice) -> ValueNetwork:
        """Return the network that values positions by these rules on this ice."""
        return network_for(rules, ice) if self._network is None else self._network

    def call(self, view: PlayerView) -> Call:
        best = self.ranked_shots(view)[0]
        return Call(throw=best.throw, shot=best.shot)

    def ranked_shots(self, view: PlayerView) -> list[ShotEstimate]:
        """Return the most simulated shots, the best first."""
        return self._searched(view).ranked_shots()

    def shots_by_kind(self, view: PlayerView) -> list[ShotEstimate]:
        """Return the best shot of every kind and handle, the best first.

        Shots that soon looked poor were simulated seldom: their standard errors are large.
        """
        return self._searched(view).shots_by_kind()

    def _searched(self, view: PlayerView) -> _Search:
        begin = time.process_time()
        budget = throws_before(view, self.budget)
        if self.seconds is not None:
            budget = max(int(self._rate * self.seconds), 1)
        search = _Search(view, self._table(view), self._evaluator(view), budget)
        search.run()
        self._rate = search.simulated / max(time.process_time() - begin, 1e-3)
        return search

    def concedes(self, view: PlayerView) -> bool:
        return self._win_probability(view, end_of(view).stones, later=0) < CONCEDE_BELOW

    def power_play(self, view: PlayerView) -> Side | None:
        game = view.game
        opponent = view.team.other not in game.power_plays
        odds = self._evaluator(view).game_odds
        gain = odds.power_play_gain(game.lead(view.team), game.ends_left, opponent=opponent)
        return "right" if gain > MIN_POWER_PLAY_GAIN else None

    def puts_back(self, view: PlayerView, ruling: Ruling) -> bool:
        if ruling.option is None:
            return True
        # The ruling concerns the delivery after those in the view.
        back, left = (
            self._win_probability(view, stones, later=1)
            for stones in (ruling.option, ruling.stones)
        )
        return back >= left

    def _win_probability(self, view: PlayerView, stones: Stones, *, later: int) -> float:
        """Return the win probability with these stones after a number of further deliveries."""
        end = end_of(view)
        after = replace(end, stones=stones, delivered=end.delivered + later)
        position = position_of(after)[None]
        return float(self._evaluator(view).win_probabilities(view, position, after.delivered)[0])

    def _evaluator(self, view: PlayerView) -> PositionEvaluator:
        network = self.network(view.game.rules, view.ice)
        skill = skill_feature(view.skill)
        key = (id(network), view.game.rules, view.game.lines, skill)
        if key not in self._evaluators:
            self._evaluators[key] = PositionEvaluator(network, *key[1:], self.calls)
        return self._evaluators[key]

    def _table(self, view: PlayerView) -> AimingTable:
        key = view.direction, view.delivery
        known = self._tables.get(key)
        if known is None or known[0] is not view.ice:
            known = (view.ice, AimingTable(view.ice, *key))
            self._tables[key] = known
        return known[1]


class _Search:
    """One search, before one delivery."""

    def __init__(
        self, view: PlayerView, table: AimingTable, evaluator: PositionEvaluator, budget: int
    ) -> None:
        end = end_of(view)
        self.view, self.table, self.evaluator = view, table, evaluator
        replies = _simulates_replies(view, budget)
        self.budget = max(budget // REPLY_FACTOR, MIN_THROWS_BEFORE_REPLIES) if replies else budget
        self.for_replies = budget - self.budget
        self.simulator = EndSimulator(
            ice=view.ice,
            direction=view.direction,
            rules=view.game.rules,
            lines=view.game.lines,
            delivery=view.delivery,
        )
        self.delivered, self.stones = end.delivered, position_of(end)
        self.rng = view.rng()
        own = [view.skill.sigma_speed, view.skill.sigma_angle, view.skill.sigma_spin]
        self.sigma = np.hypot(own, ice_error(view, table.button_speed))
        shots = shots_for(table, self.simulator, self.stones[None], end.delivered)
        shots = evaluator.calls.among(shots, view, self.simulator)
        self.shots = self._affordable(shots)
        self.counts = np.zeros(len(self.shots))
        self.executed = np.empty((0, 3))
        self.values = np.empty(0)
        self.mean = np.full(len(self.shots), -np.inf)
        self.error = np.full(len(self.shots), np.inf)
        self.finalists: Indices | None = None
        self.looked_up = 0

    def run(self) -> None:
        """Run the rounds; in each, fewer shots are simulated more often."""
        chosen = np.arange(len(self.shots))
        for number in range(ROUNDS):
            self._simulate(chosen, max(self.budget // ROUNDS // len(chosen), 1))
            if number < ROUNDS - 1:
                kept = max(round(len(chosen) * KEPT_SHARE), 3)
                chosen = self._best_first(chosen)[:kept]
                chosen = np.concatenate([chosen, self._widen(chosen[:WIDENED_SHOTS])])
        if self.for_replies:
            self._value_by_replies()

    @property
    def simulated(self) -> int:
        """Number of throws simulated up to now."""
        return len(self.executed) + self.looked_up

    def ranked_shots(self) -> list[ShotEstimate]:
        last = np.flatnonzero(self.counts == self.counts.max())
        return [self._estimate(k) for k in self._best_first(_or(self.finalists, last))]

    def shots_by_kind(self) -> list[ShotEstimate]:
        return [self._estimate(k) for k in self._best_of_kinds()]

    def _best_of_kinds(self) -> Indices:
        """Return the best shot of every kind and handle, the best first."""
        best: dict[tuple[int, bool], int] = {}
        for k in self._tried():
            best.setdefault((int(self.shots.kind[k]), bool(self.shots.throws[k, 2] > 0)), int(k))
        return np.array(list(best.values()), dtype=np.intp)

    # --- its steps --------------------------------------------------------------------------------

    def _tried(self) -> Indices:
        """Return the indices of the simulated shots, the best first."""
        return self._best_first(np.flatnonzero(np.isfinite(self.mean)))

    def _estimate(self, k: int) -> ShotEstimate:
        return ShotEstimate(
            throw=_throw(self.shots.throws[k], self.view.delivery.max_speed),
            shot=KINDS[self.shots.kind[k]],
            win_probability=float(np.clip(self.mean[k], 0, 1)),  # means of single precision
            standard_error=float(self.error[k]),
        )

    def _affordable(self, shots: Shots) -> Shots:
        """Return all shots, or a random choice that the first round can simulate."""
        most = max(self.budget // ROUNDS, 3)
        if len(shots) <= most:
            return shots
        return shots[np.sort(self.rng.permutation(len(shots))[:most])]

    def _best_first(self, chosen: Indices) -> Indices:
        return chosen[np.argsort(-self.mean[chosen], kind="stable")]

    def _widen(self, best: Indices) -> Indices:
        """Add neighbours of the best shots; return their indices."""
        offsets = np.array([(dv, da, 0.0) for dv, da in NEIGHBOURS]) * self.sigma
        throws = (self.shots.throws[best][:, None] + offsets).reshape(-1, 3)
        first, more = len(self.shots), len(throws)
        self.shots = Shots(
            position=np.zeros(first + more, dtype=np.intp),
            throws=np.concatenate([self.shots.throws, throws]),
            kind=np.concatenate([self.shots.kind, np.repeat(self.shots.kind[best], len(offsets))]),
        )
        self.counts = np.concatenate([self.counts, np.zeros(more)])
        self.mean = np.concatenate([self.mean, np.full(more, -np.inf)])
        self.error = np.concatenate([self.error, np.full(more, np.inf)])
        return np.arange(first, first + more)

    def _simulate(self, chosen: Indices, times: int) -> None:
        """Simulate shots repeatedly, with the same errors for all, and update them."""
        skill = self.view.skill
        half = skill.standard_errors(-(-times // 2), self.rng)
        errors = np.concatenate([half, -half])[:times] * self.sigma
        executed = (self.shots.throws[chosen][:, None] + errors).reshape(-1, 3)
        self.counts[chosen] += times
        self.executed = np.concatenate([self.executed, executed])
        self.values = np.concatenate([self.values, self._values_of(executed)])
        tried = self.counts > 0
        self.mean[chosen], self.error[chosen] = estimate(
            self.shots.throws[chosen],
            self.shots.throws[tried],
            self.counts[tried],
            self.executed,
            self.values,
            self.sigma,
            tails=skill.tails,
            correlation=skill.correlation,
        )

    def _value_by_replies(self) -> None:
        """Value the best shots of different kinds by the opponent's replies.

        The network's values of the other shots are shifted by its error on these.
        """
        kinds = self._best_of_kinds()
        chosen = kinds[self.mean[kinds] > self.mean[kinds].max() - REPLY_MARGIN][:REPLY_SHOTS]
        if len(chosen) < 2:
            return
        thought = self.mean.copy()
        cost = REPLY_ROUNDS * (REPLIES_ONCE + REPLIES_AGAIN * REPLY_REPEATS)
        found: dict[int, list[Floats]] = {int(k): [] for k in chosen}
        looked_at = chosen
        for _ in range(REPLY_ROUNDS):
            times = max(self.for_replies // cost // len(chosen), 2)
            half = self.view.skill.standard_errors(-(-times // 2), self.rng)
            errors = np.concatenate([half, -half])[:times] * self.sigma
            values = self._values_after_replies(chosen, errors)
            for k, value in zip(chosen.tolist(), values, strict=True):
                found[k].append(value)
                every = np.concatenate(found[k])
                self.mean[k], self.error[k] = every.mean(), every.std() / np.sqrt(len(every))
            self.finalists = chosen
            chosen = self._best_first(chosen)[: max(len(chosen) // 2, 2)]
        others = np.setdiff1d(self._tried(), looked_at)
        moved = self.mean[others] + (self.mean[looked_at] - thought[looked_at]).mean()
        self.mean[others] = np.clip(moved, 0.0, 1.0)

    def _values_after_replies(self, chosen: Indices, errors: Floats) -> Floats:
        """Return the win probability after each shot with each error and the reply, (shots,
        errors).
        """
        executed = (self.shots.throws[chosen][:, None] + errors).reshape(-1, 3)
        before = np.broadcast_to(self.stones, (len(executed), *self.stones.shape))
        values, simulated = values_after_reply(
            self.simulator,
            self.table,
            partial(self.evaluator.win_probabilities, self.view),
            self.simulator.play(before, self.delivered, executed),
            self.delivered + 1,
            self.sigma,
            self.view.skill,
            self.rng,
        )
        self.looked_up += len(executed) + simulated
        return values.reshape(len(chosen), len(errors))

    def _values_of(self, executed: Floats) -> Floats:
        """Return the win probability after each executed throw, (n,)."""
        before = np.broadcast_to(self.stones, (len(executed), *self.stones.shape))
        after = self.simulator.play(before, self.delivered, executed)
        return self.evaluator.win_probabilities(self.view, after, self.delivered + 1)


def throws_before(view: PlayerView, budget: int) -> int:
    """Return the number of throws that a search with a budget simulates before the next
    delivery.
    """
    if budget >= REPLIES_ALWAYS or _to_come(view) > REPLY_STONES:
        return budget
    more = REPLY_FACTOR * budget
    return more if _simulates_replies(view, more) else budget


def _simulates_replies(view: PlayerView, budget: int) -> bool:
    """Return whether a search of this size simulates the opponent's replies."""
    to_come = _to_come(view)
    return to_come > 0 and budget >= (
        MIN_REPLY_THROWS if to_come <= REPLY_STONES else REPLIES_ALWAYS
    )


def _to_come(view: PlayerView) -> int:
    """Return the number of stones to come in the end after the next delivery."""
    return view.game.rules.deliveries - end_of(view).delivered - 1


def _or(given: Indices | None, otherwise: Indices) -> Indices:
    return otherwise if given is None else given


def _throw(throw: Floats, max_speed: float) -> Throw:
    speed, angle, spin = throw.tolist()
    return Throw(
        speed=min(max(speed, 1e-3), max_speed),
        angle=angle,
        spin=min(max(spin, -MAX_SPIN), MAX_SPIN),
    )
