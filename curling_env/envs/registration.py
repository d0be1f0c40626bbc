"""Registration of the environments with Gymnasium, by their names."""

from __future__ import annotations

import gymnasium


def register() -> None:
    """Register CurlingSheet-v0 and CurlingEnd-v0 with Gymnasium; a second call does nothing."""
    for name, one, many, threshold in (
        (
            "CurlingSheet-v0",
            "sheet.env:CurlingSheetEnv",
            "sheet.vector_env:CurlingSheetVectorEnv",
            1.0,  # reward of a stone 10 cm from the target
        ),
        (
            "CurlingEnd-v0",
            "game.end_env:CurlingEndEnv",
            "game.end_vector_env:CurlingEndVectorEnv",
            0.2,  # points per end against `rulebased`: more than its own against itself
        ),
    ):
        if name not in gymnasium.registry:
            gymnasium.register(  # pyright: ignore[reportUnknownMemberType]  (kwargs: a bare dict)
                name,
                entry_point=f"curling_env.envs.{one}",
                vector_entry_point=f"curling_env.envs.{many}",
                reward_threshold=threshold,
            )
