"""Learning to throw: stable-baselines3 on `CurlingSheet-v0`, and runs that can be taken up again.

A run is made of stretches, each between two checkpoints. Every stretch begins with new episodes and
with randomness that goes by the run's seed and the throws made so far. So a checkpoint needs no
state of any generator or of any sheet, and a run that was killed and taken up again ends, to the
last bit, as one that was not.
"""

from __future__ import annotations

import hashlib
import importlib.util
from collections.abc import Callable
from math import gcd
from pathlib import Path
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode

from agents.learning.configuration import (
    TrainingSettings,
    schedule_of,
    settings_from,
    with_settings,
)
from agents.learning.model_file import read_model, write_model
from agents.learning.policy import Thrower, tensors, throw_range_of
from curling_env.envs.sheet.vector_env import CurlingSheetVectorEnv
from curling_env.errors import InputError
from curling_env.ice import Ice, load_ice
from curling_env.storage import make_directory

SHEETS_ON_ONE = 32
"""Sheets that share an ice, where there are many ices."""
SIZING = 2048
"""Observations from which their centre and spread are taken."""
EVALUATED = 256
"""Throws of an evaluation while it learns."""
Tell = Callable[[int, float], None]
"""Called with the steps taken so far and the mean reward of the last hundred throws."""


def sheets_of(settings: TrainingSettings, ice: Ice, *, num_envs: int | None = None) -> Any:
    """The sheets that are learnt on, as stable-baselines3 takes them.

    Parameters
    ----------
    ice : thrown on, where the settings have no random ices
    num_envs : the settings' own by default
    """
    from agents.learning.vector_env import Sheets, SheetsOnManyIces

    n = settings.n_envs if num_envs is None else num_envs
    hand = settings.practice or settings.skill
    options = {**settings.environment(), "throw_range": throw_range_of(settings, ice)}
    if settings.ices is None:
        envs = CurlingSheetVectorEnv(n, ice=ice, autoreset_mode=AutoresetMode.SAME_STEP, **options)
        return Sheets(envs, hand)
    return SheetsOnManyIces(
        n,
        ices=settings.ices,
        knows=settings.knows,
        skill=hand,
        groups=n // gcd(n, SHEETS_ON_ONE),
        **options,
    )


