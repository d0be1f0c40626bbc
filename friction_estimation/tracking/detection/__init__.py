"""Finding stones in a picture: the empty ice, what moves on it, and what lies still."""
