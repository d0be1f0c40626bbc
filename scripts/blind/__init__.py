"""Sessions with a hidden effect and a sealed truth, and the scores of discovery on them.

- `law`: formulas and integrator of the ice, none of them the project's own
- `hidden`: possible hidden effects and their sizes
- `camera`, `sessions`: whole sessions, as track files and a sealed truth
- `families`: the hidden effects of each session of the benchmark
- `scoring`: names, sizes and maps compared with the truth
- `linearised`, `bound`: the best possible knowledge of the ice
- `planned_draws`: draws planned on the discovered ice, thrown on the true one
- `filmed`: sessions with rendered films
"""
