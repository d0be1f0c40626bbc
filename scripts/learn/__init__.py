"""Training of the package's networks: shots and position values.

- `lessons`, `cloning`: the value of every shot in positions, and a network that learns it
- `backwards`: values of positions, from the last stone of an end to its first
"""
