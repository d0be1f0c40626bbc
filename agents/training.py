"""Learning to throw: stable-baselines3 on `CurlingSheet-v0`, measured beside the planner."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, fields
from math import gcd
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

import curling_env  # noqa: F401  (registers the environments)
from agents.evaluate import Policy, house_targets, misses, planner_throws, policy_throws
from agents.models import read_model, write_model
from curling_env.errors import InputError
from curling_env.ice import Ice, load_ice
from curling_env.sheet import Direction, tee
from curling_env.skill import Skill, skill_named
from curling_env.storage import make_directory, write_json
from curling_env.throw import Throw

ALGORITHMS = ("sac", "td3", "ppo")
TARGETS = ("house", "button")
"""Where the agent learns to draw to: anywhere in the house, or the button alone."""
SIDE_BY_SIDE = 32
"""Most sheets that PPO throws on at once."""
Tell = Callable[[int, float], None]
"""Called with the steps taken so far and the mean reward of the last hundred throws."""


@dataclass(frozen=True, kw_only=True)
class TrainingSettings:
    """What is learnt, and how.

    Parameters
    ----------
    algorithm : ``sac``, ``td3`` or ``ppo``; an episode is one throw, for which SAC learns fastest
    steps : throws in all
    target : one of `TARGETS`
    skill : of the hand that carries out what the agent means, while it learns and when it is judged
    network : units of the hidden layers
    learning_rate : of the optimiser
    batch_size : throws in one gradient step
    seed : of all randomness
    checkpoint_every : throws between checkpoints; 0 for none

    Raises
    ------
    InputError : a setting that makes no sense
    """

    algorithm: str = "sac"
    steps: int = 20_000
    target: str = "house"
    skill: str = "club"
    network: tuple[int, ...] = (128, 128)
    learning_rate: float = 1e-3
    batch_size: int = 256
    seed: int = 0
    checkpoint_every: int = 5_000

    def __post_init__(self) -> None:
        for name, choices in (("algorithm", ALGORITHMS), ("target", TARGETS)):
            if getattr(self, name) not in choices:
                raise InputError(
                    f"{name} must be one of {', '.join(choices)}, got {getattr(self, name)!r}"
                )
        skill_named(self.skill)
        for name, least in (("steps", 1), ("batch_size", 2), ("seed", 0), ("checkpoint_every", 0)):
            if getattr(self, name) < least:
                raise InputError(f"{name} must be at least {least}, got {getattr(self, name)}")
        if not 0 < self.learning_rate < 1:
            raise InputError(f"learning_rate must lie within 0 and 1, got {self.learning_rate}")
        if not self.network or min(self.network) < 1:
            raise InputError(f"network must name layers of one unit or more, got {self.network}")


class UnsteadyHand(gymnasium.ActionWrapper[NDArray[np.float32], Any, Any]):
    """An environment whose throws are carried out with a player's execution error."""

    def __init__(self, env: gymnasium.Env[Any, Any], skill: Skill) -> None:
        super().__init__(env)
        self._skill = skill

    def action(self, action: NDArray[np.float32]) -> NDArray[np.float32]:
        """The action that was carried out instead."""
        base: Any = self.env.unwrapped
        meant: Throw = base.throw_of(action)
        error = self._skill.errors(1, self.np_random)[0]
        made = Throw(
            speed=max(meant.speed + error[0], 1e-3),
            angle=meant.angle + error[1],
            spin=meant.spin + error[2],
            x=meant.x,
        )
        return base.action_of(made)


def make_env(ice: Ice, settings: TrainingSettings) -> gymnasium.Env[Any, Any]:
    """The environment that is learnt in."""
    env = gymnasium.make("CurlingSheet-v0", ice=ice, target=_target(settings))
    return UnsteadyHand(env, skill_named(settings.skill))


def _env_to_learn_in(ice: Ice, settings: TrainingSettings) -> Any:
    """The same environment as stable-baselines3 takes it; sheets side by side where that helps.

    PPO throws hundreds of stones between two updates and spends its time in throwing them; SAC and
    TD3 learn after every throw, and spend theirs there.
    """
    from stable_baselines3.common.monitor import Monitor

    if settings.algorithm != "ppo":
        return Monitor(make_env(ice, settings))
    from agents.vectorised import Sheets

    envs = gymnasium.make_vec(
        "CurlingSheet-v0",
        num_envs=gcd(_ppo_throws(settings), SIDE_BY_SIDE),
        ice=ice,
        target=_target(settings),
        autoreset_mode="SameStep",
    )
    return Sheets(envs, settings.skill)


def _target(settings: TrainingSettings) -> Any:
    return "random" if settings.target == "house" else (0.0, 0.0)


