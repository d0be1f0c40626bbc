"""Tracking from a running camera: each throw is recorded as a film and then tracked.

The path of a throw is most accurate once all of it has been seen, and there is half a minute until
the next one. While one throw is recorded, the throw before it is therefore tracked in another
process, as any film, and the ice is estimated there from all throws to date. A recording begins
when something moves on the ice and ends when all has been still for some seconds. If the ice is
never quiet between throws, the recording is cut into them as any long film is. Films without a
thrown stone are reported and kept.
"""

from curling_env.infrastructure.lazy_names import lazy_names
from friction_estimation.live.feed import Feed, LiveFrame, Packet, open_feed
from friction_estimation.live.follow import IceSoFar, TrackedClip, follow_stream
from friction_estimation.live.recorder import Clip, Recorder

__all__ = [
    "Clip",
    "Feed",
    "IceSoFar",
    "LiveFrame",
    "Packet",
    "Recorder",
    "TrackedClip",
    "follow_stream",
    "open_feed",
]

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "tuning": ("LEAD_IN_SECONDS", "MAX_FILM_SECONDS", "QUIET_SECONDS"),
    },
)
