"""Why throws missed: what left the hand, the ice that it found, and what neither explains."""
