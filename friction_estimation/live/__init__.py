"""A camera that is filming now: each throw is recorded as a film of its own, and then tracked.

A throw's path is known best when all of it has been seen, and the ice gives half a minute until
the next. So nothing is tracked in a hurry: while one throw is recorded, the one before goes
through the same `track_film` as any film, in a process beside, and what the ice is like by now is
estimated there too. A throw begins when something moves on the ice and ends when all has been still
for some seconds; films without a stone that slides are told of and kept.
"""

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
