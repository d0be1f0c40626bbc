"""A training run from beginning to end: learn to draw, judge it, throw with it.

    python scripts/train.py --config button-one-ice -o runs/button

`curling train` does the same with a progress bar; this shows the few calls behind it.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from agents.learning.configuration import configuration, with_settings
from agents.learning.evaluation import cases_of, judge
from agents.learning.policy import Thrower
from agents.learning.training import train
from curling_env.ice import load_ice
from curling_env.sheet import Direction, tee


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--config", default="button-one-ice", help="a name or a YAML file")
    parser.add_argument("--ice", default="standard")
    parser.add_argument("--steps", type=int, help="throws to learn from, if not the configured")
    parser.add_argument("-o", "--output", type=Path, default=Path("runs/train"))
    arguments = parser.parse_args()

    settings = with_settings(configuration(arguments.config), n_timesteps=arguments.steps)
    ice = load_ice(arguments.ice)
    train(arguments.output, settings, ice)

    # From here on, all that is needed is the file: anyone may load it, it holds numbers only.
    thrower = Thrower.load(arguments.output / "model.npz")
    judged = judge(thrower, cases_of(settings, ice, 20))
    for who in ("agent", "planner", "best"):
        print(f"{who:8} misses by {judged[who]['mean_miss_with_error_m']:.2f} m on average")
    print(
        "agent over best: {ratio:.2f} ({low:.2f} to {high:.2f})".format(**judged["agent_over_best"])
    )

    speed, angle, spin, _ = thrower.throws(ice, tee(Direction.AWAY))[0]
    print(f"to the button: {speed:.3f} m/s, line {angle:+.4f} rad, spin {spin:+.2f} rad/s")


if __name__ == "__main__":
    main()
