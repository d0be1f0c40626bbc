"""Sub-commands of `curling` about throwing: planning, learning, the demonstration."""