def _ppo_throws(settings: TrainingSettings) -> int:
    """Throws between two updates of PPO: whole batches."""
    return max(settings.batch_size, 512 // settings.batch_size * settings.batch_size)


def train(
    ice: str | Path | Ice,
    directory: str | Path,
    settings: TrainingSettings,
    *,
    resume: str | Path | None = None,
    tell: Tell = lambda steps, reward: None,
) -> Policy:
    """Train an agent, with checkpoints, and leave `model.npz` in a folder.

    Parameters
    ----------
    ice : file, preset or ice to learn on
    directory : made if it is not there
    resume : checkpoint to go on from; its algorithm and network are kept
    tell : of the progress, after every throw

    Returns
    -------
    the trained policy

    Raises
    ------
    InputError : a checkpoint that is none, or of another environment
    OutputError : a file cannot be written
    """
    import torch
    from stable_baselines3.common.callbacks import BaseCallback

    torch.set_num_threads(1)  # these networks are too small to share
    folder = make_directory(directory)
    env = _env_to_learn_in(load_ice(ice), settings)
    model = _new_model(env, settings)
    if resume is not None:
        _restore(model, resume, settings)

    class Watch(BaseCallback):
        """Tells of the progress and keeps checkpoints."""

        kept_at = model.num_timesteps

        def _on_step(self) -> bool:
            steps = self.num_timesteps
            episodes: Any = self.model.ep_info_buffer or []
            tell(steps, float(np.mean([e["r"] for e in episodes])) if episodes else float("nan"))
            return True

        def _on_rollout_end(self) -> None:
            # Only now is the last throw in the memory; a step's callback comes too early.
            steps, every = self.num_timesteps, settings.checkpoint_every
            if every and steps // every > self.kept_at // every:
                save(folder / f"checkpoint-{steps:07d}.npz", model, settings, whole=True)
                self.kept_at = steps

    left = settings.steps - model.num_timesteps
    if left > 0:
        model.learn(left, callback=Watch(), reset_num_timesteps=False)
    save(folder / "model.npz", model, settings)
    env.close()
    return model.policy


def evaluate(
    policy: Policy,
    ice: str | Path | Ice,
    settings: TrainingSettings,
    *,
    targets: int = 50,
    through: Callable[..., Any] = lambda items, label: items,
) -> dict[str, Any]:
    """Judge an agent beside the planner: same targets, same execution errors.

    Returns
    -------
    misses of both in metres, and the ratio of the mean misses with execution error
    """
    ice = load_ice(ice)
    skill = skill_named(settings.skill)
    seed = settings.seed + 1_000_003  # not the throws it learnt from
    places = np.repeat(tee(Direction.AWAY)[None], 1, axis=0)
    if settings.target == "house":
        places = house_targets(targets, np.random.default_rng(seed))
    env = make_env(ice, settings)
    agent = misses(ice, policy_throws(policy, env, places), places, skill, seed=seed)
    env.close()
    planned = planner_throws(ice, places, skill, through)
    planner = misses(ice, planned, places, skill, seed=seed)
    return {
        "targets": len(places),
        "skill": settings.skill,
        "agent": agent.as_dict(),
        "planner": planner.as_dict(),
        "agent_over_planner_with_error": float(agent.with_error.mean() / planner.with_error.mean()),
    }


def write_evaluation(directory: str | Path, result: dict[str, Any]) -> None:
    """`evaluation.json` in a folder."""
    write_json(Path(directory) / "evaluation.json", result)


# --- models --------------------------------------------------------------------------------------


def _new_model(env: Any, settings: TrainingSettings) -> Any:
    import stable_baselines3 as sb3
    from stable_baselines3.common.noise import NormalActionNoise

    shared: dict[str, Any] = {
        "policy": "MlpPolicy",
        "env": env,
        "learning_rate": settings.learning_rate,
        "batch_size": settings.batch_size,
        "policy_kwargs": {"net_arch": list(settings.network)},
        "seed": settings.seed,
        "device": "cpu",
    }
    if settings.algorithm == "ppo":
        return sb3.PPO(**shared, n_steps=_ppo_throws(settings) // env.num_envs)
    off_policy: dict[str, Any] = {
        **shared,
        "learning_starts": min(500, max(settings.steps // 10, 1)),
        "buffer_size": min(settings.steps, 200_000),
    }
    if settings.algorithm == "td3":
        noise = NormalActionNoise(np.zeros(3), 0.1 * np.ones(3))
        return sb3.TD3(**off_policy, action_noise=noise)
    return sb3.SAC(**off_policy)


def save(path: str | Path, model: Any, settings: TrainingSettings, *, whole: bool = False) -> None:
    """Write a model: its settings and weights, and with `whole` all that going on needs.

    Raises
    ------
    OutputError : the file cannot be written
    """
    space = model.observation_space
    document: dict[str, Any] = {
        "settings": {**asdict(settings), "network": list(settings.network)},
        "observation_size": int(space.shape[0]),
        "steps_done": int(model.num_timesteps),
        "policy": model.policy.state_dict(),
    }
    if whole:
        names, variables = model._get_torch_save_params()
        parameters = model.get_parameters()
        document["optimisers"] = {name: parameters[name] for name in names if name != "policy"}
        document["variables"] = {name: getattr(model, name) for name in variables}
        if settings.algorithm != "ppo":
            document["replay"] = _replay_of(model.replay_buffer)
    write_model(path, document)


_REPLAY = ("observations", "next_observations", "actions", "rewards", "dones", "timeouts")


def _replay_of(buffer: Any) -> dict[str, Any]:
    filled = buffer.buffer_size if buffer.full else buffer.pos
    return {name: getattr(buffer, name)[:filled] for name in _REPLAY} | {"pos": int(buffer.pos)}


def _restore(model: Any, path: str | Path, settings: TrainingSettings) -> None:
    """Take up a checkpoint where it was left."""
    document = read_model(path)
    try:
        saved = settings_of(document, path)
        for name in ("algorithm", "network"):
            if getattr(saved, name) != getattr(settings, name):
                raise InputError(
                    f"was trained with {name} {getattr(saved, name)!r}, "
                    f"not {getattr(settings, name)!r}",
                    source=path,
                )
        if "optimisers" not in document:
            raise InputError("is a finished model; resume from a checkpoint", source=path)
        model.set_parameters({"policy": _tensors(document["policy"]),
                              **_tensors(document["optimisers"])}, device="cpu")  # fmt: skip
        for name, value in document["variables"].items():
            getattr(model, name).data = _tensors(value)
        model.num_timesteps = int(document["steps_done"])
        replay = document.get("replay")
        if replay is not None:
            buffer, filled = model.replay_buffer, len(replay["rewards"])
            if filled > buffer.buffer_size:
                raise InputError("holds more throws than this run asks for", source=path)
            for name in _REPLAY:
                getattr(buffer, name)[:filled] = replay[name]
            buffer.pos = int(replay["pos"]) if filled == buffer.buffer_size else filled
            buffer.full = filled == buffer.buffer_size
            buffer.pos %= buffer.buffer_size
    except (KeyError, TypeError, ValueError, RuntimeError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError("is not a checkpoint that fits this environment", source=path) from error
    model.set_random_seed(settings.seed + model.num_timesteps)  # not the same errors again


def _tensors(value: Any) -> Any:
    """Arrays of a nested document as tensors."""
    import torch

    if isinstance(value, np.ndarray):
        return torch.from_numpy(value.copy())
    if isinstance(value, dict):
        return {key: _tensors(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_tensors(item) for item in value]
    return value


def settings_of(document: dict[str, Any], source: str | Path) -> TrainingSettings:
    """The settings a model was trained with.

    Raises
    ------
    InputError : they are missing or make no sense
    """
    given = document.get("settings")
    known = {field.name for field in fields(TrainingSettings)}
    if not isinstance(given, dict) or not given.keys() <= known:
        raise InputError("is not a trained model of this project", source=source)
    try:
        return TrainingSettings(**{**given, "network": tuple(given["network"])})
    except InputError as error:
        raise InputError(error.problem, source=source) from error


def load_policy(path: str | Path) -> tuple[Policy, TrainingSettings]:
    """A trained policy from its file; nothing in the file is executed.

    Raises
    ------
    InputError : no such file, or not a trained model of this project
    """
    from gymnasium import spaces
    from stable_baselines3.ppo.policies import MlpPolicy as PpoPolicy
    from stable_baselines3.sac.policies import MlpPolicy as SacPolicy
    from stable_baselines3.td3.policies import MlpPolicy as Td3Policy

    document = read_model(path)
    settings = settings_of(document, path)
    kinds: dict[str, Any] = {"sac": SacPolicy, "td3": Td3Policy, "ppo": PpoPolicy}
    try:
        policy = kinds[settings.algorithm](
            spaces.Box(-1.0, 1.0, (int(document["observation_size"]),), dtype=np.float32),
            spaces.Box(-1.0, 1.0, (3,), dtype=np.float32),
            lambda _: settings.learning_rate,
            net_arch=list(settings.network),
        )
        policy.load_state_dict(_tensors(document["policy"]))
    except (KeyError, TypeError, ValueError, RuntimeError) as error:
        raise InputError("holds weights that do not fit its settings", source=path) from error
    policy.set_training_mode(False)
    return policy, settings
