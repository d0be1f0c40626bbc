"""Run one measure, and print its figures as one line of JSON.

    python scripts/measure.py physics.rests

The measures are the functions of `measures/GROUP.py`, each of which returns values by name.
`figures.json` records them; see `figures.py`.
"""

from __future__ import annotations

import json
import sys
from importlib import import_module

from figures import GROUPS


def main() -> int:
    """Run the measure that the command line names."""
    wanted = sys.argv[1] if len(sys.argv) == 2 else ""
    group, _, name = wanted.partition(".")
    measures = {}
    if group in GROUPS:
        module = import_module(f"measures.{group}")
        measures = {key: getattr(module, key) for key in module.MEASURES}
    if name not in measures:
        known = ", ".join(f"{group}.{key}" for key in measures) or ", ".join(GROUPS)
        print(f"measure: unknown measure {wanted!r}; expected one of {known}", file=sys.stderr)
        return 2
    values = measures[name]()
    print(json.dumps({key: float(value) for key, value in values.items()}))
    return 0


if __name__ == "__main__":
    sys.exit(main())
