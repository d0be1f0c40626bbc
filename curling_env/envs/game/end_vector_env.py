"""Many ends of `CurlingEnd-v0` at once, whose throws are simulated together."""

# Gymnasium leaves the spaces of a VectorEnv partly untyped.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any, cast

import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from curling_env.envs.game.action import FollowsDecisions, GameAction, TeamDecisions
from curling_env.envs.game.batch import (
    DIRECTION,
    BatchShot,
    Deliveries,
    Facts,
    lying_in,
    release_table_of,
    sweeps_of,
)
from curling_env.envs.game.end_env import AGENT, RESET_OPTIONS, CurlingEndEnv, observed
from curling_env.envs.game.observation import GameObservation
from curling_env.envs.game.opponents import Opponents
from curling_env.envs.game.reward import NOTHING as NO_REWARD
from curling_env.envs.game.reward import GameRewardParts, reward_parts
from curling_env.envs.game.shots import ShotActions, mask_of
from curling_env.envs.ices import GivenIce
from curling_env.envs.options import reset_options, whole_number
from curling_env.envs.vector import (
    autoreset_mode_of,
    masked,
    objects,
    reset_mask_of,
    rows_of,
    seeds_of,
    unmasked,
)
from curling_env.errors import InputError
from curling_env.game import Call, GameSimulator, GameState, PlayedShot, Player, PlayerView
from curling_env.game.ice_evolution import ice_for_game
from curling_env.game.rules import Ruling, Team
from curling_env.game.rules.game import deliver, new_game
from curling_env.game.simulator import result_of_places
from curling_env.ice import Ice
from curling_env.physics.batch import BatchEngine
from curling_env.physics.slides import play_bounds
from curling_env.sheet import TEE_Y
from curling_env.typing import Flags, Floats

NOTHING: Mapping[str, Any] = {}
"""A reset that was asked for nothing."""


