"""Numbers that were tuned for stones that move at the same time."""

from __future__ import annotations

# --- common steps ------------------------------------------------------------------------------
MAX_STEP = 0.5
"""Longest Runge–Kutta step [s]."""
MAX_SPEED_LOSS = 0.2
"""Share of its speed that a stone may lose in one step."""
SKIPPED_LINE = 2e-3
"""Distance to a line of a bilinear map, where friction bends, below which a step may cross it [m].
The error is 1e-8 m."""
JUMP_MARGIN = 1e-5
"""Distance before a place where friction jumps at which steps end, to hop over it [m]. A stage
beyond it would apply for a whole step what holds there: at 2 m/s, millimetres at rest."""
REST_SPEED = 2e-3
"""Speed of centre and band below which a stone stops uniformly [m/s]; it goes 20 µm more."""
PIECES_OF_A_STEP = 8
"""Parts of a step in which the distance of two stones is taken to have at most one minimum."""
MAX_STEPS = 20_000
"""Steps after which stones are given up that never stop because the ice drives them."""

OVERLAP_ALLOWED = 1e-3
"""How far resting stones may overlap as given [m]: positions are written to a millimetre."""
APPROACH = 0.3
"""Tolerance of the delivered stone's path among others, up to its first contact, as a part of the
tolerance. A contact magnifies ten times and more what the place of the stones is off by."""
ITERATIONS = 30
"""Iterations of pymunk's solver for each of several contacts."""
MAX_CONTACTS = 2000
"""Times of contact after which a throw is given up; a crowded take-out has some tens."""

# --- from event to event -----------------------------------------------------------------------
CONTACT_GAP = 1e-6
"""Gap below which two stones that close on each other collide [m]."""
MAX_COLLISIONS = 3000
"""Pushes after which a throw is given up."""
