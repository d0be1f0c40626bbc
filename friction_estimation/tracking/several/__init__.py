"""Several stones that move at once, and their tracks before and after they touch."""
