"""Endpoints of the sheet's pages: JSON in, JSON out, on an ice and for a skill that are given.

- `forms`: what may be asked, checked
- `runs`: a throw, and the paths of all stones that it moves
- `plans`: the throw for a target, and what to expect of it
- `calls`: the best calls in a position that was laid out
- `games`: a game against a player, throw by throw
- `ice_sheet`: the ice in curlers' words
"""
