"""Measured session in one file for publication, without film and without names."""

from curling_env.infrastructure.lazy_names import lazy_names
from friction_estimation.donation.session import Session, ThrownBy, read_session, write_session

__all__ = ["Session", "ThrownBy", "read_session", "write_session"]

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "names": ("refuse_names", "without_names"),
    },
)