def train(
    directory: str | Path,
    settings: TrainingSettings,
    ice: str | Path | Ice = "standard",
    *,
    resume: str | Path | None = None,
    tell: Tell = lambda steps, reward: None,
) -> Thrower:
    """Train an agent, with checkpoints, and leave `model.npz` in a folder.

    Parameters
    ----------
    directory : made if it is not there
    ice : file, preset or ice to learn on, where the settings have no random ices
    resume : checkpoint to go on from, of a run with the same settings; more throws may be asked for
    tell : of the progress, after every step

    Returns
    -------
    the trained policy

    Raises
    ------
    InputError : a checkpoint that is none, or of another run
    OutputError : a file cannot be written
    """
    import torch
    from stable_baselines3.common.callbacks import BaseCallback, EvalCallback

    torch.set_num_threads(1)  # these networks are too small to share
    known = load_ice(settings.ices.base if settings.ices else ice)
    begun = None if resume is None else read_model(resume)
    if begun is not None:
        _check_is_of(begun, settings, known, resume)
    folder = make_directory(directory)
    env = sheets_of(settings, known)
    model = new_model(env, settings)
    if begun is not None:
        _restore(model, begun, resume)
    _keep_logs(model, folder)

    class Stretches(BaseCallback):
        """Begins each stretch, keeps its checkpoint and tells of the progress."""

        stretch = -1

        def _on_rollout_start(self) -> None:
            steps, every = model.num_timesteps, settings.checkpoint_every
            stretch = steps // every if every else 0
            if stretch == self.stretch:
                return
            if stretch and self.stretch >= 0:
                save_checkpoint(folder / f"checkpoint-{steps:08d}.npz", model, settings, known)
            self.stretch = stretch
            lot = np.random.SeedSequence((settings.seed, steps)).generate_state(1)
            model.set_random_seed(int(lot[0] >> 1))
            model._last_obs = env.reset()

        def _on_step(self) -> bool:
            episodes: Any = self.model.ep_info_buffer or []
            reward = float(np.mean([e["r"] for e in episodes])) if episodes else float("nan")
            tell(self.num_timesteps, reward)
            return True

    callbacks: list[BaseCallback] = [Stretches()]
    if settings.eval_freq:
        judge = sheets_of(settings, known, num_envs=EVALUATED)
        judge.seed(settings.seed + 1_000_003)
        callbacks.append(
            EvalCallback(
                judge,
                n_eval_episodes=EVALUATED,
                eval_freq=max(settings.eval_freq // settings.n_envs, 1),
                verbose=0,
            )
        )
    left = settings.n_timesteps - model.num_timesteps
    if left > 0:
        model.learn(left, callback=callbacks, reset_num_timesteps=False, log_interval=8)
    model.logger.close()
    save_model(folder / "model.npz", model, settings, known)
    env.close()
    return Thrower.load(folder / "model.npz")


def latest_checkpoint(folder: str | Path) -> Path:
    """The last checkpoint that a run left in its folder.

    Raises
    ------
    InputError : there is none
    """
    kept = sorted(Path(folder).glob("checkpoint-*.npz"))
    if not kept:
        raise InputError("holds no checkpoint", source=folder)
    return kept[-1]


def settings_of_run(checkpoint: str | Path) -> TrainingSettings:
    """The settings of the run that a checkpoint or model is of.

    Raises
    ------
    InputError : no such file, or not of this project
    """
    document = read_model(checkpoint)
    try:
        return settings_from(document["settings"])
    except (InputError, KeyError) as error:
        raise InputError("is not a trained model of this project", source=checkpoint) from error


def has_tensorboard() -> bool:
    """Whether the logs can be written for TensorBoard too."""
    return importlib.util.find_spec("tensorboard") is not None


# --- the parts ------------------------------------------------------------------------------------


def new_model(env: Any, settings: TrainingSettings) -> Any:
    """An untrained model of stable-baselines3.

    Raises
    ------
    InputError : hyperparameters that the algorithm refuses
    """
    import stable_baselines3 as sb3
    from stable_baselines3.common.noise import NormalActionNoise

    from agents.learning.policy import policy_kwargs_of

    centre = spread = None
    if settings.normalize:
        centre, spread = _spread_of_observations(env, settings.seed)
    given: dict[str, Any] = {
        name: schedule_of(value) for name, value in settings.hyperparameters.items()
    }
    if settings.algorithm != "ppo":
        given.setdefault("buffer_size", min(settings.n_timesteps, 200_000))
        given.setdefault("learning_starts", min(500, max(settings.n_timesteps // 10, 1)))
    if isinstance(given.get("train_freq"), list):
        given["train_freq"] = tuple(given["train_freq"])
    if settings.algorithm == "td3":
        size = env.action_space.shape
        given["action_noise"] = NormalActionNoise(np.zeros(size), settings.noise * np.ones(size))
    try:
        return getattr(sb3, settings.algorithm.upper())(
            settings.policy,
            env,
            policy_kwargs=policy_kwargs_of(settings, centre, spread),
            seed=settings.seed,
            device="cpu",
            **given,
        )
    except (TypeError, ValueError, AssertionError) as error:
        raise InputError(f"{settings.algorithm} refuses its hyperparameters: {error}") from error


def _spread_of_observations(env: Any, seed: int) -> tuple[Any, Any]:
    env.seed(seed)
    seen = [env.reset() for _ in range(-(-SIZING // env.num_envs))]
    every = np.concatenate(seen)
    return every.mean(axis=0), every.std(axis=0)


def _keep_logs(model: Any, folder: Path) -> None:
    from stable_baselines3.common.logger import configure

    kinds = ["csv", "tensorboard"] if has_tensorboard() else ["csv"]
    logs = make_directory(folder / "logs" / f"from-{model.num_timesteps:08d}")
    model.set_logger(configure(str(logs), kinds))


# --- files ----------------------------------------------------------------------------------------

_REPLAY = ("observations", "next_observations", "actions", "rewards", "dones", "timeouts")
_COUNTERS = ("_n_updates", "_episode_num")


def save_model(path: str | Path, model: Any, settings: TrainingSettings, ice: Ice) -> None:
    """Write what throwing needs: the settings and the policy's weights.

    Raises
    ------
    OutputError : the file cannot be written
    """
    write_model(path, _document(model, settings, ice))


def save_checkpoint(path: str | Path, model: Any, settings: TrainingSettings, ice: Ice) -> None:
    """Write all that going on needs.

    Raises
    ------
    OutputError : the file cannot be written
    """
    names, variables = model._get_torch_save_params()
    parameters = model.get_parameters()
    document = _document(model, settings, ice)
    document["optimisers"] = {name: parameters[name] for name in names if name != "policy"}
    document["variables"] = {name: getattr(model, name) for name in variables}
    document["counters"] = {name: int(getattr(model, name)) for name in _COUNTERS}
    if settings.algorithm != "ppo":
        buffer = model.replay_buffer
        filled = buffer.buffer_size if buffer.full else buffer.pos
        document["replay"] = {name: getattr(buffer, name)[:filled] for name in _REPLAY}
        document["replay"]["pos"] = int(buffer.pos)
    write_model(path, document)


def _document(model: Any, settings: TrainingSettings, ice: Ice) -> dict[str, Any]:
    throws = throw_range_of(settings, ice)
    return {
        "settings": settings.as_dict(),
        "ice": _digest(ice),
        "throws": {"speed": throws.speed, "angle": throws.angle, "spin": throws.spin},
        "observation_size": int(model.observation_space.shape[0]),
        "steps_done": int(model.num_timesteps),
        "policy": model.policy.state_dict(),
    }


def _digest(ice: Ice) -> str:
    """Tells ices apart."""
    effects = [(e.name, sorted(e.parameters.items())) for e in ice.effects]
    text = repr((ice.sheet, ice.stone, ice.friction.interpolation, effects)).encode()
    return hashlib.sha256(text + ice.friction.mu.tobytes()).hexdigest()[:16]


_MAY_DIFFER = {"n_timesteps": 0, "eval_freq": 0}
"""Settings that a run may be taken up with others of."""


def _check_is_of(document: dict[str, Any], settings: TrainingSettings, ice: Ice, path: Any) -> None:
    if "optimisers" not in document:
        raise InputError("is a finished model; resume from a checkpoint", source=path)
    saved, asked = settings_of_run(path).as_dict(), settings.as_dict()
    for name in sorted(saved.keys() | asked.keys()):
        if name not in _MAY_DIFFER and saved.get(name) != asked.get(name):
            raise InputError(
                f"was trained with {name} {saved.get(name)!r}, not {asked.get(name)!r}", source=path
            )
    if document.get("ice") != _digest(ice):
        raise InputError("was trained on another ice", source=path)


def _restore(model: Any, document: dict[str, Any], path: Any) -> None:
    """Take up a checkpoint where it was left."""
    try:
        model.set_parameters({"policy": tensors(document["policy"]),
                              **tensors(document["optimisers"])}, device="cpu")  # fmt: skip
        for name, value in document["variables"].items():
            getattr(model, name).data = tensors(value)
        model.num_timesteps = int(document["steps_done"])
        for name in _COUNTERS:
            setattr(model, name, int(document["counters"][name]))
        replay = document.get("replay")
        if replay is not None:
            buffer, filled = model.replay_buffer, len(replay["rewards"])
            if filled > buffer.buffer_size:
                raise InputError("holds more throws than this run remembers", source=path)
            for name in _REPLAY:
                getattr(buffer, name)[:filled] = replay[name]
            buffer.full = filled == buffer.buffer_size
            buffer.pos = int(replay["pos"])
    except (KeyError, TypeError, ValueError, RuntimeError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError("is not a checkpoint that fits this environment", source=path) from error


__all__ = [
    "TrainingSettings",
    "latest_checkpoint",
    "save_checkpoint",
    "save_model",
    "settings_of_run",
    "sheets_of",
    "train",
    "with_settings",
]
