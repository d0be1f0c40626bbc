"""What may be a stone in a picture: what moves, and what the network finds."""
