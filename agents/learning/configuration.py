"""Settings of a training run, from a YAML file like those of RL Zoo.

A file names the algorithm, the number of throws, the policy and the environment. Every other key is
a parameter of the algorithm in stable-baselines3. Unknown keys are refused by name.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field, fields, replace
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from curling_env.envs.options import brief, dataclass_from
from curling_env.envs.random_ice import KNOWLEDGE, RandomIces
from curling_env.envs.sheet.action import ThrowRange
from curling_env.envs.sheet.env import CurlingSheetEnv
from curling_env.envs.sheet.reward import RewardWeights
from curling_env.errors import InputError, placed
from curling_env.infrastructure.files.reading import read_yaml
from curling_env.throw import skill_named

ALGORITHMS = ("sac", "td3", "ppo")
POLICY_KWARGS = ("net_arch", "activation_fn", "log_std_init")
ACTIVATIONS = ("tanh", "relu", "elu")
_NOT_HYPERPARAMETERS = frozenset(
    {"self", "policy", "env", "policy_kwargs", "seed", "device", "verbose", "tensorboard_log"}
    | {"_init_setup_model", "rollout_buffer_class", "rollout_buffer_kwargs", "action_noise"}
    | {"replay_buffer_class", "replay_buffer_kwargs"}
)
"""Parameters of the algorithms that are not hyperparameters, or that a file cannot set."""
_RANGES: dict[str, tuple[float, float, bool]] = {
    "learning_rate": (1e-12, 10.0, False),
    "buffer_size": (1, 10**7, True),
    "learning_starts": (0, 10**9, True),
    "batch_size": (2, 10**6, True),
    "tau": (0.0, 1.0, False),
    "gamma": (0.0, 1.0, False),
    "gae_lambda": (0.0, 1.0, False),
    "train_freq": (1, 10**6, True),
    "gradient_steps": (-1, 10**4, True),
    "n_steps": (2, 10**6, True),
    "n_epochs": (1, 1000, True),
    "clip_range": (1e-6, 100.0, False),
    "vf_coef": (0.0, 1e6, False),
    "max_grad_norm": (1e-9, 1e9, False),
    "policy_delay": (1, 1000, True),
    "target_update_interval": (1, 10**6, True),
    "stats_window_size": (1, 10**6, True),
    "sde_sample_freq": (-1, 10**6, True),
}
"""Bounds of the algorithms' hyperparameters, and whether they are whole numbers."""
_MOST = {"n_timesteps": 10**10, "n_envs": 2**16, "seed": 2**32 - 1, "checkpoint_every": 10**10}
_MOST_LAYERS, _MOST_UNITS = 16, 8192
_NOT_CONFIGURABLE = frozenset({"self", "ice", "known_ice", "ices", "skill", "fps", "render_mode"})
"""Parameters of the environment that a configuration cannot choose."""


