"""Gymnasium environments: thin adapters over the physics and the rules."""

from curling_env.infrastructure.lazy_names import lazy_names

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "game.end_env": ("AGENT", "CurlingEndEnv"),
        "game.end_vector_env": ("CurlingEndVectorEnv",),
        "game.shots": ("DRAWS", "SHOTS"),
        "known_ice": ("KnownIce", "mean_friction"),
        "sheet.action": ("ThrowRange", "throw_range_for"),
        "sheet.env": ("CurlingSheetEnv",),
        "sheet.reward": ("RewardWeights",),
        "sheet.tasks": ("task_named",),
        "sheet.vector_env": ("CurlingSheetVectorEnv",),
        "stable_baselines": ("CurlingVecEnv",),
    },
)
