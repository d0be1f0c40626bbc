"""Complete training run: train a policy to draw, evaluate it, throw with it.

    python scripts/train.py --config button-one-ice -o runs/button

`curling train` does the same with a progress bar; this script shows the few calls behind it.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from agents import TrainedPolicy, evaluate, train
from agents.learning.configuration import load_settings, with_settings
from curling_env import Direction, load_ice
from curling_env.sheet import tee


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--config", default="button-one-ice", help="a name or a YAML file")
    parser.add_argument("--ice", default="standard")
    parser.add_argument("--steps", type=int, help="throws to learn from; by default as configured")
    parser.add_argument("-o", "--output", type=Path, default=Path("runs/train"))
    arguments = parser.parse_args()

    settings = with_settings(load_settings(arguments.config), n_timesteps=arguments.steps)
    ice = load_ice(arguments.ice)
    train(settings, arguments.output, ice)

    # From here on only the model file is needed. It holds numbers only, so loading it is safe.
    policy = TrainedPolicy.load(arguments.output / "model.npz")
    result = evaluate(policy, ice, draws=20)
    for who in ("agent", "planner", "best"):
        print(f"{who:8} misses by {result[who]['mean_miss_with_error_m']:.2f} m on average")
    print(
        "agent over best: {ratio:.2f} ({low:.2f} to {high:.2f})".format(**result["agent_over_best"])
    )

    throw = policy.throw(ice, tee(Direction.AWAY))
    print(
        f"to the button: {throw.speed:.3f} m/s, line {throw.angle:+.4f} rad, "
        f"spin {throw.spin:+.2f} rad/s"
    )


if __name__ == "__main__":
    main()
