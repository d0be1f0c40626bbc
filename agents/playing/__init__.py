"""Players, the games they play, and what comes of the games.

- `players`: players that look ahead without learning
- `search`: the player that searches, and what it has learnt about positions
- `league`: generations of a player that learn from playing each other
- `trained_player`: the player in a model's file, or the player of a name
- `potentials`: values of positions, for rewards on the way
- `offline_data`: ends as a dataset for offline learning
- `match`: a game between two players; `tournament`: many games and who is better
- `record`: a game as JSON lines; `scoreboard`: its line score; `replay`: its film or page
"""
