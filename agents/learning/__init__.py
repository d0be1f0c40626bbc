"""Learning to throw: policies trained on `CurlingSheet-v0`, and their evaluation.

- `configuration`: the settings of a run, from a YAML file
- `training`: training with stable-baselines3, with checkpoints; `rllib`: training on a Ray cluster
- `policy`: a trained policy and its throws
- `evaluation`: a policy compared with the planner and the best possible throw
- `normalisation`: the normaliser of observations
- `model_file`: trained models as files of arrays and JSON
"""

from curling_env.infrastructure.lazy_names import lazy_names

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "actor": ("actor_of",),
        "configuration": (
            "TrainingSettings",
            "load_settings",
            "read_configuration",
            "schedule_of",
            "settings_from",
        ),
        "evaluation": (
            "best_throw",
            "compare_with_planner",
            "evaluation_draws",
            "house_targets",
            "misses",
            "planner_throw",
            "rest_in_env",
        ),
        "model_file": ("read_model", "write_model"),
        "policy": ("TrainedPolicy", "policy_kwargs_of"),
        "training": ("make_vec_env", "new_model"),
        "zoo": ("ALGORITHMS", "file_of"),
    },
)
