"""Sub-commands that play, record and show games."""
