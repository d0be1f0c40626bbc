"""Random ices to learn on, as drawn by the environments, see `curling_env.envs.random_ice`."""

from curling_env.envs.random_ice import KNOWLEDGE, RandomIces

__all__ = ["KNOWLEDGE", "RandomIces"]
