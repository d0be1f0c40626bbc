"""Learning what comes with the package: the network that calls shots, and the value networks.

- `lessons`, `cloning`: what every shot is worth in positions, and a network that copies it
- `backwards`: values of positions, from the last stone of an end to its first
"""
