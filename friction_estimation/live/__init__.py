"""Tracking from a camera that is filming now: each throw is recorded as a film and then tracked.

The path of a throw is known best when all of it has been seen, and on the ice there is half a
minute until the next one. So nothing is tracked in a hurry: while one throw is recorded, the throw
before it is tracked in another process, as any film is, and the ice is estimated there from all
throws to date. A recording begins when something moves on the ice and ends when all has been still
for some seconds. If the ice is never quiet between throws, the recording is cut into them as any
long film is. Films without a thrown stone are reported and kept.
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
