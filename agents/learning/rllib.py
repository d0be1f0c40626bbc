"""Training with RLlib on several machines, with the same environment and configuration.

Each worker throws in its share of the environments; the learner runs in this process. The policy
starts with the weights of stable-baselines3 and is saved as if it had been trained there, so that
its users need not know its origin. RLlib's own checkpoints contain pickled Python objects; none is
written.
"""

# RLlib is optional and comes without complete types.
# pyright: reportMissingImports=false

from __future__ import annotations

import inspect
import logging
import os
from contextlib import suppress
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space

from agents.learning.configuration import TrainingSettings, schedule_of
from agents.learning.policy import TrainedPolicy, tensors
from agents.learning.training import make_vec_env, new_model, save_model, step_name
from curling_env.errors import InputError
from curling_env.ice import Ice, load_ice
from curling_env.infrastructure.executor import executor
from curling_env.infrastructure.files.writing import make_directory
from curling_env.infrastructure.workers import WorkersLostError
from curling_env.typing import Progress, Singles, no_progress

PARAMETER_NAMES = {
    "learning_rate": "lr",
    "gamma": "gamma",
    "gae_lambda": "lambda_",
    "batch_size": "minibatch_size",
    "n_epochs": "num_epochs",
    "clip_range": "clip_param",
    "ent_coef": "entropy_coeff",
    "vf_coef": "vf_loss_coeff",
    "max_grad_norm": "grad_clip",
}
"""RLlib's names of PPO's parameters in stable-baselines3; `n_steps` is part of the batch size."""
WEIGHT_NAMES = {
    "mlp_extractor.policy_net": "encoder.actor_encoder.net.mlp",
    "mlp_extractor.value_net": "encoder.critic_encoder.net.mlp",
    "action_net": "pi.net.mlp.0",
    "value_net": "vf.net.mlp.0",
    "log_std": "pi.log_std",
}
"""RLlib's names of the weights of stable-baselines3's `MlpPolicy`."""
_ENVIRONMENT = "curling-sheets"
_POLICY = "default_policy"


class RLlibVectorEnv(gymnasium.vector.VectorEnv[Any, Any, Any]):
    """Adapter to RLlib, where an episode begins in the step after the last one.

    Parameters
    ----------
    sheets : environment of `training.make_vec_env`, whose episodes end together
    normalise : the policy's normaliser of observations
    """

    def __init__(self, sheets: Any, normalise: Any) -> None:
        self._sheets, self._normalise = sheets, normalise
        self._next: Singles | None = None
        self.num_envs = sheets.num_envs
        self.metadata = {"autoreset_mode": AutoresetMode.NEXT_STEP}
        self.single_observation_space = gymnasium.spaces.Box(
            -np.inf, np.inf, sheets.observation_space.shape, np.float32
        )
        self.single_action_space = sheets.action_space
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)

    def reset(self, *, seed: Any = None, options: Any = None) -> tuple[Singles, dict[str, Any]]:
        """Begin all episodes; `options` are ignored."""
        self._sheets.seed(seed)
        self._next = None
        return self._seen(self._sheets.reset()), {}

    def step(self, actions: Singles) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        """Throw in every environment, or begin a new episode after the end of one."""
        never = np.zeros(self.num_envs, dtype=np.bool_)
        if self._next is not None:
            seen, self._next = self._next, None
            return self._seen(seen), np.zeros(self.num_envs), never, never, {}
        seen, rewards, over, infos = self._sheets.step(actions)
        if over.any():
            assert over.all(), "environments that begin together end together"
            seen, self._next = np.stack([info["terminal_observation"] for info in infos]), seen
        return self._seen(seen), np.asarray(rewards), over, never, {}

    def _seen(self, observations: Singles) -> Singles:
        return self._normalise(tensors(observations)).numpy()


