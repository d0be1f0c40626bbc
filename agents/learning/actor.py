"""Actor of a trained policy, evaluated in NumPy: using a model needs no PyTorch."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from agents.learning.configuration import TrainingSettings
from curling_env.typing import Floats

MAX_DEVIATION = 5.0
"""Clipping limit of a number of an observation, in standard deviations from the mean."""
_ACTIVATIONS: Mapping[str, Any] = {
    "tanh": np.tanh,
    "relu": lambda x: np.maximum(x, 0.0),
    "elu": lambda x: np.where(x > 0, x, np.expm1(np.minimum(x, 0.0))),
}
_LAYERS = {
    "ppo": ("mlp_extractor.policy_net.", "action_net"),
    "sac": ("actor.latent_pi.", "actor.mu"),
    "td3": ("actor.mu.", None),
}
"""Prefixes of the names of the hidden layers, and of the last layer if it differs."""
_SAC_LOG_DEVIATION = (-20.0, 2.0)
"""Bounds of the logarithm of SAC's standard deviation, as in stable-baselines3."""

Layer = tuple[Floats, Floats]


@dataclass(frozen=True, kw_only=True)
class MlpActor:
    """Layers that map an observation to an action, as in stable-baselines3's policies.

    Parameters
    ----------
    layers : (outputs, inputs) matrix and offset of each layer
    activation : ``tanh``, ``relu`` or ``elu`` between them
    squashed : pass actions through a hyperbolic tangent; otherwise clip them at ±1
    centre, scale : offset subtracted from observations, and factor; None if they pass unchanged
    log_deviation : logarithm of the standard deviation of actions: a constant (3,), or a layer from
        the last hidden one; None if absent
    """

    layers: tuple[Layer, ...]
    activation: str
    squashed: bool
    centre: Floats | None = None
    scale: Floats | None = None
    log_deviation: Floats | Layer | None = None

    @property
    def observation_size(self) -> int:
        """Return the number of elements of an observation."""
        return self.layers[0][0].shape[1]

    def predict(
        self,
        observation: Any,
        *,
        deterministic: bool = False,
        rng: np.random.Generator | None = None,
    ) -> tuple[Floats, None]:
        """Return the action for an observation (k,) or many (n, k); and None, as in
        stable-baselines3.

        Parameters
        ----------
        observation : observation of the form used in training
        deterministic : take the best action instead of sampling from the policy
        rng : source of randomness for sampling
        """
        x = np.asarray(observation, dtype=np.float32)
        if self.centre is not None and self.scale is not None:
            x = np.clip((x - self.centre) * self.scale, -MAX_DEVIATION, MAX_DEVIATION)
        *hidden, (weights, offset) = self.layers
        for w, b in hidden:
            x = _ACTIVATIONS[self.activation](x @ w.T + b)
        action = x @ weights.T + offset
        if not deterministic and self.log_deviation is not None:
            rng = np.random.default_rng() if rng is None else rng
            log: Any = self.log_deviation
            if isinstance(log, tuple):
                log = np.clip(x @ log[0].T + log[1], *_SAC_LOG_DEVIATION)
            action = action + np.exp(log) * rng.standard_normal(action.shape)
        return (np.tanh(action) if self.squashed else np.clip(action, -1.0, 1.0)), None


def actor_of(weights: Mapping[str, Any], settings: TrainingSettings, size: int) -> MlpActor:
    """Make the actor from the weights of a policy of stable-baselines3.

    Parameters
    ----------
    weights : arrays by stable-baselines3's names
    settings : settings of the training
    size : number of elements of an observation

    Raises
    ------
    KeyError, ValueError : weights of another kind of policy, or that do not fit the settings
    """
    begins, last = _LAYERS[settings.algorithm]
    numbers = sorted(
        int(name.removeprefix(begins).removesuffix(".weight"))
        for name in weights
        if name.startswith(begins) and name.endswith(".weight")
    )
    names = [f"{begins}{k}" for k in numbers] + ([] if last is None else [last])
    layers = tuple(_layer(weights, name) for name in names)
    units = settings.policy_kwargs.get("net_arch")
    sizes = [size, *(len(b) for _, b in layers)]
    if [w.shape[1] for w, _ in layers] != sizes[:-1] or sizes[-1] != 3:
        raise ValueError("the sizes of its layers do not fit each other")
    if units is not None and sizes[1:-1] != list(units):
        raise ValueError("its layers differ from its settings")
    if any(w.shape != (len(b), w.shape[1]) for w, b in layers):
        raise ValueError("the bias of a layer has another size")
    centre = scale = None
    if settings.normalize:
        where = "" if settings.algorithm == "ppo" else "actor."
        centre, scale = (
            _array(weights, f"{where}features_extractor.{name}") for name in ("centre", "scale")
        )
        if centre.shape != (size,) or scale.shape != (size,):
            raise ValueError("its normaliser has another size")
    log_deviation: Floats | Layer | None = None
    if settings.algorithm == "ppo":
        log_deviation = _array(weights, "log_std").reshape(3)
    elif settings.algorithm == "sac":
        log_deviation = _layer(weights, "actor.log_std")
    usual = "tanh" if settings.algorithm == "ppo" else "relu"
    return MlpActor(
        layers=layers,
        activation=settings.policy_kwargs.get("activation_fn", usual),
        squashed=settings.algorithm != "ppo",
        centre=centre,
        scale=scale,
        log_deviation=log_deviation,
    )


def _layer(weights: Mapping[str, Any], name: str) -> Layer:
    matrix, offset = _array(weights, f"{name}.weight"), _array(weights, f"{name}.bias")
    if matrix.ndim != 2 or offset.ndim != 1:
        raise ValueError(f"{name} is not a layer")
    return matrix, offset


def _array(weights: Mapping[str, Any], name: str) -> Floats:
    return np.asarray(weights[name], dtype=np.float32)  # pyright: ignore[reportReturnType]
