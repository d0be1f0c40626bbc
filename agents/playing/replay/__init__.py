"""A recorded game as a film or as a page."""
