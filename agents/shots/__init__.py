"""Real shots of championships, and what they say of hands and calls.

- `table`: tables of shots, with their faults by row, and ends that do not score as written
- `records`: their games in the form that `replay`, the board and the notebooks open
- `inversion`: the throws that explain where stones went, on ice of this project
- `hands`: execution errors of players, teams, tasks and handles; `grades`: how shots are graded
- `decisions`: what was called beside what `search` calls
- `dataset`: the shots as a dataset for offline learning
"""
