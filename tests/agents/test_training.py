from __future__ import annotations

import json
import pickle
from pathlib import Path

import numpy as np
import pytest

from agents import training
from agents.evaluate import house_targets, misses, planner_throws, rest_in_env
from agents.models import read_model, write_model
from agents.training import TrainingSettings
from curling_env.errors import InputError
from curling_env.ice import load_ice
from curling_env.sheet import HOUSE_RADIUS, TEE_Y, Direction, tee
from curling_env.skill import SKILLS, skill_named
from curling_env.throw import Throw

TINY = {"network": (8, 8), "batch_size": 8, "checkpoint_every": 0, "target": "button"}


def tiny(**others: object) -> TrainingSettings:
    return TrainingSettings(**{"steps": 24, **TINY, **others})


# --- model files -------------------------------------------------------------------------------


def test_a_model_file_gives_back_what_was_written(tmp_path: Path) -> None:
    document = {
        "weights": {"layer.0": np.arange(6.0).reshape(2, 3), "count": np.array(3)},
        "state": {0: {"step": np.float32(2.0)}, 1: {}},
        "groups": [{"lr": 1e-3, "betas": (0.9, 0.999), "foreach": None}],
        "name": "sac",
    }
    write_model(tmp_path / "m.npz", document)
    back = read_model(tmp_path / "m.npz")
    np.testing.assert_array_equal(back["weights"]["layer.0"], document["weights"]["layer.0"])
    assert set(back["state"]) == {0, 1}
    assert float(back["state"][0]["step"]) == 2.0
    assert back["groups"] == [{"lr": 1e-3, "betas": [0.9, 0.999], "foreach": None}]


def test_objects_are_neither_written_nor_read(tmp_path: Path) -> None:
    with pytest.raises(TypeError):
        write_model(tmp_path / "m.npz", {"policy": print})
    with pytest.raises(TypeError):
        write_model(tmp_path / "m.npz", {"policy": np.array([print])})
    assert not (tmp_path / "m.npz").exists()

    class Evil:
        def __reduce__(self):
            return (Path(tmp_path / "ran").touch, ())

    (tmp_path / "p.npz").write_bytes(pickle.dumps(Evil()))
    np.savez(tmp_path / "q.npz", allow_pickle=True, document=np.array([Evil()], dtype=object))
    (tmp_path / "t.npz").write_text("not an archive")
    for name in ("p.npz", "q.npz", "t.npz", "missing.npz"):
        with pytest.raises(InputError):
            read_model(tmp_path / name)
    assert not (tmp_path / "ran").exists()


# --- skills ------------------------------------------------------------------------------------


def test_skills_order_from_exact_to_club(rng: np.random.Generator) -> None:
    sigmas = [SKILLS[name].sigma_speed for name in ("none", "elite", "champion", "club")]
    assert sigmas == sorted(sigmas)
    assert all(skill.source for skill in SKILLS.values())
    errors = SKILLS["club"].errors(4000, rng)
    np.testing.assert_allclose(errors.mean(axis=0), 0, atol=1e-12)
    np.testing.assert_allclose(errors.std(axis=0), [0.03, 0.0052, 0.2], rtol=0.05)
    assert not SKILLS["none"].errors(5, rng).any()
    with pytest.raises(InputError, match="champion"):
        skill_named("olympic")


# --- evaluation --------------------------------------------------------------------------------


def test_the_environment_throws_what_was_planned() -> None:
    ice = load_ice("standard")
    targets = np.array([[0.4, TEE_Y - 0.7], [-1.0, TEE_Y + 0.5]])
    throws = planner_throws(ice, targets, "none")
    for throw, target in zip(throws, targets, strict=True):
        speed, angle, spin, x = throw
        rest = rest_in_env(ice, Throw(speed=speed, angle=angle, spin=spin, x=x), target)
        assert np.hypot(*(rest - target)) < 5e-3


def test_house_targets_fill_the_house(rng: np.random.Generator) -> None:
    distance = np.hypot(*(house_targets(2000, rng) - tee(Direction.AWAY)).T)
    assert distance.max() <= HOUSE_RADIUS
    assert np.median(distance) == pytest.approx(HOUSE_RADIUS / np.sqrt(2), rel=0.05)


def test_misses_are_those_of_the_throws() -> None:
    ice = load_ice("standard")
    target = np.array([[0.0, TEE_Y]])
    throws = planner_throws(ice, target, "none")
    exact = misses(ice, throws, target, SKILLS["none"], seed=1)
    assert exact.exact[0] < 5e-3
    np.testing.assert_allclose(exact.with_error, exact.exact[0], atol=1e-9)
    off = misses(ice, throws + np.array([0.02, 0, 0, 0]), target, SKILLS["none"], seed=1)
    assert off.exact[0] == pytest.approx(0.6, abs=0.1)  # 0.30 m for 0.01 m/s


