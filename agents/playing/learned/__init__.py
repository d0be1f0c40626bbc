"""Ends played by a network that has learnt which shot to call.

- `features`: what the network sees of an observation of `CurlingEnd-v0`
- `views`: the positions of observations as a player sees them
- `values`: what each shot is worth by simulation, thrown once or with the errors of the hand
- `network`: from there to the shots of the list in `curling_env.envs.game.shots`
- `player`: the network as a player of games
- `lessons`: positions, and what every shot is worth in them
- `fit`: the network as PyTorch trains it
"""
