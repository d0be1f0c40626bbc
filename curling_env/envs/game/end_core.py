"""Rules of `CurlingEnd-v0`: the start of ends, and the effect of a step.

A step is a delivery of the agent and the opponent's answer. Single and vector environments differ
only in the simulator of deliveries.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, Literal, NamedTuple, cast

import numpy as np

from curling_env.envs.core import Core, Facts, Part
from curling_env.envs.game.action import Choices, FollowsDecisions, Sweeping, TeamDecisions
from curling_env.envs.game.core import (
    DIRECTION,
    DeliveryOption,
    EvolutionOption,
    GameCore,
    GameIce,
    RulesOption,
    TeamSkillOption,
    checked_power_play,
    score_of,
)
from curling_env.envs.game.observation import ObservationKind
from curling_env.envs.game.opponents import Opponents, PolicyPlayer
from curling_env.envs.game.reward import NOTHING, GameRewardParts, GameRewardWeights, reward_parts
from curling_env.envs.ices import GivenIce, IceOption
from curling_env.envs.options import one_of, reset_options, rules_from, yes_or_no
from curling_env.errors import InputError
from curling_env.game import (
    NO_EVOLUTION,
    Call,
    GameState,
    PlayedShot,
    Player,
    PlayerView,
)
from curling_env.game.rules import Team
from curling_env.game.rules.game import new_game
from curling_env.infrastructure.keywords import rejects_unknown_keywords
from curling_env.typing import Flags, Floats, Indices

Hammer = Literal["own", "opponent", "random"]
HAMMERS = ("own", "opponent", "random")
RESET_OPTIONS = ("hammer", "power_play", "state", "ice", "known_ice")
"""Names of the `options` of `reset`."""
AGENT = Team.HOME
"""The agent plays the home team's stones."""


class End(NamedTuple):
    """End at one moment, immutable.

    Parameters
    ----------
    ice : the ice it is played on
    opponent : whom the agent meets
    state : the end itself
    decisions : the agent's last decisions; None where they are not part of its action
    shots : the deliveries of the last step, or of the opponent before the first
    before : the states before each of them, where they are shown
    memory : what an opponent that is a policy remembers of the end
    """

    ice: GameIce
    opponent: Player
    state: GameState
    decisions: TeamDecisions | None = None
    shots: tuple[PlayedShot, ...] = ()
    before: tuple[GameState, ...] = ()
    memory: Any = None

    @property
    def is_over(self) -> bool:
        """True after the last stone."""
        return self.state.game.end is None

    @property
    def is_the_opponents_turn(self) -> bool:
        """True if it is the opponent's turn."""
        end = self.state.game.end
        return end is not None and end.to_throw is not AGENT

    @property
    def chooser(self) -> Player:
        """Player that decides for the agent after the opponent's tick."""
        return self.opponent if self.decisions is None else FollowsDecisions(self.decisions)

    @property
    def decider(self) -> Player:
        """Return the player that decides after a tick by the throwing team."""
        return self.chooser if self.is_the_opponents_turn else self.opponent

    @property
    def view(self) -> PlayerView:
        """Return the agent's view of the end."""
        return self.ice.simulator.view(self.state, AGENT)


Ends = tuple[End, ...]
DeliveryPlayer = Callable[[Sequence[End], Sequence[Call]], Sequence[tuple[GameState, PlayedShot]]]
"""Plays one delivery in each of some ends."""


class PlayOneByOne:
    """Engine that solves contacts by pymunk.

    Parameters
    ----------
    paths : whether the stones' paths are kept
    """

    def __init__(self, *, paths: bool) -> None:
        self._paths = paths

    def __call__(
        self, ends: Sequence[End], calls: Sequence[Call]
    ) -> Sequence[tuple[GameState, PlayedShot]]:
        return [
            end.ice.simulator.play(end.state, call, opponent=end.decider, paths=self._paths)
            for end, call in zip(ends, calls, strict=True)
        ]


class Asked(NamedTuple):
    """The options of a reset.

    Parameters
    ----------
    hammer : the team that delivers last
    power_play : side of the agent's power play
    states : initial state of each end; None for new ends
    ice : the ice, and what is to be known of it
    """

    hammer: Hammer
    power_play: Any = None
    states: Sequence[GameState] | None = None
    ice: GivenIce = (None, None)


