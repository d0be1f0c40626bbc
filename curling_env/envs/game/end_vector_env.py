"""Many ends of `CurlingEnd-v0` at once, whose throws are simulated together."""

# Gymnasium leaves the spaces of a VectorEnv partly untyped.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, ClassVar

import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space, iterate
from numpy.typing import NDArray

from curling_env.envs.game.action import FollowsDecisions, TeamDecisions
from curling_env.envs.game.end_env import AGENT, CurlingEndEnv
from curling_env.envs.game.reward import GameRewardParts, reward_parts
from curling_env.errors import InputError
from curling_env.game import Call, GameState, Player
from curling_env.game.ice_evolution import ice_for_game
from curling_env.game.rules import Ruling, Team
from curling_env.game.rules.game import deliver
from curling_env.game.rules.teams import STONES_PER_TEAM
from curling_env.game.simulator import direction_of, result_of_places
from curling_env.physics.many_stones.batch import RELEASE_DTYPE, play_batch
from curling_env.physics.one_stone.slide import play_bounds
from curling_env.sheet import TEE_Y
from curling_env.throw import Delivery, velocity_of
from curling_env.typing import Flags, Floats

DIRECTION = direction_of(0)


class CurlingEndVectorEnv(VectorEnv[Any, Any, Any]):
    """Many ends of `CurlingEnd-v0` at once.

    With the same seeds, ends are those of `CurlingEndEnv`, in less time: the throws of a step are
    simulated together. Where stones wear the ice, or every game has its own set of stones, no two
    ends share an ice; they are then played one after another, as slowly as by `CurlingEndEnv`.
    An end that is over begins anew at the next step.

    Parameters
    ----------
    num_envs : number of ends
    settings : options of `CurlingEndEnv` other than `render_mode`

    Raises
    ------
    InputError : a setting that makes no sense, or that only a single end can have
    """

    metadata: ClassVar[dict[str, Any]] = {  # pyright: ignore[reportIncompatibleVariableOverride]
        "autoreset_mode": AutoresetMode.NEXT_STEP
    }

    def __init__(self, num_envs: int = 1, **settings: Any) -> None:
        if num_envs < 1:
            raise InputError(f"num_envs must be at least 1, got {num_envs}")
        if settings.get("render_mode") is not None:
            raise InputError("many ends at once have no render_mode; use a single environment")
        self.single = CurlingEndEnv(**settings)
        self.num_envs = num_envs
        self.single_observation_space = self.single.observation_space
        self.single_action_space = self.single.action_space
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._bounds = play_bounds(self.single.simulator.ice, DIRECTION)
        simulator = self.single.simulator
        evolution = simulator.ice_evolution
        self._one_by_one = bool(simulator.ice_wears or evolution.stone_spread)
        self._ice = ice_for_game(simulator.ice, evolution, 0, sweeping=simulator.sweeping)
        self._states: list[GameState] = []
        self._decisions: list[TeamDecisions | None] = [None] * num_envs

    @property
    def states(self) -> tuple[GameState, ...]:
        """The ends at this moment."""
        return tuple(self._states)

    def reset(
        self, *, seed: int | list[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Begin all ends.

        Parameters
        ----------
        seed : one for each end, or the first of consecutive seeds
        options : `hammer` and `power_play`, as for `CurlingEndEnv`

        Raises
        ------
        InputError : an unknown option, or a power play that these rules do not allow
        """
        if isinstance(seed, list):
            seeds = seed
        else:
            seeds = [None if seed is None else seed + i for i in range(self.num_envs)]
        first = next((s for s in seeds if s is not None), None)
        if first is not None or not hasattr(self, "_rngs"):
            self._rngs = [np.random.Generator(np.random.PCG64(s)) for s in seeds]
        options = options or {}
        unknown = sorted(options.keys() - {"hammer", "power_play"})
        if unknown:
            raise InputError(f"unknown option {unknown[0]!r}; options are hammer, power_play")
        hammer, power_play = options.get("hammer"), options.get("power_play")
        self._states = [self._new(i, hammer, power_play) for i in range(self.num_envs)]
        self._answer(range(self.num_envs))
        return self._observe(), {}

    def step(self, actions: Any) -> tuple[Any, Floats, Flags, Flags, dict[str, Any]]:
        """Deliver a stone in every end, and let the opponents answer."""
        if not self._states:
            raise InputError("call reset() before the first step")
        n = self.num_envs
        anew = [i for i in range(n) if self._states[i].game.end is None]
        going = [i for i in range(n) if self._states[i].game.end is not None]
        for i in anew:
            self._states[i] = self._new(i, None)
        rows = list(iterate(self.action_space, actions))
        calls = {i: self.single.action.call_of(rows[i]) for i in going}
        for i in going:
            self._decisions[i] = self.single.action.decisions_of(rows[i])
        parts = self._play(calls)
        for i, answered in self._answer(range(n)).items():
            parts[i] = parts.get(i, GameRewardParts()) + answered
        rewards, over = np.zeros(n), np.zeros(n, dtype=np.bool_)
        points = np.zeros(n)
        for i in going:
            rewards[i] = self.single.weights.total(parts[i])
            over[i] = self._states[i].game.end is None
            points[i] = parts[i].points
        info = {"points": points, "_points": over.copy()} if over.any() else {}
        return self._observe(), rewards, over, np.zeros(n, dtype=np.bool_), info

    # --- the parts ------------------------------------------------------------------------------

    def _new(self, i: int, hammer: Any, power_play: Any = None) -> GameState:
        self.single.np_random = self._rngs[i]
        self._decisions[i] = None
        return self.single.new_state(hammer, power_play)

    def _answer(self, among: Iterable[int]) -> dict[int, GameRewardParts]:
        """The opponents deliver where it is their turn."""
        total: dict[int, GameRewardParts] = {}
        single = self.single
        while True:
            calls: dict[int, Call] = {}
            for i in among:
                end = self._states[i].game.end
                if end is not None and end.to_throw is not AGENT:
                    state: GameState = self._states[i]
                    calls[i] = single.opponent.call(single.simulator.view(state))
            if not calls:
                return total
            for i, parts in self._play(calls).items():
                total[i] = total.get(i, GameRewardParts()) + parts

    def _play(self, calls: dict[int, Call]) -> dict[int, GameRewardParts]:
        """Play one delivery in each of some ends."""
        if not calls:
            return {}
        if self._one_by_one:
            return {i: self._play_alone(i, call) for i, call in calls.items()}
        simulator, states = self.single.simulator, self._states
        # A stone keeps its column, so that its identifier follows from the column in every end.
        # The same team throws in all ends, and its last stone lies in none: fifteen are enough.
        lying = [end.stones for i in calls if (end := states[i].game.end) is not None]
        names = sorted({stone.stone for stones in lying for stone in stones})
        column = {name: k for k, name in enumerate(names)}
        # Lists are turned into arrays once: many small arrays would cost more time.
        absent = (np.nan, np.nan)
        lie: list[list[tuple[float, float]]] = []
        thrown: list[tuple[float, ...]] = []
        columns: list[list[int]] = []
        for i, call in calls.items():
            end = states[i].game.end
            assert end is not None
            throw = simulator.with_execution_error(
                call.throw, simulator.skills[end.to_throw], states[i]
            )
            begin, until = simulator.sweep_interval(call, throw, DIRECTION)
            columns.append([column[stone.stone] for stone in end.stones])
            row = [absent] * len(names)
            for k, stone in zip(columns[-1], end.stones, strict=True):
                row[k] = (stone.x, stone.y + TEE_Y)
            lie.append(row)
            number = STONES_PER_TEAM * end.to_throw + end.number_of_stone
            throws, clock = states[i].throws, states[i].clock
            thrown.append(
                (throw.x, throw.speed, throw.angle, throw.spin, number, clock, throws, begin, until)
            )
        places = np.array(lie).reshape(len(calls), len(names), 2)
        releases = _releases(np.array(thrown), self.single.simulator.delivery)
        after = play_batch(self._ice, places, releases, identity=names, bounds=self._bounds)
        if (after.collisions < 0).any():
            raise InputError("a stone never stops on this ice; check its friction and slope")
        xy = (after.xy - np.array([0.0, TEE_Y])).tolist()
        still = (after.xy[:, : len(names)] == places).all(axis=2).tolist()
        met = after.collisions.tolist()
        parts: dict[int, GameRewardParts] = {}
        for row, i in enumerate(calls):
            state = states[i]
            end = state.game.end
            assert end is not None
            came_to = [xy[row][k] for k in (*columns[row], -1)]
            unmoved = [still[row][k] for k in columns[row]]
            result = result_of_places(end, came_to, unmoved, bool(met[row]))
            team = end.to_throw
            game, ruling = deliver(state.game, result, put_back=self._put_back(i, team))
            parts[i] = reward_parts(state.game, game, team, ruling, AGENT)
            states[i] = simulator.after(state, game)
        return parts

    def _play_alone(self, i: int, call: Call) -> GameRewardParts:
        """Play one delivery in one end, on the ice of that end."""
        single, before = self.single, self._states[i]
        self._states[i], shot = single.simulator.play(before, call, opponent=self._chooser(i))
        return reward_parts(before.game, self._states[i].game, shot.team, shot.ruling, AGENT)

    def _chooser(self, i: int) -> Player:
        """The player that decides for the team that is not to throw, as in `CurlingEndEnv`."""
        end, decisions = self._states[i].game.end, self._decisions[i]
        ours = end is not None and end.to_throw is AGENT
        return self.single.opponent if ours or decisions is None else FollowsDecisions(decisions)

    def _put_back(self, i: int, team: Team) -> Callable[[Ruling], bool]:
        """The decision after a tick by a team."""
        simulator, state, chooser = self.single.simulator, self._states[i], self._chooser(i)
        return lambda ruling: chooser.puts_back(simulator.view(state, team.other), ruling)

    def _observe(self) -> Any:
        seen: list[Any] = [
            self.single.observation.observe(state.game, AGENT, DIRECTION) for state in self._states
        ]
        if not isinstance(seen[0], dict):
            return np.stack(seen)
        names = ("context", "ice", "stones")
        return {name: np.stack([one[name] for one in seen]) for name in names}


def _releases(throws: Floats, delivery: Delivery) -> NDArray[Any]:
    """Releases, of RELEASE_DTYPE.

    Parameters
    ----------
    throws : (n, 9) rows of offset, speed, angle, spin, stone, clock, order, begin and end of
        sweeping
    delivery : where throws begin
    """
    x, speed, angle, spin, stone, clock, order, begin, until = throws.T
    vx, vy = velocity_of(speed, angle, DIRECTION)
    given = {"x": x, "y": -delivery.line_y, "vx": vx, "vy": vy, "omega": spin, "stone": stone}
    given |= {"clock": clock, "order": order, "sweep_start": begin, "sweep_end": until}
    releases = np.zeros(len(throws), dtype=RELEASE_DTYPE)
    for name, values in given.items():
        releases[name] = values
    return releases
