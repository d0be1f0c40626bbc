"""A camera before a sheet: its lens and pose, from marks, boards and paint; no stone is known."""
