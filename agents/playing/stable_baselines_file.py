"""Policies that stable-baselines3 and sb3-contrib saved, read without running code in the file.

Their zip files hold weights, JSON, and pickled objects. Only the weights and the plain part of the
JSON are read: the policy is built again from the sizes of its spaces and its options.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from importlib import import_module
from io import BytesIO
from pathlib import Path
from typing import Any
from zipfile import BadZipFile, ZipFile

import numpy as np
from gymnasium.spaces import Box, Discrete, Space

from curling_env.errors import InputError

POLICIES = {
    "stable_baselines3.common.policies": "ActorCriticPolicy",
    "stable_baselines3.dqn.policies": "DQNPolicy",
    "stable_baselines3.sac.policies": "SACPolicy",
    "stable_baselines3.td3.policies": "TD3Policy",
    "sb3_contrib.common.maskable.policies": "MaskableActorCriticPolicy",
    "sb3_contrib.common.recurrent.policies": "RecurrentActorCriticPolicy",
    "sb3_contrib.qrdqn.policies": "QRDQNPolicy",
    "sb3_contrib.tqc.policies": "TQCPolicy",
}
"""Class of the policies of flat observations, by the module that a file names."""
ACTIVATIONS = frozenset({"ELU", "GELU", "LeakyReLU", "ReLU", "SiLU", "Tanh"})
MOST_BYTES = 200_000_000
"""Maximum size of the weights [bytes]."""


def stable_baselines_policy(path: str | Path) -> Any:
    """Read a policy, for use on the CPU.

    Raises
    ------
    InputError : no such file, no model of stable-baselines3, a policy of another kind than those
        of `POLICIES`, or a package that is not installed
    """
    try:
        with ZipFile(path) as archive:
            document = json.loads(archive.read("data"))
            if archive.getinfo("policy.pth").file_size > MOST_BYTES:
                raise InputError(f"the weights exceed {MOST_BYTES:,} bytes", source=path)
            weights = archive.read("policy.pth")
        module = str(document["policy_class"]["__module__"])
        spaces = [_space(document[name]) for name in ("observation_space", "action_space")]
        options = _options(document["policy_kwargs"])
    except FileNotFoundError as error:
        raise InputError("no such file", source=path) from error
    except (OSError, BadZipFile, KeyError, ValueError, TypeError) as error:
        problem = "expected a model with flat observations, saved by stable-baselines3"
        raise InputError(problem, source=path) from error
    if module not in POLICIES:
        problem = f"unknown policy of {module[:60]!r}; expected one of {', '.join(POLICIES)}"
        raise InputError(problem, source=path)
    try:
        import torch

        kind = getattr(import_module(module), POLICIES[module])
    except ModuleNotFoundError as error:
        needed = module.partition(".")[0].replace("_", "-")
        raise InputError(f"needs {needed}: pip install {needed}", source=path) from error
    try:
        policy = kind(*spaces, lambda remaining: 0.0, **options)
        policy.load_state_dict(torch.load(BytesIO(weights), map_location="cpu", weights_only=True))
    except Exception as error:  # of torch, pickle or the policy: the file is damaged or unusual
        problem = f"the weights do not fit the policy that it names: {str(error)[:120]}"
        raise InputError(problem, source=path) from error
    policy.set_training_mode(False)
    return _BestAvailable(policy) if module.endswith("dqn.policies") else policy


class _BestAvailable:
    """Policy that values every action, and takes the best available one.

    Parameters
    ----------
    policy : policy of DQN or QR-DQN
    """

    def __init__(self, policy: Any) -> None:
        self._policy = policy

    def predict(
        self, observation: Any, *, action_masks: Any = None, deterministic: bool = True
    ) -> tuple[Any, None]:
        """Return the action for an observation, as stable-baselines3 does; and None.

        Parameters
        ----------
        observation : (k,) of the environment
        action_masks : (n,) 0 for each unavailable action
        deterministic : always true: values have no probabilities
        """
        if action_masks is None:
            return self._policy.predict(observation, deterministic=deterministic)[0], None
        seen, _ = self._policy.obs_to_tensor(observation)
        network = getattr(self._policy, "q_net", None) or self._policy.quantile_net
        values = network(seen).detach().numpy()
        values = values.reshape(-1, values.shape[-1]).mean(axis=0)
        return int(np.where(action_masks, values, -np.inf).argmax()), None


def _space(entry: Mapping[str, Any]) -> Space[Any]:
    """Return the space of a file's readable entries: a box from -1 to 1, or a number of choices."""
    if "discrete" in str(entry[":type:"]):
        return Discrete(int(entry["n"]))
    shape = tuple(int(size) for size in entry["_shape"])
    if len(shape) != 1:
        raise ValueError(f"observations of the shape {shape}")
    return Box(-1.0, 1.0, shape, np.float32)


def _options(entry: Mapping[str, Any]) -> dict[str, Any]:
    """Return the options of a policy from the readable entries of a file."""
    options: dict[str, Any] = {}
    for name, value in entry.items():
        if name.startswith((":", "optimizer")) or name == "features_extractor_kwargs":
            continue  # mean and deviation of the normaliser are among the weights
        if name == "features_extractor_class":
            value = _normaliser(str(value))
        if name == "activation_fn":
            found = re.fullmatch(r"<class 'torch\.nn\.modules\.activation\.(\w+)'>", str(value))
            if found is None or found[1] not in ACTIVATIONS:
                raise ValueError(f"activation {value}")
            value = getattr(import_module("torch.nn"), found[1])
        options[str(name)] = value
    return options


def _normaliser(name: str) -> Any:
    """Return the class of the only features extractor that is read, beside the default."""
    if name != "<class 'agents.learning.normalisation.ObservationNormaliser'>":
        raise ValueError(f"features extractor {name}")
    from agents.learning.normalisation import ObservationNormaliser

    return ObservationNormaliser