@dataclass(frozen=True, kw_only=True)
class TrainingSettings:
    """Settings of a training run.

    Parameters
    ----------
    algorithm : ``sac``, ``td3`` or ``ppo``
    n_timesteps : total number of throws
    n_envs : number of parallel environments
    policy : policy of stable-baselines3; only ``MlpPolicy``
    policy_kwargs : `net_arch` (units of the hidden layers), `activation_fn` (tanh, relu or elu),
        `log_std_init` (logarithm of PPO's first standard deviation)
    normalize : normalise observations by their mean and standard deviation over the ices and
        targets of the task; constant numbers are then dropped
    env_kwargs : options of `CurlingSheet-v0`; `throw_range` and `weights` as mappings
    skill : player whose execution error is added to the throws
    practice : the player during training, if another one. A steadier player shows the value of a
        throw more clearly, and its best throw is nearly the best for all
    ices : distribution of the training ices; None for a single ice
    knows : the agent's knowledge of a random ice: ``map`` (the estimated map), ``mean`` (its mean
        friction) or ``nothing``
    noise : standard deviation of TD3's exploration noise
    hyperparameters : parameters of the algorithm; a number may be a schedule: ``lin_1e-3`` falls to
        zero
    checkpoint_every : throws between checkpoints; 0 for none
    eval_freq : throws between evaluations; 0 for none
    seed : seed of all randomness

    Raises
    ------
    InputError : a setting is unknown or invalid
    """

    algorithm: str = "sac"
    n_timesteps: int = 20_000
    n_envs: int = 1
    policy: str = "MlpPolicy"
    policy_kwargs: Mapping[str, Any] = field(default_factory=dict[str, Any])
    normalize: bool = False
    env_kwargs: Mapping[str, Any] = field(default_factory=dict[str, Any])
    skill: str = "club"
    practice: str | None = None
    ices: RandomIces | None = None
    knows: str = "map"
    noise: float = 0.1
    hyperparameters: Mapping[str, Any] = field(default_factory=dict[str, Any])
    checkpoint_every: int = 0
    eval_freq: int = 0
    seed: int = 0

    def __post_init__(self) -> None:
        _one_of("algorithm", self.algorithm, ALGORITHMS)
        _one_of("policy", self.policy, ("MlpPolicy",))
        _one_of("knows", self.knows, KNOWLEDGE)
        for skill in (self.skill, self.practice or self.skill):
            skill_named(skill)
        for name, least in (
            ("n_timesteps", 1),
            ("n_envs", 1),
            ("seed", 0),
            ("checkpoint_every", 0),
            ("eval_freq", 0),
        ):
            value = getattr(self, name)
            most = _MOST.get(name, 10**10)
            if isinstance(value, bool) or not isinstance(value, int) or not least <= value <= most:
                raise InputError(
                    f"{name} must be a whole number of at least {least} and at most {most}, got "
                    f"{brief(value)}"
                )
        for name in ("policy_kwargs", "env_kwargs", "hyperparameters"):
            if not isinstance(getattr(self, name), Mapping):
                raise InputError(f"{name} must be a mapping, got {brief(getattr(self, name))}")
        if not isinstance(self.normalize, bool):
            raise InputError(f"normalize must be true or false, got {brief(self.normalize)}")
        if not isinstance(self.noise, int | float) or not 0 <= self.noise <= 10:
            raise InputError(f"noise must lie within 0 and 10, got {brief(self.noise)}")
        _known_keys("policy_kwargs", self.policy_kwargs, POLICY_KWARGS)
        _known_keys("env_kwargs", self.env_kwargs, _options_of_environment())
        known = _hyperparameters_of(self.algorithm)
        if known is not None:
            _known_keys("the settings", self.hyperparameters, known)
        layers = self.policy_kwargs.get("net_arch", [64])
        if (
            not isinstance(layers, list | tuple)
            or len(layers) > _MOST_LAYERS
            or not all(isinstance(units, int) and 1 <= units <= _MOST_UNITS for units in layers)
        ):
            raise InputError(
                f"net_arch must list layers of one unit or more, at most {_MOST_LAYERS} of at most "
                f"{_MOST_UNITS}, got {brief(layers)}"
            )
        deviation = self.policy_kwargs.get("log_std_init", 0.0)
        if not isinstance(deviation, int | float) or not -20 <= deviation <= 5:
            raise InputError(f"log_std_init must lie within -20 and 5, got {brief(deviation)}")
        if "activation_fn" in self.policy_kwargs:
            _one_of("activation_fn", self.policy_kwargs["activation_fn"], ACTIVATIONS)
        if self.ices is not None and self.env_kwargs.get("throws", 1) != 1:
            raise InputError("on random ices an episode has one throw")
        _check_hyperparameters(self.hyperparameters)
        for value in self.hyperparameters.values():
            schedule_of(value)
        self.environment()

    def environment(self) -> dict[str, Any]:
        """Return `env_kwargs` in the types of `CurlingSheetEnv`."""
        options = dict(self.env_kwargs)
        for name, kind in (("throw_range", ThrowRange), ("weights", RewardWeights)):
            if name in options:
                options[name] = _fields_from(kind, name, options[name])
        return options

    def as_dict(self) -> dict[str, Any]:
        """Return plain numbers and text for `settings_from`."""
        document = {**asdict(self), **self.hyperparameters}
        del document["hyperparameters"]
        if self.ices is None:
            del document["ices"]
        return document


def settings_from(document: Any, **others: Any) -> TrainingSettings:
    """Make settings from the mapping in a configuration file.

    Parameters
    ----------
    document : content of the file
    others : settings that replace those of the file

    Raises
    ------
    InputError : an unknown key, or an invalid value
    """
    if not isinstance(document, dict) or not all(isinstance(key, str) for key in document):
        raise InputError("expected settings by name")
    given = {**document, **others}
    ours = {f.name for f in fields(TrainingSettings)} - {"hyperparameters"}
    ices = given.get("ices")
    if ices is not None and not isinstance(ices, RandomIces):
        given["ices"] = _fields_from(RandomIces, "ices", ices)
    settings = {name: value for name, value in given.items() if name in ours}
    rest = {name: _number(value) for name, value in given.items() if name not in ours}
    for name in ("policy_kwargs", "env_kwargs"):
        if not isinstance(settings.get(name, {}), dict):
            raise InputError(f"{name} must be a mapping, got {brief(settings[name])}")
    try:
        return TrainingSettings(**settings, hyperparameters=rest)
    except (TypeError, ValueError, OverflowError) as error:  # a list where a number belongs
        if isinstance(error, InputError):
            raise
        raise InputError(f"invalid setting: {error}") from error


