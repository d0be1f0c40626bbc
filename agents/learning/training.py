"""Training with stable-baselines3 on `CurlingSheet-v0`, in runs that can be resumed.

A run consists of stretches between checkpoints. Every stretch begins with new episodes, and its
randomness follows from the run's seed and the number of throws before it. So a checkpoint needs no
state of a generator or an environment, and a resumed run gives the same result as an uninterrupted
one, bit for bit.
"""

from __future__ import annotations

import hashlib
import importlib.util
import shutil
from collections.abc import Generator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode

from agents.learning.configuration import (
    TrainingSettings,
    load_settings,
    schedule_of,
    settings_from,
    with_settings,
)
from agents.learning.model_file import check_finite, read_model, write_model
from agents.learning.policy import TrainedPolicy, tensors, throw_range_of
from curling_env.envs.sheet.vector_env import CurlingSheetVectorEnv
from curling_env.errors import CurlingError, InputError
from curling_env.ice import Ice, load_ice
from curling_env.infrastructure.files.writing import keep, make_directory
from curling_env.typing import Progress, no_progress

INFO_KEYS = ("distance_m", "status", "success")
"""Keys of an environment's `info` that are passed on."""
NORMALISER_SAMPLES = 2048
"""Number of observations for the normaliser's mean and standard deviation."""
EVALUATION_THROWS = 256
"""Number of throws of an evaluation during training."""


def make_vec_env(settings: TrainingSettings, ice: Ice, *, num_envs: int | None = None) -> Any:
    """Make the vectorised environment of a run for stable-baselines3.

    Parameters
    ----------
    settings : settings of the run
    ice : ice to learn on, if the settings have no random ices
    num_envs : number of environments; by default that of the settings
    """
    from curling_env.envs.stable_baselines import CurlingVecEnv

    options = settings.environment()
    options |= {"throw_range": throw_range_of(settings, ice)}
    options |= {"skill": settings.practice or settings.skill}
    if settings.ices is None:
        options["ice"] = ice
    else:
        options["ices"] = replace(settings.ices, knows=settings.knows)
    envs = CurlingSheetVectorEnv(
        settings.n_envs if num_envs is None else num_envs,
        autoreset_mode=AutoresetMode.SAME_STEP,
        **options,
    )
    return CurlingVecEnv(envs, info_keywords=INFO_KEYS)


