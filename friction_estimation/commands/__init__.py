"""Sub-commands of `curling` about measuring: films, tracks, ice."""
