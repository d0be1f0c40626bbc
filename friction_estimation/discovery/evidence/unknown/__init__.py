"""What the catalogue does not hold: what it follows, and how much of it there is."""