def train(
    config: str | Path | TrainingSettings,
    output: str | Path,
    ice: str | Path | Ice = "standard",
    *,
    resume: str | Path | None = None,
    progress: Progress = no_progress,
) -> TrainedPolicy:
    """Train a policy, with checkpoints, and leave `model.npz` in a folder.

    Parameters
    ----------
    config : settings of the run, a YAML file, or one of `configuration.configurations`
    output : folder for the files; made if missing
    ice : file, preset or ice to learn on, if the settings have no random ices
    resume : checkpoint of a run with the same settings, or with fewer throws, to continue from
    progress : called after every step with the number of throws

    Returns
    -------
    the trained policy

    Raises
    ------
    InputError : unknown settings, a file that is not a checkpoint, or a checkpoint of another run
    OutputError : a file cannot be written
    """
    import torch
    from stable_baselines3.common.callbacks import BaseCallback, EvalCallback

    settings = config if isinstance(config, TrainingSettings) else load_settings(config)
    torch.set_num_threads(1)  # these networks are too small for several threads
    known = load_ice(settings.ices.base if settings.ices else ice)
    begun = None if resume is None else read_model(resume)
    if begun is not None and resume is not None:
        check_finite(begun, resume)
        _check_is_of(begun, settings, known, resume)
    folder = make_directory(output)
    with _faults_of("the environment and the algorithm"):
        env = make_vec_env(settings, known)
        model = new_model(env, settings)
    if begun is not None:
        _restore(model, begun, resume)
    logs = folder / "logs" / f"from-{model.num_timesteps:08d}"
    earlier_logs = logs.exists()
    _keep_logs(model, logs)

    class Stretches(BaseCallback):
        """Callback that begins each stretch, writes its checkpoint and reports the progress."""

        stretch = -1

        def _on_rollout_start(self) -> None:
            steps, every = model.num_timesteps, settings.checkpoint_every
            stretch = steps // every if every else 0
            if stretch == self.stretch:
                return
            if stretch and self.stretch >= 0:
                save_checkpoint(folder / f"checkpoint-{steps:08d}.npz", model, settings, known)
                keep(f"{steps} throws are done; to continue: --resume {folder} -o {folder}")
            self.stretch = stretch
            state = np.random.SeedSequence((settings.seed, steps)).generate_state(1)
            model.set_random_seed(int(state[0] >> 1))
            model._last_obs = env.reset()

        def _on_step(self) -> bool:
            episodes: Any = self.model.ep_info_buffer or []
            reward = float(np.mean([e["r"] for e in episodes])) if episodes else float("nan")
            progress(step_name(reward), self.num_timesteps, settings.n_timesteps)
            return True

    callbacks: list[BaseCallback] = [Stretches()]
    if settings.eval_freq:
        test_env = make_vec_env(settings, known, num_envs=EVALUATION_THROWS)
        test_env.seed(settings.seed + 1_000_003)
        callbacks.append(
            EvalCallback(
                test_env,
                n_eval_episodes=EVALUATION_THROWS,
                eval_freq=max(settings.eval_freq // settings.n_envs, 1),
                verbose=0,
            )
        )
    left = settings.n_timesteps - model.num_timesteps
    try:
        with _faults_of("learning"):
            if left > 0:
                model.learn(left, callback=callbacks, reset_num_timesteps=False, log_interval=8)
                _check_finite(model)
    except CurlingError:
        model.logger.close()
        if not earlier_logs:
            shutil.rmtree(logs, ignore_errors=True)  # they have no information
        raise
    model.logger.close()
    save_model(folder / "model.npz", model, settings, known)
    env.close()
    return TrainedPolicy.load(folder / "model.npz")


def step_name(reward: float) -> str:
    """Return the text of the progress bar during learning."""
    return "learning" if np.isnan(reward) else f"learning, mean reward {reward:.2f}"


def latest_checkpoint(folder: str | Path) -> Path:
    """Return the last checkpoint in the folder of a run.

    Raises
    ------
    InputError : a folder without a checkpoint
    """
    kept = sorted(Path(folder).glob("checkpoint-*.npz"))
    if not kept:
        raise InputError("contains no checkpoint", source=folder)
    return kept[-1]


def settings_of_run(checkpoint: str | Path) -> TrainingSettings:
    """Return the settings of the run that wrote a checkpoint or model.

    Raises
    ------
    InputError : the file does not exist, or is not from this project
    """
    document = read_model(checkpoint)
    try:
        return settings_from(document["settings"])
    except (InputError, KeyError) as error:
        raise InputError("is not a trained model of this project", source=checkpoint) from error


def has_tensorboard() -> bool:
    """Return whether logs can also be written for TensorBoard."""
    return importlib.util.find_spec("tensorboard") is not None


# --- the model ------------------------------------------------------------------------------------


def new_model(env: Any, settings: TrainingSettings) -> Any:
    """Make an untrained model of stable-baselines3.

    Raises
    ------
    InputError : the algorithm refuses its hyperparameters
    """
    import stable_baselines3 as sb3
    from stable_baselines3.common.noise import NormalActionNoise

    from agents.learning.policy import policy_kwargs_of

    mean = deviation = None
    if settings.normalize:
        mean, deviation = _observation_statistics(env, settings.seed)
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
            policy_kwargs=policy_kwargs_of(settings, mean, deviation),
            seed=settings.seed,
            device="cpu",
            **given,
        )
    except (TypeError, ValueError, AssertionError) as error:
        raise InputError(f"{settings.algorithm} refuses its hyperparameters: {error}") from error


