"""Contestants: a player by name, the planner, random actions, a trained model, or a function."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from agents.benchmark.tasks import BenchmarkTask
from agents.learning.policy import TrainedPolicy
from agents.models import LEARNT, load
from agents.planning import plan_throw
from agents.playing.learned.network import ShotNetwork
from agents.playing.learned.player import LearnedPlayer
from agents.playing.policy_player import GamePolicy
from agents.playing.stable_baselines_file import stable_baselines_policy
from agents.playing.trained_player import model_in
from curling_env.envs.game.end_env import AGENT, CurlingEndEnv
from curling_env.envs.game.opponents import Policy
from curling_env.envs.sheet.env import CurlingSheetEnv
from curling_env.errors import InputError
from curling_env.game import Player, player_named
from curling_env.game.players import player_names
from curling_env.infrastructure.plugins import load_plugin
from curling_env.sheet import to_sheet

Contestant = Callable[[Any, Any], Any]
"""Function from the environment (unwrapped) and its observation to the action."""


def contestant(given: Any) -> Contestant:
    """Return the contestant of a name, file or object.

    Parameters
    ----------
    given : ``random``, ``constant`` (the best action that is always the same), ``planner`` (throws
        only), ``learned`` (the trained models of the package), the name of a player (ends only),
        the file of a trained model (``.npz``, or ``.zip`` of stable-baselines3), ``module:object``;
        or a `Player`, a function of observations, or something with `predict`

    Raises
    ------
    InputError : something else
    """
    own = {"random": _random, "constant": _constant, "planner": _planned}
    if isinstance(given, str) and given in own:
        return own[given]
    if given == "learned":
        return _learned()
    if isinstance(given, str) and given.partition(":")[0] in player_names():
        given = player_named(given)
    suffix = Path(given).suffix if isinstance(given, str | Path) else ""
    if suffix == ".npz":
        given = model_in(given)
    elif suffix == ".zip":
        given = stable_baselines_policy(given)
    elif isinstance(given, str):
        given = load_plugin("policy", "curling.policies", given, built_in=_names())
        given = given() if isinstance(given, type) else given
    if isinstance(given, ShotNetwork):
        given = LearnedPlayer(given)
    if isinstance(given, Player):
        return _player(given)
    if isinstance(given, TrainedPolicy):
        return _trained(given)
    if not (callable(given) or hasattr(given, "predict")):
        raise InputError(
            f"a policy must be one of {', '.join(_names())}, a model's file (.npz, .zip), "
            f"module:object, or a function of observations, got {str(given)[:60]!r}"
        )
    return _policy(given)


def can_do(given: str, task: BenchmarkTask) -> bool:
    """Return whether a contestant supports a task; third-party contestants are assumed to."""
    ends, asked = task.metric == "points", task.options.get("task", "draw")
    if given == "planner":
        return not ends
    if given == "learned":
        return ends or asked in LEARNT
    if Path(given).suffix == ".npz":
        model = model_in(given)
        if isinstance(model, Player):
            return ends
        return not ends and model.settings.env_kwargs.get("task", "draw") == asked
    return ends or given.partition(":")[0] not in player_names()


def _names() -> list[str]:
    return ["random", "constant", "planner", *player_names()]


def _random(env: Any, observation: Any) -> Any:
    # From the environment's own generator, so that the action follows from the episode's seed.
    return env.np_random.uniform(-1.0, 1.0, env.action_space.shape).astype(np.float32)


CONSTANTS = {
    "draw": (0.371, -0.492, 0.813),
    "guard": (-0.524, -0.384, 0.61),
    "takeout": (0.621, -0.126, 0.441),
    "hit_and_stay": (-0.231, 0.216, -0.487),
    "freeze": (-0.096, 0.188, 0.07),
    "ends": (-0.689, 0.448, -0.703),
}
"""The best constant action, for each task of single throws and for ends, from `scripts/baselines.py
constants`."""


def _constant(env: Any, observation: Any) -> Any:
    task = "ends" if isinstance(env, CurlingEndEnv) else env.task.name
    return np.array(CONSTANTS[task], dtype=np.float32)


def _planned(env: Any, observation: Any) -> Any:
    if not isinstance(env, CurlingSheetEnv):
        raise InputError("the planner plans single throws; in ends a player decides")
    known, stones = env.known_ice, env.places
    wanted: dict[str, Any] = {"skill": env.skill, "delivery": env.delivery}
    if env.task.name == "draw":
        found = plan_throw(known, to_sheet(env.target, env.direction), stones=stones, **wanted)
    else:
        mark = stones[0] if env.task.has_target_stone else to_sheet(env.target, env.direction)
        found = plan_throw(known, env.task, mark, stones=stones, **wanted)
    return env.action_of(found.best.throw)


def _policy(given: Any) -> Contestant:
    """Return a policy as a contestant; in ends with masks and memory, as in games."""
    policy, player = Policy(given), _player(GamePolicy(given))

    def act(env: Any, observation: Any) -> Any:
        if isinstance(env, CurlingEndEnv):
            return player(env, observation)
        return policy.act(observation)[0]

    return act


def _player(player: Player) -> Contestant:
    def call(env: Any, observation: Any) -> Any:
        if not isinstance(env, CurlingEndEnv):
            raise InputError(f"the player {player.name!r} plays ends, not single throws")
        return env.action_of(player.call(env.simulator.view(env.state, AGENT)))

    return call


def _trained(policy: TrainedPolicy) -> Contestant:
    """Return a trained policy of throws; its range of throws may differ from the task's."""

    def throw(env: Any, observation: Any) -> Any:
        if not isinstance(env, CurlingSheetEnv):
            raise InputError("this model throws single stones; in ends a player decides")
        action, _ = policy.predict(observation)
        return env.action_of(policy.throw_range.throw_of(action))

    return throw


def _learned() -> Contestant:
    """Return the package's own models, each for its task."""
    ready: dict[str, Contestant] = {}

    def call(env: Any, observation: Any) -> Any:
        task = "ends" if isinstance(env, CurlingEndEnv) else env.task.name
        if task not in LEARNT:
            raise InputError(f"no model for the task {task}; expected one of {', '.join(LEARNT)}")
        if task not in ready:
            ready[task] = contestant(load(task))
        return ready[task](env, observation)

    return call
