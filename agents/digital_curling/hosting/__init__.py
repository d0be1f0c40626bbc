"""Host for Digital Curling's clients: games on this project's ice, with clocks and logs.

- `setting`: the settings of a game
- `hosted_game`: the game itself, independent of the network
- `trajectory`: the paths of a shot in Digital Curling's form
- `logs`: the host's logs in Digital Curling's form
- `seats`: the seat of a team: a client on a connection, or a player of this project
- `server`: a game between two seats
"""
