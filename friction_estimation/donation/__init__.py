"""A measured session in one file that may be given away, without film and without names."""

from friction_estimation.donation.session import Session, ThrownBy, read_session, write_session

__all__ = ["Session", "ThrownBy", "read_session", "write_session"]
