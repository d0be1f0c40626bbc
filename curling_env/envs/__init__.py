"""Gymnasium environments: thin adapters over the physics and the rules."""

from curling_env.infrastructure.lazy_names import lazy_names

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "game.action": ("TeamDecisions",),
        "game.end_env": ("AGENT", "CurlingEndEnv"),
        "game.end_vector_env": ("CurlingEndVectorEnv",),
        "game.reward": ("GameRewardParts", "GameRewardWeights"),
        "game.shots": ("DRAWS", "SHOTS"),
        "known_ice": ("KnownIce", "mean_friction"),
        "recording": ("RecordVideo",),
        "sheet.action": ("ThrowRange", "throw_range_for"),
        "sheet.curriculum": (
            "Curriculum",
            "CurriculumProgress",
            "CurriculumWrapper",
            "VectorCurriculumWrapper",
        ),
        "sheet.discrete": ("DiscreteThrows",),
        "sheet.env": ("CurlingSheetEnv",),
        "sheet.reward": ("RewardParts", "RewardWeights"),
        "sheet.tasks": ("TASKS", "TASK_GROUP", "TakeoutTask", "task_named", "task_names"),
        "sheet.vector_env": ("CurlingSheetVectorEnv",),
        "stable_baselines": ("CurlingVecEnv",),
    },
)
