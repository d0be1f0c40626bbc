"""Players that need no learning, and the games they play.

- `aiming`: from a shot in the sport's words to a throw on the ice as it is known
- `draw`, `rulebased`, `greedy`: the players; each is declared under `curling.players`
- `search`: the player that searches, and what it has learnt of positions
- `match`: a game between two players; `record`: its JSON lines; `scoreboard`: its line score
- `page`: its replay as an animated page
- `tournament`: many games, and what they say of who is better
"""
