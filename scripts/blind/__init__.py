"""Sessions with something hidden in them and a sealed truth, and how well discovery finds it.

- `law`: formulas and integrator of the ice, none of them the project's own
- `hidden`: what may be hidden, and how large it is
- `camera`, `sessions`: whole sessions, as track files and a sealed truth
"""
