"""Ends played by a network that has learnt which shot to call.

- `features`: what the network sees of an observation of `CurlingEnd-v0`
- `prospects`: what each shot would be worth if it came off
- `ways`: whether a stone lies on its way
- `network`: from there to the shots of the list in `curling_env.envs.game.shots`
- `player`: the network as a player of games
- `imitation`: which shot of the list a recorded throw was, and learning from such
- `fit`: the network as PyTorch trains it
"""