class CurlingEndVectorEnv(VectorEnv[Any, Any, Any]):
    """Many ends of `CurlingEnd-v0` at once.

    With the same seeds, ends are those of `CurlingEndEnv`, in less time: the throws of a step are
    simulated together. Before stones touch, both agree to a tenth of a millimetre; contacts
    multiply what is left. `info` holds the same entries in Gymnasium's form; the outcomes of its
    `shots` have no contacts and no paths. Where stones wear the ice, or every game has its own set
    of stones, no two ends share an ice; they are then played one after another, as slowly as by
    `CurlingEndEnv`, and with its outcomes.

    Parameters
    ----------
    num_envs : number of ends
    autoreset_mode : when an end that is over begins anew: in the next step ("NextStep"), whose
        action is then not played; in the same step ("SameStep"); or when `reset` asks for it with a
        `reset_mask` ("Disabled")
    render_mode : None; many ends are not drawn
    settings : options of `CurlingEndEnv`

    Raises
    ------
    InputError : a setting that makes no sense, or that only a single end can have
    """

    def __init__(
        self,
        num_envs: int = 1,
        *,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        render_mode: str | None = None,
        **settings: Any,
    ) -> None:
        self.num_envs = whole_number("num_envs", num_envs, least=1)
        if render_mode is not None:
            raise InputError("many ends at once have no render_mode; use a single environment")
        self.autoreset_mode = autoreset_mode_of(autoreset_mode)
        self.single = CurlingEndEnv(**settings)
        self.metadata = {
            **self.single.metadata,
            "render_modes": [],
            "autoreset_mode": self.autoreset_mode,
        }
        self.single_observation_space = self.single.observation_space
        self.single_action_space = self.single.action_space
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._rngs: list[np.random.Generator] = []
        self._states: list[GameState] = []
        simulator, observation = self.single.simulator, self.single.observation
        self._simulators: list[GameSimulator] = [simulator] * num_envs
        self._observations: list[GameObservation] = [observation] * num_envs
        self._opponents: list[Player] = [self.single.opponent] * num_envs
        self._decisions: list[TeamDecisions | None] = [None] * num_envs
        self._shots: list[tuple[PlayedShot, ...]] = [()] * num_envs
        self._engines: dict[int, tuple[Ice, BatchEngine, Floats]] = {}

    @property
    def states(self) -> tuple[GameState, ...]:
        """The ends at this moment."""
        return tuple(self._states)

    @property
    def opponents(self) -> Opponents:
        """The players that the agent may meet, to which more may be appended."""
        return self.single.opponents

    def reset(
        self, *, seed: Any = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Begin all ends.

        Parameters
        ----------
        seed : one for each end, or the first of consecutive seeds
        options : those of `CurlingEndEnv`, where `state` may also be a list with one for each end;
            and `reset_mask` (num_envs,) to begin only some

        Raises
        ------
        InputError : an option that is unknown or makes no sense
        """
        n = self.num_envs
        seeds = seeds_of(seed, n)
        asked = reset_options(options, (*RESET_OPTIONS, "reset_mask"))
        mask = reset_mask_of(asked.pop("reset_mask", None), n)
        given = self.single.table.ices.given(asked)
        states = asked.pop("state", None)
        if states is not None:
            many = isinstance(states, Sequence)
            each = list(cast("Sequence[Any]", states)) if many else [states] * n
            if len(each) != n:
                raise InputError(f"expected a state for each of {n} ends, got {len(each)}")
            states = [self.single.checked(state) for state in each]
        if not self._rngs:
            self._rngs = [np.random.default_rng() for _ in range(n)]
            mask = np.ones(n, dtype=np.bool_)
        rows: list[int] = np.flatnonzero(mask).tolist()
        self._states = self._states or [GameState(game=new_game(self.single.simulator.rules))] * n
        for i in rows:
            if seeds[i] is not None:
                self._rngs[i] = np.random.Generator(np.random.PCG64(seeds[i]))
            self._begin(i, asked if states is None else {**asked, "state": states[i]}, given)
        if states is None:
            self._answer(rows)
        shots = objects([self._shots[i] for i in rows])
        info = masked({"shots": shots}, mask)
        return self._observe(), info | self._masks(mask)

    def step(self, actions: Any) -> tuple[Any, Floats, Flags, Flags, dict[str, Any]]:
        """Deliver a stone in every end, and let the opponents answer.

        Raises
        ------
        InputError : before the first reset, actions that are none, or with the mode "Disabled" an
            end that is over
        """
        if not self._states:
            raise InputError("call reset() before the first step")
        n, single = self.num_envs, self.single
        over = np.array([state.game.end is None for state in self._states])
        if self.autoreset_mode is AutoresetMode.DISABLED and over.any():
            raise InputError(
                f"end {int(np.argmax(over))} is over; begin it with "
                "reset(options={'reset_mask': …})"
            )
        rows = rows_of(self.action_space, actions, n)
        going: list[int] = np.flatnonzero(~over).tolist()
        calls = self._calls(going, rows)
        for i in np.flatnonzero(over).tolist():
            self._begin(i)
        potential, held = single.potential, dict.fromkeys(going, 0.0)
        for i in going:
            self._shots[i] = ()
            self._decisions[i] = single.action.decisions_of(rows[i])
            if potential:
                held[i] = potential.value(self._states[i].game, AGENT)
        parts = self._play(calls)
        for i, answered in self._answer(range(n)).items():
            parts[i] = parts.get(i, NO_REWARD) + answered
        if potential:
            for i in going:
                rise = potential.rise(held[i], self._states[i].game, AGENT)
                parts[i] = replace(parts[i], potential=rise)
        rewards = np.zeros(n)
        for i in going:
            if parts[i] is not NO_REWARD:
                rewards[i] = single.weights.total(parts[i])
        ended = np.array([state.game.end is None for state in self._states])
        info = self._info(parts, ~over, ended)
        observations = self._observe()
        return *self._ended(observations, rewards, ended, info), info

    # --- the parts ------------------------------------------------------------------------------

    def _info(
        self, parts: dict[int, GameRewardParts], played: Flags, ended: Flags
    ) -> dict[str, Any]:
        """What is told of a step: `shots`, `reward_parts`, and where an end is over its `score`."""
        each = [parts[i] for i in np.flatnonzero(played).tolist()]
        all_of_them = np.ones(self.num_envs, dtype=np.bool_)
        info = masked({"shots": objects(self._shots)}, all_of_them) | self._masks(all_of_them)
        if each:
            names = NO_REWARD.as_dict()
            table = {name: np.array([getattr(one, name) for one in each]) for name in names}
            info |= masked({"reward_parts": table}, played)
        if ended.any():
            scores = [self._states[i].game.line_score[-1] for i in np.flatnonzero(ended).tolist()]
            info |= masked({"score": objects(scores)}, ended)
        return info

    def _ended(
        self, observations: Any, rewards: Floats, ended: Flags, info: dict[str, Any]
    ) -> tuple[Any, Floats, Flags, Flags]:
        """What a step returns; with the mode "SameStep", ends that are over have begun anew."""
        never = np.zeros(self.num_envs, dtype=np.bool_)
        if self.autoreset_mode is not AutoresetMode.SAME_STEP or not ended.any():
            return observations, rewards, ended, never
        rows: list[int] = np.flatnonzero(ended).tolist()
        final = np.full(self.num_envs, None, dtype=object)
        for i in rows:
            final[i] = (
                {name: array[i].copy() for name, array in observations.items()}
                if isinstance(observations, dict)
                else observations[i].copy()
            )
        told = {"shots": info["shots"], "reward_parts": unmasked(info["reward_parts"])}
        told |= {name: info[name] for name in ("action_mask",) if name in info}
        final_info = masked({**told, "score": info["score"]}, ended, whole=True)
        for i in rows:
            self._begin(i)
        self._answer(rows)
        going = ~ended
        left = {"shots": objects(self._shots)}
        parts = masked({"reward_parts": told["reward_parts"]}, going, whole=True)
        info.clear()
        info |= {"final_obs": final, "_final_obs": ended.copy()}
        info |= {"final_info": final_info, "_final_info": ended.copy()}
        all_of_them = np.ones(self.num_envs, dtype=np.bool_)
        info |= masked(left, all_of_them) | self._masks(all_of_them)
        if going.any():
            info |= parts
        return self._observe(), rewards, ended, never

    def action_masks(self) -> NDArray[np.int8]:
        """The shots that the agent has in each end, (num_envs, n): 1 or 0; see `CurlingEndEnv`."""
        return np.stack([self._mask(i) for i in range(self.num_envs)])

    def _mask(self, i: int) -> NDArray[np.int8]:
        mask = mask_of(self.single.action, self._view(i))
        if mask is None:
            raise InputError("only shots have a mask: make the environment with actions='shots'")
        return mask

    def _masks(self, among: Flags) -> dict[str, Any]:
        """For `info`: `action_mask`, where actions are shots."""
        if not isinstance(self.single.action, ShotActions):
            return {}
        rows: list[int] = np.flatnonzero(among).tolist()
        return masked({"action_mask": np.stack([self._mask(i) for i in rows])}, among)

    def _calls(self, among: list[int], actions: Sequence[Any]) -> dict[int, Call]:
        """What the agent's actions mean."""
        action = self.single.action
        if not isinstance(action, GameAction):  # shots depend on the position
            return {i: action.call_of(actions[i], self._view(i)) for i in among}
        return dict(zip(among, action.calls_of([actions[i] for i in among]), strict=True))

    def _view(self, i: int) -> PlayerView:
        return self._simulators[i].view(self._states[i], AGENT)

    def _begin(
        self, i: int, asked: Mapping[str, Any] = NOTHING, given: GivenIce = (None, None)
    ) -> None:
        """Begin an end, on its ice, against its opponent."""
        single = self.single
        single.np_random = self._rngs[i]
        self._states[i] = single.begin(asked, given)
        self._simulators[i], self._observations[i] = single.simulator, single.observation
        self._opponents[i] = single.opponent
        self._decisions[i], self._shots[i] = None, ()

    def _answer(self, among: Iterable[int]) -> dict[int, GameRewardParts]:
        """The opponents deliver where it is their turn."""
        total: dict[int, GameRewardParts] = {}
        while True:
            views: dict[int, PlayerView] = {}
            for i in among:
                end = self._states[i].game.end
                if end is not None and end.to_throw is not AGENT:
                    views[i] = self._simulators[i].view(self._states[i])
            if not views:
                return total
            for i, parts in self._play(self._called(views)).items():
                total[i] = total.get(i, NO_REWARD) + parts

    def _called(self, views: dict[int, PlayerView]) -> dict[int, Call]:
        """What each opponent calls."""
        return {i: self._opponents[i].call(view) for i, view in views.items()}

    def _play(self, calls: dict[int, Call]) -> dict[int, GameRewardParts]:
        """Play one delivery in each of some ends: together where they share an ice."""
        parts: dict[int, GameRewardParts] = {}
        alike: dict[int, dict[int, Call]] = {}
        for i, call in calls.items():
            simulator = self._simulators[i]
            if simulator.ice_wears or simulator.ice_evolution.stone_spread:
                parts[i] = self._play_alone(i, call)
            else:
                alike.setdefault(id(simulator), {})[i] = call
        for some in alike.values():
            parts |= self._play_together(some)
        return parts

    def _engine_of(self, simulator: GameSimulator) -> tuple[BatchEngine, Floats]:
        """What plays the ends of a simulator, and the edges of play; made once for each ice."""
        kept = self._engines.get(id(simulator.ice))
        if kept is None or kept[0] is not simulator.ice:
            evolution = simulator.ice_evolution
            ice = ice_for_game(simulator.ice, evolution, 0, sweeping=simulator.sweeping)
            if len(self._engines) > 4 * self.num_envs:
                self._engines.clear()
            kept = (simulator.ice, BatchEngine(ice), play_bounds(simulator.ice, DIRECTION))
            self._engines[id(simulator.ice)] = kept
        return kept[1:]

    def _play_together(self, calls: dict[int, Call]) -> dict[int, GameRewardParts]:
        """Play one delivery in each of some ends on one ice."""
        simulator = self._simulators[next(iter(calls))]
        states = [self._states[i] for i in calls]
        ends = [end for state in states if (end := state.game.end) is not None]
        places, names, identifiers, columns = lying_in(ends)
        thrown = simulator.with_execution_errors(
            [call.throw for call in calls.values()],
            [simulator.skills[end.to_throw] for end in ends],
            states,
        )
        sweeps = sweeps_of(simulator, list(calls.values()), thrown)
        numbers = [(own[-1], s.clock, s.throws) for own, s in zip(identifiers, states, strict=True)]
        releases = release_table_of(np.hstack([thrown, numbers, sweeps]), simulator.delivery)
        engine, bounds = self._engine_of(simulator)
        after = engine.play(places, releases, identity=names, bounds=bounds)
        if (after.collisions < 0).any():
            raise InputError("a stone never stops on this ice; check its friction and slope")
        xy = after.xy - np.array([0.0, TEE_Y])
        last = xy[:, -1].tolist()
        apart = after.xy[:, :-1] != places
        moved = (apart[..., 0] | apart[..., 1]) & ~np.isnan(places[..., 0])
        new: list[dict[int, list[float]]] = [{} for _ in ends]
        for row, c, place in zip(
            *(part.tolist() for part in np.nonzero(moved)), xy[:, :-1][moved].tolist(), strict=True
        ):
            new[row][columns[row].index(c)] = place
        met, radius = after.collisions.tolist(), simulator.lines.stone_radius
        deliveries = Deliveries(thrown, sweeps, after, moved, bounds, radius)
        parts: dict[int, GameRewardParts] = {}
        for row, (i, call) in enumerate(calls.items()):
            state, end = states[row], ends[row]
            result = result_of_places(end, new[row], last[row], bool(met[row]))
            team = end.to_throw
            chosen: list[bool] = []
            game, ruling = deliver(state.game, result, put_back=self._put_back(i, team, chosen))
            parts[i] = reward_parts(state.game, game, team, ruling, AGENT)
            facts = Facts(
                deliveries, row, end, identifiers[row], columns[row], call, ruling, any(chosen)
            )
            self._shots[i] = (*self._shots[i], BatchShot(facts))
            self._states[i] = simulator.after(state, game)
        return parts

    def _play_alone(self, i: int, call: Call) -> GameRewardParts:
        """Play one delivery in one end, on the ice of that end."""
        before = self._states[i]
        self._states[i], shot = self._simulators[i].play(before, call, opponent=self._chooser(i))
        self._shots[i] = (*self._shots[i], shot)
        return reward_parts(before.game, self._states[i].game, shot.team, shot.ruling, AGENT)

    def _chooser(self, i: int) -> Player:
        """The player that decides for the team that is not to throw, as in `CurlingEndEnv`."""
        end, decisions = self._states[i].game.end, self._decisions[i]
        ours = end is not None and end.to_throw is AGENT
        return self._opponents[i] if ours or decisions is None else FollowsDecisions(decisions)

    def _put_back(self, i: int, team: Team, chosen: list[bool]) -> Callable[[Ruling], bool]:
        """The decision after a tick by a team, which is added to `chosen`."""
        simulator, state = self._simulators[i], self._states[i]

        def put_back(ruling: Ruling) -> bool:
            chooser = self._chooser(i)
            chosen.append(chooser.puts_back(simulator.view(state, team.other), ruling))
            return chosen[-1]

        return put_back

    def _observe(self) -> Any:
        alike = self._observations[0]
        if all(observation is alike for observation in self._observations):
            many = alike.observe_many(self._states, AGENT, DIRECTION)
            if many is not None:
                return many
        seen: list[Any] = [
            observed(observation, state)
            for observation, state in zip(self._observations, self._states, strict=True)
        ]
        if not isinstance(seen[0], dict):
            return np.stack(seen)
        return {name: np.stack([one[name] for one in seen]) for name in seen[0]}
