"""Learning to throw with RLlib, on more machines than one: same environment, same configuration.

Each worker throws on its share of the sheets; the learner sits in this process. The policy begins
with the weights that stable-baselines3 would begin with and is saved as if it had been trained
there, so that whatever throws with a model need not know who trained it. RLlib's own checkpoints
hold pickled Python objects; none is written.
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
from numpy.typing import NDArray

from agents.learning.configuration import TrainingSettings, schedule_of
from agents.learning.policy import Thrower, tensors
from agents.learning.training import Tell, new_model, save_model, sheets_of
from curling_env.errors import InputError
from curling_env.executor import WorkersLostError, executor
from curling_env.ice import Ice, load_ice
from curling_env.storage import make_directory

WORDS = {
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
"""RLlib's words for PPO's parameters in stable-baselines3; `n_steps` goes into the batch's size."""
PLACES = {
    "mlp_extractor.policy_net": "encoder.actor_encoder.net.mlp",
    "mlp_extractor.value_net": "encoder.critic_encoder.net.mlp",
    "action_net": "pi.net.mlp.0",
    "value_net": "vf.net.mlp.0",
    "log_std": "pi.log_std",
}
"""Where RLlib keeps the weights of stable-baselines3's `MlpPolicy`."""
_ENVIRONMENT = "curling-sheets"
_POLICY = "default_policy"


