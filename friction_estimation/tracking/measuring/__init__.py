"""The fit of each stone in every frame."""