def _observation_statistics(env: Any, seed: int) -> tuple[Any, Any]:
    """Return mean and standard deviation of first observations."""
    env.seed(seed)
    seen = [env.reset() for _ in range(-(-NORMALISER_SAMPLES // env.num_envs))]
    every = np.concatenate(seen)
    return every.mean(axis=0), every.std(axis=0)


def _keep_logs(model: Any, logs: Path) -> None:
    from stable_baselines3.common.logger import configure

    kinds = ["csv", "tensorboard"] if has_tensorboard() else ["csv"]
    model.set_logger(configure(str(make_directory(logs)), kinds))


@contextmanager
def _faults_of(what: str) -> Generator[None]:
    """Convert errors of a library about settings to one line."""
    try:
        yield
    except CurlingError:
        raise
    except (ArithmeticError, AssertionError, AttributeError, LookupError, NameError) as error:
        raise InputError(f"{what} fails with these settings: {error}") from error
    except (RuntimeError, TypeError, ValueError) as error:
        raise InputError(f"{what} fails with these settings: {error}") from error


# --- files ----------------------------------------------------------------------------------------

_REPLAY = ("observations", "next_observations", "actions", "rewards", "dones", "timeouts")
_COUNTERS = ("_n_updates", "_episode_num")


def save_model(path: str | Path, model: Any, settings: TrainingSettings, ice: Ice) -> None:
    """Write everything needed for throwing: the settings and the weights of the policy.

    Raises
    ------
    OutputError : the file cannot be written
    """
    write_model(path, _document(model, settings, ice))


def save_checkpoint(path: str | Path, model: Any, settings: TrainingSettings, ice: Ice) -> None:
    """Write everything needed for resuming.

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
    """Return a digest that differs from ice to ice."""
    effects = [(e.name, sorted(e.parameters.items())) for e in ice.effects]
    text = repr((ice.sheet, ice.stone, ice.friction.interpolation, effects)).encode()
    return hashlib.sha256(text + ice.friction.mu.tobytes()).hexdigest()[:16]


_MAY_CHANGE = ("n_timesteps", "eval_freq")
"""Settings that may change when a run is resumed."""


def _check_is_of(document: dict[str, Any], settings: TrainingSettings, ice: Ice, path: Any) -> None:
    if "optimisers" not in document:
        raise InputError("is a finished model; resume from a checkpoint", source=path)
    saved, asked = settings_of_run(path).as_dict(), settings.as_dict()
    for name in sorted(saved.keys() | asked.keys()):
        if name not in _MAY_CHANGE and saved.get(name) != asked.get(name):
            raise InputError(
                f"was trained with {name} {saved.get(name)!r}, not {asked.get(name)!r}", source=path
            )
    if document.get("ice") != _digest(ice):
        raise InputError("was trained on another ice", source=path)


def _restore(model: Any, document: dict[str, Any], path: Any) -> None:
    """Set a new model to the state of a checkpoint."""
    try:
        parameters = {"policy": document["policy"], **document["optimisers"]}
        model.set_parameters(tensors(parameters), device="cpu")
        for name, value in document["variables"].items():
            getattr(model, name).data = tensors(value)
        model.num_timesteps = int(document["steps_done"])
        for name in _COUNTERS:
            setattr(model, name, int(document["counters"][name]))
        replay = document.get("replay")
        if replay is not None:
            buffer, filled = model.replay_buffer, len(replay["rewards"])
            if filled > buffer.buffer_size:
                raise InputError("contains more throws than the memory of this run", source=path)
            if not 0 <= int(replay["pos"]) <= filled:
                raise ValueError("the position in the memory is beyond its end")
            for name in _REPLAY:
                getattr(buffer, name)[:filled] = replay[name]
            buffer.full = filled == buffer.buffer_size
            buffer.pos = int(replay["pos"])
        _check_finite(model)
        _check_optimisers(document["optimisers"])
    except (AttributeError, LookupError, TypeError, ValueError, RuntimeError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError("is not a checkpoint that fits this environment", source=path) from error


def _check_finite(model: Any) -> None:
    for weights in model.policy.state_dict().values():
        if not bool(weights.isfinite().all()):
            raise ValueError("a weight is not finite")


def _check_optimisers(documents: dict[str, Any]) -> None:
    """Refuse negative mean squares of gradients, whose roots would make the weights NaN."""
    for document in documents.values():
        for state in document["state"].values():
            if np.min(state.get("exp_avg_sq", 0.0)) < 0.0:
                raise ValueError("a mean square of an optimiser is negative")


__all__ = [
    "TrainingSettings",
    "latest_checkpoint",
    "make_vec_env",
    "save_checkpoint",
    "save_model",
    "settings_of_run",
    "train",
    "with_settings",
]
