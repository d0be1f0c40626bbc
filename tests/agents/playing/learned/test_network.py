"""The network that calls shots: its file, its possible calls, and its learning."""

from __future__ import annotations

import subprocess
import sys

import gymnasium
import numpy as np
import pytest

from agents.learning import read_model, write_model
from agents.playing import IMPOSSIBLE, LearnedPlayer, ShotNetwork
from agents.playing.learned.network import OF_A_STONE, OF_PLACES
from curling_env.envs import SHOTS
from curling_env.errors import InputError


def test_only_shots_that_there_are_are_called(network, called):
    seen, masks = called.observations[::6], called.masks[::6]
    shots, _ = network.predict(seen)
    assert masks[np.arange(len(shots)), shots].all()
    without = masks.copy()
    without[np.arange(len(shots)), shots] = 0
    others, _ = network.predict(seen, action_masks=without)
    assert without[np.arange(len(others)), others].all()
    one, _ = network.predict(seen[3], action_masks=without[3])
    assert one == others[3]
    drawn, _ = network.predict(seen, deterministic=False, rng=np.random.default_rng(0))
    assert masks[np.arange(len(drawn)), drawn].all()
    assert (drawn != shots).any()


def test_shots_that_there_are_not_are_impossible(network, called):
    worths = network.worths(network.seen(called.observations[::7]))
    np.testing.assert_array_equal(worths > IMPOSSIBLE, called.masks[::7] > 0)


def test_the_order_of_stones_does_not_matter(network, called):
    k = int(np.argmax(called.observations[:, -48::3].sum(axis=1)))
    seen = called.observations[k].copy()
    stones = seen[-48:].reshape(16, 3)
    stones[[0, 2]] = stones[[2, 0]]
    both = network.seen(np.stack([called.observations[k], seen]))
    before, after = network.worths(both)
    np.testing.assert_allclose(after[:OF_PLACES], before[:OF_PLACES], atol=0.02)
    of_first, of_third = (
        slice(OF_PLACES + OF_A_STONE * k, OF_PLACES + OF_A_STONE * (k + 1)) for k in (0, 2)
    )
    np.testing.assert_allclose(after[of_first], before[of_third], atol=0.02)


def test_a_file_gives_the_network_back_and_others_are_refused(network, called, tmp_path):
    network.save(tmp_path / "n.npz", learnt_from="nothing")
    back = ShotNetwork.load(tmp_path / "n.npz")
    seen = network.seen(called.observations[::9])
    there = seen.possible
    np.testing.assert_allclose(back.worths(seen)[there], network.worths(seen)[there], atol=0.05)
    document = read_model(tmp_path / "n.npz")
    write_model(tmp_path / "other.npz", {"weights": 1})
    with pytest.raises(InputError, match="no network|not a network"):
        ShotNetwork.load(tmp_path / "other.npz")
    broken = {**document["shots"], "through": document["shots"]["draws 1"]}
    write_model(tmp_path / "broken.npz", {"shots": broken})
    with pytest.raises(InputError, match="do not fit"):
        ShotNetwork.load(tmp_path / "broken.npz")
    document["shots"]["through"][0][:] = np.nan
    write_model(tmp_path / "nan.npz", document)
    with pytest.raises(InputError, match="not finite"):
        ShotNetwork.load(tmp_path / "nan.npz")


def test_a_player_makes_the_same_calls_as_the_network_in_the_environment(network):
    env = gymnasium.make("CurlingEnd-v0", opponent="rulebased", actions="shots").unwrapped
    player = LearnedPlayer(network)
    observation, info = env.reset(seed=3)
    over = False
    while not over:
        shot, _ = network.predict(observation, action_masks=info["action_mask"])
        assert player.call(env.simulator.view(env.state)) == env.call_of(shot)
        observation, _, over, _, info = env.step(shot)


def test_it_plays_from_the_hack_on_a_wider_sheet(network):
    options = {"ice": "fcv1", "rules": "digital_curling", "delivery": "hack"}
    env = gymnasium.make("CurlingEnd-v0", hammer="own", **options).unwrapped
    env.reset(seed=1)
    call = LearnedPlayer(network).call(env.simulator.view(env.state))
    assert call.shot in {shot.name for shot in SHOTS} | {"short"}


def test_using_a_network_needs_no_pytorch():
    program = "import sys; sys.modules['torch'] = None; import agents.playing.learned.player"
    assert subprocess.run([sys.executable, "-c", program]).returncode == 0
