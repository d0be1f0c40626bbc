"""Real shots of championships, and their evidence on hands and calls.

- `table`: tables of shots, with their faults by row, and ends whose stones contradict the score
- `records`: their games in the form that `replay`, the board and the notebooks open
- `inversion`: the throws that explain the movements of stones, on ice of this project
- `hands`: execution errors of players, teams, tasks and handles; `grades`: a model of grades
- `decisions`: teams' calls compared with those of `search`
- `dataset`: the shots as a dataset for offline learning
"""
