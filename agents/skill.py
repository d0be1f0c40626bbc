"""Skill of a player; it lives beside the throw, where the environments use it too."""

from curling_env.skill import SKILLS, Skill, skill_named

__all__ = ["SKILLS", "Skill", "skill_named"]