def load_settings(name: str | Path, **others: Any) -> TrainingSettings:
    """Load settings from a configuration file, or one of the project's by name.

    Parameters
    ----------
    name : file, or one of `configurations`
    others : settings that replace those of the file

    Raises
    ------
    InputError : the file does not exist, or does not describe the training of a policy
    """
    document = read_configuration(name)
    with placed(source=name):
        return settings_from(document, **others)


def read_configuration(name: str | Path) -> Any:
    """Read the content of a configuration file, or of one of the project's by name.

    Raises
    ------
    InputError : the file does not exist, or is not YAML
    """
    where: Any = Path(name)
    if str(name) in configurations():
        where = files("agents.learning").joinpath("configurations", f"{name}.yml")
    elif not where.exists():
        raise InputError(
            f"no such configuration file; expected a file or one of {', '.join(configurations())}",
            source=name,
        )
    return read_yaml(where)


def configurations() -> list[str]:
    """Return the names of the project's own configurations."""
    folder = files("agents.learning").joinpath("configurations")
    return sorted(Path(f.name).stem for f in folder.iterdir() if f.name.endswith(".yml"))


def schedule_of(value: Any) -> float | Callable[[float], float] | Any:
    """Convert a hyperparameter for stable-baselines3: ``lin_x`` falls from x to zero.

    Raises
    ------
    InputError : text that is not a schedule
    """
    if not isinstance(value, str) or "_" not in value:
        return value
    kind, _, start = value.partition("_")
    if kind == "auto":  # SAC's own form of its entropy coefficient
        return value
    try:
        first = float(start)
    except ValueError:
        first = np.nan
    if kind != "lin" or not np.isfinite(first):
        raise InputError(f"expected a schedule such as lin_1e-3, got {brief(value)}")
    return lambda remaining: first * remaining


def with_settings(settings: TrainingSettings, **others: Any) -> TrainingSettings:
    """Return the settings with some replaced; replacements that are None are ignored."""
    return replace(settings, **{name: v for name, v in others.items() if v is not None})


# --- what is allowed ------------------------------------------------------------------------------


def _hyperparameters_of(algorithm: str) -> list[str] | None:
    """Names of an algorithm's hyperparameters; None without stable-baselines3, to use a model."""
    try:
        import stable_baselines3 as sb3
    except ModuleNotFoundError:
        return None
    parameters = inspect.signature(getattr(sb3, algorithm.upper())).parameters
    return sorted(set(parameters) - _NOT_HYPERPARAMETERS)


def _options_of_environment() -> list[str]:
    return sorted(set(inspect.signature(CurlingSheetEnv).parameters) - _NOT_CONFIGURABLE)


def _one_of(name: str, value: Any, choices: tuple[str, ...]) -> None:
    if not isinstance(value, str) or value not in choices:
        raise InputError(f"{name} must be one of {', '.join(choices)}, got {brief(value)}")


def _check_hyperparameters(given: Mapping[str, Any]) -> None:
    """Refuse numbers with which no algorithm can learn, or that would use all memory."""
    for name, value in given.items():
        if isinstance(value, str) and "_" in value:
            continue  # a schedule, which is checked where it is made
        if isinstance(value, list) and len(value) <= 2:
            continue  # train_freq: a number and its unit
        low, high, whole = _RANGES.get(name, (-1e9, 1e9, False))
        plain = value is None or isinstance(value, bool | str)
        if isinstance(value, int | float) and not isinstance(value, bool):
            if low <= value <= high and (not whole or float(value).is_integer()):
                continue
            plain = False
        if plain and name not in _RANGES:
            continue
        kind = "a whole number" if whole else "a number"
        raise InputError(f"{name} must be {kind} from {low:g} to {high:g}, got {brief(value)}")


def _known_keys(where: str, given: Mapping[str, Any], known: Any) -> None:
    unknown = sorted(set(given) - set(known))
    if unknown:
        raise InputError(
            f"unknown key {unknown[0]!r} in {where}; expected one of {', '.join(known)}"
        )


def _fields_from(kind: type, name: str, given: Any) -> Any:
    """Make a dataclass from a mapping, in which numbers may be text."""
    if isinstance(given, dict):
        given = {key: _number(value) for key, value in given.items()}
    return dataclass_from(kind, name, given)


def _number(value: Any) -> Any:
    """Convert text to a number if possible: YAML reads 1e-3, which has no point, as text."""
    if isinstance(value, str):
        try:
            return float(value)
        except ValueError:
            return value
    return value
