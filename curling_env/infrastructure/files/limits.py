"""Limits on the size of everything that is read from a file; docs/files.md lists the same numbers.

Each limit lies far above the needs of a season of films and throws, and is checked before memory is
allocated. So a damaged or malicious file costs a moment and one line, not the machine.
"""

from __future__ import annotations

MAX_TEXT_BYTES = 512 * 2**20
"""Maximum size of a CSV table or another program's export [bytes]: five million rows of
releases.
"""
MAX_JSON_BYTES = 64 * 2**20
"""Maximum size of a JSON document [bytes]: an ice with half a million cells."""
MAX_JSON_DEPTH = 32
"""Maximum nesting depth of lists and objects."""
MAX_DIGITS = 30
"""Maximum number of digits of a whole number. No quantity here needs more than 17."""
MAX_YAML_BYTES = 2**20
MAX_YAML_NODES = 20_000
"""Maximum number of entries of a YAML file with its aliases expanded."""

MAX_COLUMNS = 256
"""Maximum number of columns of a table."""
MAX_ROWS = 5_000_000
"""Maximum number of rows of a table: a whole day at 30 frames a second is 2.6 million."""
MAX_CELL = 1000
"""Maximum number of characters in a cell."""

MAX_ARCHIVE_BYTES = 512 * 2**20
"""Maximum size of a file of arrays on the disk [bytes]."""
MAX_ARRAY_BYTES = 640 * 2**20
"""Maximum total size of its arrays, unpacked [bytes]."""
MAX_MEMBERS = 10_000
"""Maximum number of arrays in a file."""

MAX_PICTURE_BYTES = 128 * 2**20
MAX_PICTURE_PIXELS = 36_000_000
"""Maximum size of a picture or still [pixels]: an 8K picture has 33 million."""
MAX_FRAME_PIXELS = 16_800_000
"""Maximum size of a frame of a film [pixels]: 5.3K has 15.9 million, and many frames are read at a
time.
"""
MAX_FRAMES = 2_000_000
"""Maximum number of frames of a film: eighteen hours at 30 frames a second."""

PIPE_TIMEOUT = 15.0
"""Timeout for a pipe that sends nothing [s]."""
ORPHAN_PIPE_TIMEOUT = 5.0
"""Timeout for a pipe without a writer [s]."""
