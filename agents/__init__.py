"""Those who throw: planning on a known ice, learning, and their evaluation."""