class SheetsForRLlib(gymnasium.vector.VectorEnv[Any, Any, Any]):
    """Sheets side by side as RLlib steps them: an episode begins in the step after the last.

    Parameters
    ----------
    sheets : of `agents.learning.training.sheets_of`; their episodes end together
    look : what the policy makes of an observation before its first layer
    """

    def __init__(self, sheets: Any, look: Any) -> None:
        self._sheets, self._look = sheets, look
        self._next: NDArray[np.float32] | None = None
        self.num_envs = sheets.num_envs
        self.metadata = {"autoreset_mode": AutoresetMode.NEXT_STEP}
        self.single_observation_space = gymnasium.spaces.Box(
            -np.inf, np.inf, sheets.observation_space.shape, np.float32
        )
        self.single_action_space = sheets.action_space
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)

    def reset(
        self, *, seed: Any = None, options: Any = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Begin all episodes; `options` are not used."""
        self._sheets.seed(seed)
        self._next = None
        return self._seen(self._sheets.reset()), {}

    def step(self, actions: NDArray[np.float32]) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        """Throw on every sheet, or begin where an episode has ended."""
        never = np.zeros(self.num_envs, dtype=np.bool_)
        if self._next is not None:
            seen, self._next = self._next, None
            return self._seen(seen), np.zeros(self.num_envs), never, never, {}
        seen, rewards, over, told = self._sheets.step(actions)
        if over.any():
            assert over.all(), "sheets that begin together end together"
            seen, self._next = np.stack([info["terminal_observation"] for info in told]), seen
        return self._seen(seen), np.asarray(rewards), over, never, {}

    def _seen(self, observations: NDArray[np.float32]) -> NDArray[np.float32]:
        return self._look(tensors(observations)).numpy()


def train(
    directory: str | Path,
    settings: TrainingSettings,
    ice: str | Path | Ice = "standard",
    *,
    workers: int,
    tell: Tell = lambda steps, reward: None,
) -> Thrower:
    """Train an agent on the Ray cluster at hand, or one on this machine; leaves `model.npz`.

    Parameters
    ----------
    directory : made if it is not there
    ice : file, preset or ice to learn on, where the settings have no random ices
    workers : that throw, each on its share of the settings' sheets
    tell : of the progress, after every step of learning

    Returns
    -------
    the trained policy

    Raises
    ------
    InputError : settings that RLlib has no word for, sheets that cannot be shared out, or more
        workers than the cluster has CPUs
    OutputError : a file cannot be written
    WorkersLostError : no worker is left
    ModuleNotFoundError : RLlib is not installed
    """
    if settings.algorithm != "ppo":
        raise InputError(f"with RLlib only ppo is trained, got {settings.algorithm!r}")
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")  # nothing is told to anyone outside
    try:
        import ray
        from ray.rllib.algorithms.ppo import PPOConfig
        from ray.tune import register_env
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(str(error), name="ray.rllib") from error
    logging.getLogger("ray.rllib").setLevel(logging.ERROR)
    known = load_ice(settings.ices.base if settings.ices else ice)
    words = words_for(settings, workers)
    model = new_model(sheets_of(settings, known), settings)
    policy, look = model.policy, model.policy.features_extractor

    def sheets(context: dict[str, Any]) -> SheetsForRLlib:
        return SheetsForRLlib(sheets_of(settings, known, num_envs=context["num_envs"]), look)

    register_env(_ENVIRONMENT, sheets)
    config = (
        PPOConfig()
        .environment(
            _ENVIRONMENT,
            # As stable-baselines3 does: spread without bound, cut where the sheet is asked.
            normalize_actions=False,
            clip_actions=True,
        )
        .env_runners(
            num_env_runners=workers,
            num_envs_per_env_runner=settings.n_envs // workers,
            gym_env_vectorize_mode=gymnasium.VectorizeMode.VECTOR_ENTRY_POINT,
            sample_timeout_s=None,  # a busy worker is waited for; one that is lost is begun anew
        )
        .training(**words, use_kl_loss=False, vf_clip_param=np.inf, grad_clip_by="global_norm")
        .rl_module(model_config=shapes_of(policy))
        .debugging(seed=settings.seed, log_level="ERROR")
    )
    with executor("ray"):
        cpus = int(ray.cluster_resources().get("CPU", 0))
        if workers > cpus:  # RLlib would wait for more for ever
            raise InputError(f"{workers} workers need a CPU each; the Ray cluster has {cpus}")
        folder = make_directory(directory)
        algorithm: Any = config.build_algo()
        try:
            algorithm.learner_group.set_weights({_POLICY: weights_for_rllib(policy)})
            algorithm.env_runner_group.sync_weights(
                from_worker_or_learner_group=algorithm.learner_group, inference_only=True
            )
            while model.num_timesteps < settings.n_timesteps:
                told = algorithm.train()
                if "env_runners" not in told:
                    raise WorkersLostError("all workers of RLlib were lost")
                model.num_timesteps = int(told["num_env_steps_sampled_lifetime"])
                tell(model.num_timesteps, float(told["env_runners"]["episode_return_mean"]))
            take_weights(policy, algorithm.get_weights([_POLICY])[_POLICY])
        finally:
            algorithm.stop()
            with suppress(OSError):  # an empty folder that RLlib makes in the user's home
                Path(algorithm.logdir).rmdir()
    save_model(folder / "model.npz", model, settings, known)
    return Thrower.load(folder / "model.npz")


def words_for(settings: TrainingSettings, workers: int) -> dict[str, Any]:
    """PPO's parameters in RLlib's words; what a configuration leaves out is as stable-baselines3's.

    Raises
    ------
    InputError : a parameter that RLlib has no word for, or sheets that cannot be shared out
    """
    from stable_baselines3 import PPO

    if workers < 1 or settings.n_envs % workers:
        raise InputError(
            f"n_envs {settings.n_envs} cannot be shared out evenly to {workers} workers"
        )
    unknown = sorted(settings.hyperparameters.keys() - WORDS.keys() - {"n_steps"})
    if unknown:
        raise InputError(f"RLlib has no word for {unknown[0]}; take it out to train there")
    usual = inspect.signature(PPO).parameters
    given = {name: usual[name].default for name in (*WORDS, "n_steps")}
    given |= settings.hyperparameters
    words: dict[str, Any] = {"train_batch_size_per_learner": given.pop("n_steps") * settings.n_envs}
    for name, value in given.items():
        schedule = schedule_of(value)
        if callable(schedule):
            if name != "learning_rate":
                raise InputError(f"RLlib has no schedule for {name}, got {value!r}")
            value = [[0, schedule(1.0)], [settings.n_timesteps, 0.0]]
        words[WORDS[name]] = value
    return words


def weights_for_rllib(policy: Any) -> dict[str, NDArray[np.float32]]:
    """Weights of stable-baselines3's policy by the names they have in RLlib."""
    state = policy.state_dict()
    return {there: state[here].numpy().copy() for here, there in _names(state).items()}


def take_weights(policy: Any, weights: dict[str, Any]) -> None:
    """Set the weights of stable-baselines3's policy to those of RLlib's."""
    state = policy.state_dict()
    learnt = {here: np.asarray(weights[there]) for here, there in _names(state).items()}
    policy.load_state_dict({**state, **tensors(learnt)})


def _names(state: dict[str, Any]) -> dict[str, str]:
    """Names of the weights here, and there."""
    return {
        name: there + name.removeprefix(here)
        for name in state
        for here, there in PLACES.items()
        if name == here or name.startswith(f"{here}.")
    }


def shapes_of(policy: Any) -> Any:
    """RLlib's model of the same shapes."""
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
