"""Random ices to learn on: those that the environments draw, see `curling_env.envs.random_ice`."""

from curling_env.envs.random_ice import KNOWLEDGE, RandomIces

__all__ = ["KNOWLEDGE", "RandomIces"]
