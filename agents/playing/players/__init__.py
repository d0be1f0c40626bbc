"""Players that need no learning and no search."""
