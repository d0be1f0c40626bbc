"""Digital Curling: what its server does with a shot, in the server's own JSON."""

from agents.digital_curling.transition import transition

__all__ = ["transition"]