def train(
    settings: TrainingSettings,
    output: str | Path,
    ice: str | Path | Ice = "standard",
    *,
    workers: int,
    progress: Progress = no_progress,
) -> TrainedPolicy:
    """Train a policy on the current Ray cluster or on this machine, and leave `model.npz`.

    Parameters
    ----------
    settings : settings of the run
    output : folder for the model; made if missing
    ice : file, preset or ice to learn on, if the settings have no random ices
    workers : number of workers, each with its share of the environments
    progress : called after every step of learning with the number of throws

    Returns
    -------
    the trained policy

    Raises
    ------
    InputError : settings that RLlib does not have, environments that cannot be divided among the
        workers, or more workers than the cluster has CPUs
    OutputError : a file cannot be written
    WorkersLostError : no worker is left
    ModuleNotFoundError : RLlib is not installed
    """
    if settings.algorithm != "ppo":
        raise InputError(f"RLlib can only train ppo here, got {settings.algorithm!r}")
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")  # no usage statistics are sent
    try:
        import ray
        from ray.rllib.algorithms.ppo import PPOConfig
        from ray.tune import register_env
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(str(error), name="ray.rllib") from error
    logging.getLogger("ray.rllib").setLevel(logging.ERROR)
    known = load_ice(settings.ices.base if settings.ices else ice)
    parameters = rllib_parameters(settings, workers)
    model = new_model(make_vec_env(settings, known), settings)
    policy, normalise = model.policy, model.policy.features_extractor

    def environment(context: dict[str, Any]) -> RLlibVectorEnv:
        envs = make_vec_env(settings, known, num_envs=context["num_envs"])
        return RLlibVectorEnv(envs, normalise)

    register_env(_ENVIRONMENT, environment)
    config = (
        PPOConfig()
        .environment(
            _ENVIRONMENT,
            # As in stable-baselines3: actions are unbounded, and cut before they are executed.
            normalize_actions=False,
            clip_actions=True,
        )
        .env_runners(
            num_env_runners=workers,
            num_envs_per_env_runner=settings.n_envs // workers,
            gym_env_vectorize_mode=gymnasium.VectorizeMode.VECTOR_ENTRY_POINT,
            sample_timeout_s=None,  # a busy worker is waited for; a lost one is restarted
        )
        .training(**parameters, use_kl_loss=False, vf_clip_param=np.inf, grad_clip_by="global_norm")
        .rl_module(model_config=rllib_model_of(policy))
        .debugging(seed=settings.seed, log_level="ERROR")
    )
    with executor("ray"):
        cpus = int(ray.cluster_resources().get("CPU", 0))
        if workers > cpus:  # RLlib would wait for more CPUs for ever
            raise InputError(f"{workers} workers need a CPU each; the Ray cluster has {cpus}")
        folder = make_directory(output)
        algorithm: Any = config.build_algo()
        try:
            algorithm.learner_group.set_weights({_POLICY: weights_for_rllib(policy)})
            algorithm.env_runner_group.sync_weights(
                from_worker_or_learner_group=algorithm.learner_group, inference_only=True
            )
            while model.num_timesteps < settings.n_timesteps:
                result = algorithm.train()
                if "env_runners" not in result:
                    raise WorkersLostError("all workers of RLlib were lost")
                model.num_timesteps = int(result["num_env_steps_sampled_lifetime"])
                reward = float(result["env_runners"]["episode_return_mean"])
                progress(step_name(reward), model.num_timesteps, settings.n_timesteps)
            take_weights(policy, algorithm.get_weights([_POLICY])[_POLICY])
        finally:
            algorithm.stop()
            with suppress(OSError):  # RLlib makes an empty folder in the user's home
                Path(algorithm.logdir).rmdir()
    save_model(folder / "model.npz", model, settings, known)
    return TrainedPolicy.load(folder / "model.npz")


def rllib_parameters(settings: TrainingSettings, workers: int) -> dict[str, Any]:
    """Return PPO's parameters by RLlib's names, with the defaults of stable-baselines3.

    Raises
    ------
    InputError : a parameter that RLlib does not have, or environments that cannot be divided among
        the workers
    """
    from stable_baselines3 import PPO

    if workers < 1 or settings.n_envs % workers:
        raise InputError(
            f"n_envs {settings.n_envs} cannot be divided evenly among {workers} workers"
        )
    unknown = sorted(settings.hyperparameters.keys() - PARAMETER_NAMES.keys() - {"n_steps"})
    if unknown:
        raise InputError(f"RLlib does not support {unknown[0]}; remove it to train there")
    usual = inspect.signature(PPO).parameters
    given = {name: usual[name].default for name in (*PARAMETER_NAMES, "n_steps")}
    given |= settings.hyperparameters
    batch = given.pop("n_steps") * settings.n_envs
    parameters: dict[str, Any] = {"train_batch_size_per_learner": batch}
    for name, value in given.items():
        schedule = schedule_of(value)
        if callable(schedule):
            if name != "learning_rate":
                raise InputError(f"RLlib has no schedule for {name}, got {value!r}")
            value = [[0, schedule(1.0)], [settings.n_timesteps, 0.0]]
        parameters[PARAMETER_NAMES[name]] = value
    return parameters


def weights_for_rllib(policy: Any) -> dict[str, Singles]:
    """Return weights of stable-baselines3's policy by RLlib's names."""
    state = policy.state_dict()
    return {there: state[here].numpy().copy() for here, there in _names(state).items()}


def take_weights(policy: Any, weights: dict[str, Any]) -> None:
    """Set the weights of stable-baselines3's policy to those of RLlib."""
    state = policy.state_dict()
    learnt = {here: np.asarray(weights[there]) for here, there in _names(state).items()}
    policy.load_state_dict({**state, **tensors(learnt)})


def _names(state: dict[str, Any]) -> dict[str, str]:
    """Return each weight's name in stable-baselines3 and in RLlib."""
    return {
        name: there + name.removeprefix(here)
        for name in state
        for here, there in WEIGHT_NAMES.items()
        if name == here or name.startswith(f"{here}.")
    }


def rllib_model_of(policy: Any) -> Any:
    """Return RLlib's model with the same layers."""
    from ray.rllib.core.rl_module.default_model_config import DefaultModelConfig

    units = list(policy.net_arch["pi"] if isinstance(policy.net_arch, dict) else policy.net_arch)
    if not units:
        raise InputError("with RLlib net_arch needs a hidden layer")
    return DefaultModelConfig(
        fcnet_hiddens=units,
        fcnet_activation=policy.activation_fn.__name__.lower(),
        vf_share_layers=False,
        free_log_std=True,
        log_std_clip_param=np.inf,
    )
