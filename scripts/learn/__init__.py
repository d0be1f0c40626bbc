"""Training of the package's networks: shots and position values.

- `lessons`, `cloning`: what every shot is worth in positions, and a network that copies it
- `backwards`: values of positions, from the last stone of an end to its first
"""
