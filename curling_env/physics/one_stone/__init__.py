"""One stone alone on the ice: its step, its path, and the throw that reaches a target."""
