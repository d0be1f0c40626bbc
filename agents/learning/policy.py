"""Trained policy, and its throws at targets on a known ice."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from agents.learning.actor import actor_of
from agents.learning.configuration import TrainingSettings, settings_from
from agents.learning.model_file import check_finite, read_model
from agents.planning.target_search import direction_to
from curling_env.envs.sheet.action import ThrowRange, throw_range_for
from curling_env.envs.sheet.env import CurlingSheetEnv
from curling_env.envs.sheet.reset import reset_distribution
from curling_env.envs.sheet.tasks import task_named
from curling_env.errors import InputError
from curling_env.ice import Ice, load_ice
from curling_env.sheet import Direction, to_delivery
from curling_env.throw import Throw
from curling_env.typing import Floats, Singles


class Actor(Protocol):
    """Anything that maps an observation to an action, like stable-baselines3's policies."""

    def predict(self, observation: Any, *, deterministic: bool = False) -> tuple[Any, Any]:
        """Return the action, and a state that is not used here."""
        ...


@dataclass(frozen=True, kw_only=True)
class TrainedPolicy:
    """Trained policy for throws.

    Parameters
    ----------
    actor : the network, which maps observations to actions
    settings : settings of its training
    throw_range : range of throws of its actions
    """

    actor: Actor
    settings: TrainingSettings
    throw_range: ThrowRange

    @classmethod
    def load(cls, path: str | Path) -> TrainedPolicy:
        """Load the model file of a policy; nothing in the file is executed.

        Raises
        ------
        InputError : the file does not exist, or is not a trained model of this project
        """
        document = read_model(path)
        check_finite(document.get("policy"), path)
        try:
            settings = settings_from(document["settings"])
            throws = ThrowRange(**{k: tuple(v) for k, v in document["throws"].items()})
        except (InputError, KeyError, TypeError, AttributeError) as error:
            problem = error.problem if isinstance(error, InputError) else None
            raise InputError(
                problem or "is not a trained model of this project", source=path
            ) from error
        try:
            actor = actor_of(document["policy"], settings, int(document["observation_size"]))
        except (AttributeError, KeyError, TypeError, ValueError) as error:
            raise InputError("holds weights that do not fit its settings", source=path) from error
        return cls(actor=actor, settings=settings, throw_range=throws)

    def predict(
        self, observation: ArrayLike, *, deterministic: bool = True
    ) -> tuple[Singles, None]:
        """Return the action for one or many observations of the environment of the training.

        Parameters
        ----------
        observation : (k,) or (n, k), of `CurlingSheet-v0` made with the settings of the training
        deterministic : take the best action instead of sampling from the policy

        Returns
        -------
        the action, (3,) or (n, 3), over `throw_range`; and None, as in stable-baselines3

        Raises
        ------
        InputError : observations of another size
        """
        seen = np.asarray(observation, dtype=np.float32)
        size = getattr(self.actor, "observation_size", None)
        if size is not None and seen.shape[-1:] != (size,):
            raise InputError(
                f"this policy was trained on observations of {size} numbers, got {seen.shape}; "
                "make the environment with the options of its training"
            )
        action, _ = self.actor.predict(seen, deterministic=deterministic)
        return np.asarray(action, dtype=np.float32), None

    def environment(self) -> dict[str, Any]:
        """Return the options of `CurlingSheet-v0` that fit `predict`."""
        numbers = self.throw_range
        options: dict[str, Any] = {
            **self.settings.env_kwargs,
            "throw_range": {"speed": numbers.speed, "angle": numbers.angle, "spin": numbers.spin},
            "skill": self.settings.skill,
        }
        if self.settings.ices is not None:
            options["ices"] = {**asdict(self.settings.ices), "knows": self.settings.knows}
        return options

    def throws(self, known: Ice, targets: ArrayLike) -> Floats:
        """Return the throw at each target, (n, 4) speed, angle, spin and offset at the hog line.

        Parameters
        ----------
        known : the known ice
        targets : (n, 2) targets in one half of the sheet, sheet frame [m]
        """
        targets = np.asarray(targets, dtype=np.float64).reshape(-1, 2)
        direction = direction_to(targets[0])
        if self.settings.ices is not None:
            known = self.settings.ices.as_known(known, self.settings.knows)
        options = {**self.settings.environment(), "throw_range": self.throw_range}
        env = CurlingSheetEnv(known, **{**options, "direction": direction})
        seen = [
            env.reset(options={"target": tuple(place)})[0]
            for place in to_delivery(targets, direction)
        ]
        actions, _ = self.actor.predict(np.stack(seen), deterministic=True)
        numbers = self.throw_range.numbers_of(actions)
        return np.column_stack([numbers, np.zeros(len(numbers))])

    def throw(self, known: Ice, target: ArrayLike) -> Throw:
        """Return the throw at one target (2,), sheet frame [m]; see `throws`."""
        speed, angle, spin, x = self.throws(known, target)[0].tolist()
        return Throw(speed=speed, angle=angle, spin=spin, x=x)


def throw_range_of(settings: TrainingSettings, ice: Ice) -> ThrowRange:
    """Return the range of throws of the actions: as configured, or else suited to the ice."""
    options = settings.environment()
    if "throw_range" in options:
        return options["throw_range"]
    choices = {name: options.get(name, default) for name, default in _RESET_DEFAULTS.items()}
    task = task_named(options.get("task", "draw"))
    stones = reset_distribution(choices, ice, task).stone_count
    return throw_range_for(
        load_ice(settings.ices.base) if settings.ices else ice, Direction.AWAY, hits=stones > 0
    )


_RESET_DEFAULTS: dict[str, Any] = {"target": None, "stones": (), "direction": "away", "level": None}


def policy_kwargs_of(
    settings: TrainingSettings, mean: Any = None, deviation: Any = None
) -> dict[str, Any]:
    """Return `policy_kwargs` in stable-baselines3's form.

    Parameters
    ----------
    mean, deviation : mean and standard deviation of the observations, for the normaliser
    """
    from torch import nn

    from agents.learning.normalisation import ObservationNormaliser

    kinds = {"tanh": nn.Tanh, "relu": nn.ReLU, "elu": nn.ELU}
    given = dict(settings.policy_kwargs)
    if "net_arch" in given:
        given["net_arch"] = list(given["net_arch"])
    if "activation_fn" in given:
        given["activation_fn"] = kinds[given["activation_fn"]]
    if settings.normalize:
        given["features_extractor_class"] = ObservationNormaliser
        given["features_extractor_kwargs"] = {"mean": mean, "deviation": deviation}
    return given


def tensors(value: Any) -> Any:
    """Return a nested document with tensors in place of arrays."""
    import torch

    if isinstance(value, np.ndarray):
        return torch.from_numpy(value.copy())
    if isinstance(value, dict):
        return {key: tensors(item) for key, item in value.items()}
    if isinstance(value, list):
        return [tensors(item) for item in value]
    return value
