"""Endpoints of the sheet's pages: JSON in, JSON out, on an ice and for a skill that are given.

- `forms`: what may be asked, checked
- `throws`: a throw, with the paths of all stones that it moves, and the throw for a target
- `games`: a game against a player, and the best calls in a position
- `ice_sheet`: the ice in curlers' words
"""