@rejects_unknown_keywords("CurlingEnd-v0")
class EndCore(GameCore, Core[Ends]):
    """Options and rules of `CurlingEnd-v0`; see `CurlingEndEnv`."""

    def __init__(
        self,
        ice: IceOption = "standard",
        *,
        known_ice: IceOption | None = None,
        ices: Any = None,
        opponent: Any = "rulebased",
        hammer: Hammer = "random",
        rules: RulesOption = "world_curling_2024",
        skill: TeamSkillOption = "elite",
        opponent_skill: TeamSkillOption | None = None,
        ice_evolution: EvolutionOption = NO_EVOLUTION,
        sweeping: Sweeping = "none",
        delivery: DeliveryOption = "hog-line",
        choices: Choices = "rule",
        actions: str = "throws",
        observation: ObservationKind = "flat",
        weights: GameRewardWeights | Mapping[str, Any] | None = None,
        potential: Any = None,
        details: bool = False,
        render_mode: str | None = None,
    ) -> None:
        self.details = yes_or_no("details", details)
        GameCore.__init__(
            self,
            ice=ice,
            known_ice=known_ice,
            ices=ices,
            rules=rules_from(rules, ends=1),
            skills=(skill, skill if opponent_skill is None else opponent_skill),
            ice_evolution=ice_evolution,
            sweeping=sweeping,
            delivery=delivery,
            choices=choices,
            actions=actions,
            observation=observation,
            weights=weights,
            potential=potential,
        )
        self.opponents = Opponents(opponent, self)
        """The players that the agent may meet, to which more may be appended."""
        self._hammer: Hammer = one_of("hammer", hammer, HAMMERS)
        self.player: DeliveryPlayer = PlayOneByOne(paths=render_mode is not None)
        """Simulator of the deliveries."""
        # The view, which follows after `GameCore` in the order of the classes.
        super(GameCore, self).__init__(self.usual.observation.space, self.action.space, render_mode)

    # --- how ends begin -------------------------------------------------------------------------

    def blank(self, count: int) -> Ends:
        """Return finished ends, before the first reset."""
        state = GameState(game=new_game(self.usual.simulator.rules))
        return (End(self.usual, self.opponents[0], state),) * count

    def asked(self, options: Any, count: int) -> Asked:
        """Read the options of a reset.

        Raises
        ------
        InputError : an unknown option, or an invalid value
        """
        asked = reset_options(options, RESET_OPTIONS)
        hammer = self._hammer
        if asked.get("hammer") is not None:
            hammer = one_of("hammer", asked["hammer"], HAMMERS)
        power_play = checked_power_play(asked.get("power_play"))
        if power_play is not None and hammer == "opponent":
            raise InputError(
                "where the hammer is the opponent's, the opponent decides on a power play; ask "
                "for it with hammer 'own'"
            )
        states = asked.get("state")
        if states is not None:
            several = isinstance(states, Sequence)
            each = list(cast("Sequence[Any]", states)) if several else [states] * count
            if len(each) != count:
                raise InputError(f"expected a state for each of {count} ends, got {len(each)}")
            states = [self.checked_state(state) for state in each]
        return Asked(hammer, power_play, states, self.ices.given(asked))

    def checked_state(self, state: Any) -> GameState:
        """Check a state to continue from.

        Raises
        ------
        InputError : something else, a game by other rules, or one in which the opponent is to throw
        """
        state = super().checked_state(state)
        if state.game.end is not None and state.game.end.to_throw is not AGENT:
            raise InputError("a state must have the agent (the home team) to throw")
        return state

    def begun(
        self,
        episodes: Ends,
        rows: Indices,
        rngs: Sequence[np.random.Generator],
        asked: Asked | None = None,
    ) -> Ends:
        """Begin some ends; the opponent delivers first if the agent has the hammer.

        Raises
        ------
        InputError : a power play that these rules do not allow
        """
        asked = asked or Asked(self._hammer)
        ends, some = list(episodes), cast("list[int]", rows.tolist())
        for i in some:
            ends[i] = self._begin(rngs[i], asked, None if asked.states is None else asked.states[i])
        if asked.states is None:
            self._answer(ends, some)
        return tuple(ends)

    def _begin(self, rng: np.random.Generator, asked: Asked, state: GameState | None) -> End:
        """Return an end before its first stone, on its ice, against its opponent."""
        ice, opponent = self.ices.draw(rng, asked.ice), self.opponents.draw(rng)
        if state is not None:
            return End(ice, opponent, state)
        own = asked.hammer == "own" or (asked.hammer == "random" and rng.random() < 0.5)
        seed, power_play = int(rng.integers(2**31)), asked.power_play
        state = ice.simulator.new_game(seed, last_stone=AGENT if own else AGENT.other)
        if not own:
            free = state.game.may_power_play
            power_play = opponent.power_play(ice.simulator.view(state)) if free else None
        return End(ice, opponent, ice.simulator.begin_end(state, power_play=power_play))

    # --- a step ---------------------------------------------------------------------------------

    def played(
        self,
        episodes: Ends,
        rows: Indices,
        rngs: Sequence[np.random.Generator],
        actions: Sequence[Any],
    ) -> tuple[Ends, Floats, list[Part]]:
        """Deliver a stone in some ends, and let the opponents answer."""
        ends, some = list(episodes), cast("list[int]", rows.tolist())
        if not some:
            return episodes, np.zeros(0), []
        calls = self.action.calls_of(actions, lambda k: ends[some[k]].view)
        values = [self.value(ends[i].state.game, AGENT) for i in some] if self.potential else []
        decisions = [self.action.decisions_of(action) for action in actions]
        parts = self._play(ends, some, calls, decisions)
        for i, answered in self._answer(ends, some).items():
            parts[i] = parts[i] + answered
        for i, value in zip(some, values, strict=False):
            parts[i] = self.with_potential(parts[i], value, ends[i].state.game, AGENT)
        each = [parts[i] for i in some]
        rewards = np.array(
            [0.0 if one is NOTHING else self.weights.total(one) for one in each], dtype=np.float64
        )
        names = NOTHING.as_dict()
        facts: Facts = {
            "reward_parts": {name: np.array([getattr(one, name) for one in each]) for name in names}
        }
        return tuple(ends), rewards, [(rows, facts)]

    def _answer(self, ends: list[End], among: Iterable[int]) -> dict[int, GameRewardParts]:
        """Let the opponents deliver on their turn; return the agent's rewards."""
        total: dict[int, GameRewardParts] = {}
        while True:
            theirs = [i for i in among if ends[i].is_the_opponents_turn]
            if not theirs:
                return total
            calls: list[Call] = []
            for i in theirs:
                end = ends[i]
                view = end.ice.simulator.view(end.state)
                if isinstance(end.opponent, PolicyPlayer):
                    call, memory = end.opponent.answer(view, end.memory)
                    ends[i] = end._replace(memory=memory)
                else:
                    call = end.opponent.call(view)
                calls.append(call)
            for i, parts in self._play(ends, theirs, calls).items():
                total[i] = total.get(i, NOTHING) + parts

    def _play(
        self,
        ends: list[End],
        some: Sequence[int],
        calls: Sequence[Call],
        decisions: Sequence[TeamDecisions | None] | None = None,
    ) -> dict[int, GameRewardParts]:
        """Play one delivery in each of some ends; return the agent's rewards.

        Parameters
        ----------
        ends : all ends, in which those that were played are replaced
        some : which of them are played
        calls : what the team to throw calls for, in each
        decisions : the agent's, in each, with which a step begins; None for the opponent's answer
        """
        parts: dict[int, GameRewardParts] = {}
        played = self.player([ends[i] for i in some], calls)
        for k, (i, (after, shot)) in enumerate(zip(some, played, strict=True)):
            ice, opponent, state, decided, shots, before, memory = ends[i]
            if decisions is not None:
                decided, shots, before = decisions[k], (), ()
            before = (*before, state) if self.render_mode else ()
            ends[i] = End(ice, opponent, after, decided, (*shots, shot), before, memory)
            parts[i] = reward_parts(state.game, after.game, shot.team, shot.ruling, AGENT)
        return parts

    def are_over(self, episodes: Ends) -> Flags:
        """True after the last stone."""
        return np.array([end.state.game.end is None for end in episodes])

    # --- what is seen ---------------------------------------------------------------------------

    def observed(self, episodes: Ends) -> Any:
        """Return the agent's observations of all ends."""
        alike: dict[int, list[int]] = {}
        for i, end in enumerate(episodes):
            alike.setdefault(id(end.ice.observation), []).append(i)
        seen: list[tuple[list[int], Any]] = [
            (rows, episodes[rows[0]].ice.observation.observe(
                [episodes[i].state for i in rows], AGENT, DIRECTION
            ))
            for rows in alike.values()
        ]  # fmt: skip
        return seen[0][1] if len(seen) == 1 else _put_together(seen, len(episodes))

    def reported(self, episodes: Ends, rows: Indices) -> Facts:
        """Return the score, the deliveries of the last step, and the masks if actions are shots."""
        some = [episodes[i] for i in cast("list[int]", rows.tolist())]
        score = [score_of(end.state.game, AGENT) if end.is_over else (0, 0) for end in some]
        facts: Facts = {"score": np.array(score).reshape(-1, 2)}
        if self.details:
            facts["shots"] = [end.shots for end in some]
        if self.has_masks:
            facts["action_mask"] = np.array([self.mask(end.view) for end in some])
        return facts


def _put_together(seen: Sequence[tuple[list[int], Any]], count: int) -> Any:
    """Combine observations of all episodes from groups of them."""
    first = seen[0][1]
    if isinstance(first, dict):
        return {
            name: _put_together([(rows, part[name]) for rows, part in seen], count)
            for name in cast("dict[str, Any]", first)
        }
    out = np.empty((count, *first.shape[1:]), dtype=first.dtype)
    for rows, part in seen:
        out[rows] = part
    return out
