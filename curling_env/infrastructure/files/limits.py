"""How much of everything is accepted from a file; docs/files.md lists the same numbers.

Each limit lies far above what a season of films and throws needs and is checked before the memory
is spent. So a damaged or malicious file costs a moment and one line, not the machine.
"""

from __future__ import annotations

MAX_TEXT_BYTES = 512 * 2**20
"""Of a CSV table or another program's export: five million rows of releases."""
MAX_JSON_BYTES = 64 * 2**20
"""Of a JSON document: an ice with half a million cells."""
MAX_JSON_DEPTH = 32
"""Of lists and objects inside one another."""
MAX_DIGITS = 30
"""Of a whole number. No quantity here needs more than 17."""
MAX_YAML_BYTES = 2**20
MAX_YAML_NODES = 20_000
"""Of a YAML file with its aliases written out."""

MAX_COLUMNS = 256
"""Of a table."""
MAX_ROWS = 5_000_000
"""Of a table: a whole day at 30 frames a second is 2.6 million."""
MAX_CELL = 1000
"""Characters of a cell."""

MAX_ARCHIVE_BYTES = 512 * 2**20
"""Of a file of arrays, as it lies on the disk."""
MAX_ARRAY_BYTES = 640 * 2**20
"""Of all its arrays together, unpacked."""
MAX_MEMBERS = 10_000
"""Arrays in a file."""

MAX_PICTURE_BYTES = 128 * 2**20
MAX_PICTURE_PIXELS = 36_000_000
"""Of one picture or still: an 8K picture has 33 million."""
MAX_FRAME_PIXELS = 16_800_000
"""Of one frame of a film: 5.3K has 15.9 million, and a film is looked at many frames at a time."""
MAX_FRAMES = 2_000_000
"""Of one film: eighteen hours at 30 frames a second."""

PIPE_PATIENCE = 15.0
"""Time without a single byte from a pipe after which it is given up [s]."""
PIPE_ALONE = 5.0
"""The same where nobody holds the other end of it [s]."""
