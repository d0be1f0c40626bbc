"""The public interface of the package, used as by a new user."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import agents
from curling_env import load_ice, simulate
from curling_env.errors import InputError
from curling_env.physics import slide
from curling_env.sheet import TEE_Y


def test_importing_the_package_imports_no_learning_library() -> None:
    heavy = "torch", "stable_baselines3", "matplotlib", "cv2"
    code = (
        f"import sys, agents; agents.plan_throw; print([m for m in {heavy!r} if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_every_public_name_is_there_and_documented() -> None:
    for name in agents.__all__:
        assert getattr(agents, name).__doc__
        assert name in dir(agents)
    with pytest.raises(AttributeError, match="nonsense"):
        _ = agents.nonsense  # pyright: ignore[reportAttributeAccessIssue]


def test_a_planned_throw_can_be_simulated_and_rests_at_its_target() -> None:
    plan = agents.plan_throw("standard", (0.3, 17.0), skill="none")
    assert isinstance(plan, agents.Plan)
    release = plan.best.throw.release(plan.direction)
    rest = slide(load_ice("standard"), release)
    assert np.hypot(rest.x - 0.3, rest.y - 17.0) < 5e-3
    (track,) = simulate("standard", [release])
    assert np.hypot(track.xy[-1, 0] - 0.3, track.xy[-1, 1] - 17.0) < 0.02


def test_a_task_is_planned_among_stones() -> None:
    stones = [(0.3, 17.6), (0.0, 14.1)]
    plan = agents.plan_throw("standard", "takeout", mark=(0.3, 17.6), stones=stones, skill="none")
    assert plan.best.trials.success.all()
    assert np.isnan(plan.best.stones[0]).all()  # the stone has left play
    with pytest.raises(InputError, match="juggle"):
        agents.plan_throw("standard", "juggle")


def test_a_policy_is_trained_and_evaluated(tmp_path: Path) -> None:
    pytest.importorskip("stable_baselines3")
    from agents.learning import load_settings

    seen: list[float] = []
    policy = agents.train(
        load_settings("button-one-ice", n_timesteps=4096, checkpoint_every=0),
        tmp_path,
        progress=lambda what, done, total=1.0: seen.append(done / total),
    )
    assert seen == sorted(seen)
    assert seen[-1] == 1.0
    throw = policy.throw(load_ice("standard"), (0.0, TEE_Y))
    assert 1.5 <= throw.speed <= 2.5
    result = agents.evaluate(tmp_path / "model.npz", draws=3)
    assert result["draws"] == 1  # the same ice and target every time
    assert result["agent"]["mean_miss_m"] > result["planner"]["mean_miss_m"]
    assert result == agents.evaluate(policy, draws=3)