# --- training ----------------------------------------------------------------------------------


def test_execution_error_reaches_the_throw() -> None:
    ice = load_ice("standard")
    exact = training.make_env(ice, tiny(skill="none"))
    shaky = training.make_env(ice, tiny(skill="club"))
    speeds: dict[str, list[float]] = {"exact": [], "shaky": []}
    for name, env in (("exact", exact), ("shaky", shaky)):
        env.reset(seed=3)
        for _ in range(12):
            env.reset()
            *_, info = env.step(np.zeros(3, dtype=np.float32))
            speeds[name].append(info["throw"].speed)
    assert np.ptp(speeds["exact"]) == 0.0
    assert 0.01 < np.std(speeds["shaky"]) < 0.06


@pytest.mark.parametrize("algorithm", training.ALGORITHMS)
def test_trains_saves_and_loads(tmp_path: Path, algorithm: str) -> None:
    pytest.importorskip("stable_baselines3")
    settings = tiny(algorithm=algorithm)
    policy = training.train("standard", tmp_path, settings)
    loaded, saved = training.load_policy(tmp_path / "model.npz")
    assert saved == settings
    env = training.make_env(load_ice("standard"), settings)
    observation, _ = env.reset(seed=1)
    np.testing.assert_array_equal(
        policy.predict(observation, deterministic=True)[0],
        loaded.predict(observation, deterministic=True)[0],
    )


def test_resumes_from_a_checkpoint(tmp_path: Path) -> None:
    pytest.importorskip("stable_baselines3")
    training.train("standard", tmp_path, tiny(steps=20, checkpoint_every=10))
    checkpoint = tmp_path / "checkpoint-0000010.npz"
    assert (tmp_path / "checkpoint-0000020.npz").exists()
    seen: list[int] = []
    training.train(
        "standard", tmp_path / "on", tiny(steps=30, checkpoint_every=10), resume=checkpoint,
        tell=lambda steps, reward: seen.append(steps),
    )  # fmt: skip
    assert seen == list(range(11, 31))
    whole = read_model(tmp_path / "on" / "checkpoint-0000030.npz")
    assert len(whole["replay"]["rewards"]) == 30
    # The throws made before the checkpoint are still in the memory of the resumed run.
    before = read_model(checkpoint)["replay"]["actions"]
    np.testing.assert_array_equal(whole["replay"]["actions"][:10], before)
    with pytest.raises(InputError, match="network"):
        training.train("standard", tmp_path, tiny(network=(4,)), resume=checkpoint)
    with pytest.raises(InputError, match="finished model"):
        training.train("standard", tmp_path, tiny(), resume=tmp_path / "model.npz")


def test_the_same_seed_trains_the_same_agent(tmp_path: Path) -> None:
    pytest.importorskip("stable_baselines3")
    for name in ("a", "b"):
        training.train("standard", tmp_path / name, tiny(seed=5))
    a, b = (read_model(tmp_path / name / "model.npz")["policy"] for name in ("a", "b"))
    for key, value in a.items():
        np.testing.assert_array_equal(value, b[key])


@pytest.mark.parametrize(
    "wrong",
    [
        {"algorithm": "dqn"},
        {"target": "moon"},
        {"skill": "god"},
        {"steps": 0},
        {"learning_rate": 2.0},
        {"network": ()},
    ],
)
def test_refuses_settings_that_make_no_sense(wrong: dict[str, object]) -> None:
    with pytest.raises(InputError):
        tiny(**wrong)


def test_command_judges_the_agent_beside_the_planner(curling, tmp_path: Path) -> None:
    pytest.importorskip("stable_baselines3")
    result = curling(
        "train", "--ice", "standard", "-o", tmp_path / "run", "--steps", 40, "--target", "button",
        "--checkpoint-every", 0,
    )  # fmt: skip
    assert result.status == 0, result.err
    judged = result.json()
    assert judged == json.loads((tmp_path / "run" / "evaluation.json").read_text())
    assert judged["planner"]["mean_miss_m"] < 5e-3
    # Forty throws teach little: the planner throws the same errors and misses less.
    assert judged["agent_over_planner_with_error"] > 1.0
    assert "planner" in result.err


def test_command_refuses_in_one_line(curling, tmp_path: Path) -> None:
    (tmp_path / "not.npz").write_text("nothing")
    for arguments, words in (
        (["--algorithm", "dqn"], "algorithm must be one of sac, td3, ppo"),
        (["--ice", "nowhere.json"], "nowhere.json"),
        (["--resume", tmp_path / "not.npz"], "not.npz: is not a trained model"),
    ):
        full = ["train", "-o", tmp_path / "run", "--steps", 10, *arguments]
        assert words in curling(*full).complaint
