"""A club folder: one database, and beside it films, tracks and ices as every command reads them."""

from agents.app.club.club import Club
from agents.app.club.records import (
    Athlete,
    Camera,
    Film,
    Job,
    Note,
    Session,
    Stone,
    Target,
    Throw,
)

__all__ = [
    "Athlete",
    "Camera",
    "Club",
    "Film",
    "Job",
    "Note",
    "Session",
    "Stone",
    "Target",
    "Throw",
]
