"""Sessions with something hidden in them and a sealed truth, and how well discovery finds it.

- `law`: formulas and integrator of the ice, none of them the project's own
- `hidden`: what may be hidden, and how large it is
- `camera`, `sessions`: whole sessions, as track files and a sealed truth
- `families`: what is hidden in which session of the benchmark
- `scoring`: names, sizes and maps beside the truth
- `linearised`, `bound`: how well the ice can be known at best
- `planned_draws`: draws planned on the ice that was found, thrown on the true one
- `filmed`: sessions that are really filmed
"""
