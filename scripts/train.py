"""Train an agent on an ice and judge it beside the planner; the same as `curling train`.

python scripts/train.py --ice runs/demo/ice.json -o runs/draws --steps 20000
"""

from __future__ import annotations

import sys

from curling_env.cli import main

if __name__ == "__main__":
    sys.exit(main(["train", *sys.argv[1:]]))
