"""The tuned numbers of cutting, set on streams and films that are rendered here."""

from __future__ import annotations

# --- motion on the ice -------------------------------------------------------------------------

SQUARE_PX = 2
"""Brightness is averaged over squares of this many pixels."""
MIN_CHANGE = 12.0
"""Least change of brightness that counts, of 255, beyond the change that all of the ice shares."""
CHANGE_SIGMAS = 6.0
"""A change must also be this many times the camera's noise."""
MOVING_STONE_SHARE = 0.2
"""Share of a stone's picture that must change."""
MIN_CHANGED_SQUARES = 3
"""Number of squares that must change, however small a stone is there."""
LOOK_INTERVAL = 0.1
"""Least time between two looks at a stream [s]."""
LEVEL_STEP = 7
"""The change that all of the ice shares, and the noise, are taken from every so many squares."""
LEVEL_SQUARES = 2000
"""They are taken from at least so many squares, or from all."""
COMPARED_AFTER = 2.0
"""A look is compared with the one this long before [s]: far from the camera, a stone on its last
metre has then moved by a pixel."""

# --- looks at a long film -----------------------------------------------------------------------

LOOK_STEP = 0.4
"""Time between two looks, where key frames come so often [s]."""
MAX_KEY_GAP = 1.05
"""Where key frames are further apart, frames between them are decoded too [s]."""
FINE_LINES = 800
"""Pictures are looked at in halves, quarters, ... until they have fewer lines."""
STRETCH_MARGIN = 3.0
"""A stretch of film with motion begins and ends this long before and after it [s]."""
WINDOW = 80.0
"""Longest piece of such a stretch that is looked through at once [s]."""
WINDOW_MARGIN = 6.0
"""A throw that ends so close to the end of a piece may go on in the next one [s]."""
BACKGROUND_LOOKS = 15
"""Looks whose median is the empty ice of a piece."""

# --- what is a throw ----------------------------------------------------------------------------

MAX_UNSEEN = 3.0
"""Longest time that a sliding stone is hidden [s]; what appears later is another one."""
REST_SECONDS, REST_DISTANCE = 3.0, 0.15
"""What stays within this distance [m] for this time [s] lies still."""
REST_SHARE = 0.75
"""Share of the looks in that time in which it must be seen there."""
MAX_GAIN = 0.4
"""Speed that a stone may seem to gain between two looks, beyond what its blob jitters [m/s]."""
MIN_PATH = 3.0
"""Something that moves less is no throw [m]."""
MAX_TRIES = 16
"""So many paths in one piece are judged, the likeliest first."""
MOVING_SHARE = 0.95
"""Share of a path after which its stone counts as at rest: blobs of stones at rest still jitter."""
MIN_SLOWING = 0.15
"""Share of its mean speed that a sliding stone loses in sight; who carries a stone keeps to one
pace."""
JUDGED_ROWS = 60
"""About so many rows of a track are judged."""
WALKING_SPEED = 2.2
"""Nobody walks faster on ice [m/s]."""
WALK_SECONDS = (5.0, 6.5)
"""Who goes on at one pace for so long walks [s]."""
WALK_SHARE, WALK_LOOKS = 0.7, 8
"""Share of the looks in that time in which they must be seen, and the least number of them."""
WALK_JITTER = 0.08
"""So far from where that pace leads a sighting may be, and a pixel [m]."""
WALK_MARGIN = 1.5
"""They walk for so long before and after, too [s]."""
STROLLING = 0.5
"""Who walks is faster than this [m/s]."""
WALK_SLOWING = 0.02
"""And slows down less [m/s²]: a stone on the keenest ice loses twice as much."""
PEOPLE_MIDDLE = 0.8
"""Height of the middle of somebody's picture, about [m]."""
MIN_SWEPT, MIN_SWEPT_SECONDS = 8.0, 6.0
"""People who go beside a stone go at least so far [m], and so long [s]."""
LEAST_SLOWING = 0.04
"""They slow down more than this [m/s²], as the stone does."""
RETURN_DISTANCE = 0.8
"""A stone that sets out from within this of where the one before it came to rest, and goes the
other way, is slid back [m]."""
STRUCK_SECONDS = 2.0
"""A stone that sets out from there so soon was hit [s]."""
RESTED_SECONDS = 2.0
"""What has hardly moved for so long before its track ends has come to rest [s]."""
LEAD_SECONDS = 2.0
"""A throw begins this long before its stone is first seen [s]."""
TAIL_SECONDS = 4.0
"""A throw ends this long after its stone was last seen to move [s]: it creeps on for a while."""
LOOKS_AFTER = 3
"""Where people are near in so many looks after the last sighting, a stone may be hidden."""
LAST_PACE_SECONDS = 1.2
"""How fast a stone was when it was lost is taken from sightings so far back [s]."""
GROUP_PACE_SECONDS = 4.0
"""The same for people beside it, whose pictures join and part [s]."""
CREEPING = 0.3
"""A stone that was last seen slower than this hardly slides on [m/s]."""
SLOWING = (0.07, 0.12)
"""How fast stones slow down on ice, at least and at most [m/s²]."""
APART_SECONDS = 0.5
"""Two throws are at least so far apart [s]."""
ONE_THROW_SECONDS = 60.0
"""A film of one throw that is no longer than this is tracked as it is [s]."""
SHORT_SECONDS = 28.0
"""A shorter film is looked through only if tracking it shows a second throw, or none [s]."""
