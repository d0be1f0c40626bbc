"""A host for Digital Curling's clients: games on this project's ice, with clocks and logs.

- `setting`: what a game is played with
- `hosted_game`: the game itself, which knows nothing of the network
- `trajectory`: the paths of a shot in Digital Curling's form
- `logs`: the host's logs in Digital Curling's form
- `seats`: who sits for a team: a client on a connection, or a player of this project
- `server`: plays a game between two seats
"""
