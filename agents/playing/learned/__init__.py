"""Player of ends by a network that has learned which shot to call.

- `features`: the network's input from an observation of `CurlingEnd-v0`
- `views`: the positions of observations from a player's view
- `values`: the value of each shot by simulation, thrown once or with execution errors
- `network`: the network, with scores for the shots of `curling_env.envs.game.shots`
- `player`: the network as a player of games
- `lessons`: positions with the value of every shot
- `fit`: training of the network with PyTorch
"""
