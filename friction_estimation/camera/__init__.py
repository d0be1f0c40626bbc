"""A camera before the sheet: its lens, and its pose from known points and the painted lines."""
