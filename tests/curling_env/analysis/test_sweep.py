"""Sweeps give the same numbers on any workers, however many of them are killed."""

from __future__ import annotations

import importlib
import math
import multiprocessing
import os
import sys
from pathlib import Path

import numpy as np
import pytest

from curling_env.analysis import Sweep, run
from curling_env.analysis.sweep import PIECE_SIZE, executed, throw_piece
from curling_env.benchmarks.throws import draws_and_hits
from curling_env.errors import InputError
from curling_env.ice import load_ice
from curling_env.infrastructure import ProcessExecutor, WorkersLostError, read_table
from curling_env.infrastructure.executor import executor
from curling_env.throw import SKILLS, Throw, write_releases


def a_sweep(throws: int = 2 * PIECE_SIZE + 100, **options) -> Sweep:
    releases = draws_and_hits(np.random.default_rng(4), throws, hits=0.2)
    options = {
        "ices": [load_ice("standard"), load_ice("paper")],
        "seeds": (3, 8),
        "skill": "club",
        **options,
    }
    return Sweep(releases=releases, **options)


def assert_same(a, b) -> None:
    for name in ("x", "y", "theta", "time", "end"):
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name))


DEADLY = """
import os, signal
from curling_env.analysis.sweep import throw_piece

KNIFE = {knife!r}

def throw_or_die(piece):
    # The worker that finds the file is killed, in the middle of a piece and of the sweep.
    if piece.place == 1 and piece.seeds == (8,):
        try:
            os.remove(KNIFE)
        except FileNotFoundError:
            return throw_piece(piece)
        os.kill(os.getpid(), signal.SIGKILL)
    return throw_piece(piece)
"""


@pytest.fixture
def knife(tmp_path, monkeypatch) -> Path:
    """Return a file that makes one worker of the next sweep be killed, and then disappears."""
    path = tmp_path / "knife"
    path.touch()
    (tmp_path / "deadly.py").write_text(DEADLY.format(knife=str(path)))
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "deadly", raising=False)
    # Here only: the workers import the module again, unpatched.
    monkeypatch.setattr(
        "curling_env.analysis.sweep.throw_piece", importlib.import_module("deadly").throw_or_die
    )
    return path


# --- what a sweep is ------------------------------------------------------------------------------


def test_every_ice_sees_the_same_errors_and_every_seed_others():
    ends = run(a_sweep(200, ices=[load_ice("standard"), load_ice("standard"), load_ice("paper")]))
    assert ends.x.shape == (3, 2, 200)
    np.testing.assert_array_equal(ends.x[0], ends.x[1])
    assert np.abs(ends.x[0] - ends.x[2]).max() > 0.1
    assert np.abs(ends.x[:, 0] - ends.x[:, 1]).min() < np.abs(ends.x[:, 0] - ends.x[:, 1]).max()
    exact = run(a_sweep(200, skill="none"))
    np.testing.assert_array_equal(exact.x[:, 0], exact.x[:, 1])


def test_a_piece_has_the_randomness_of_its_seed_and_place():
    sweep = a_sweep()
    pieces = list(sweep.pieces())
    assert len(pieces) == sweep.piece_count == 12
    piece = pieces[4]  # the second of the first ice's second seed
    child = np.random.SeedSequence(8).spawn(2)[1]
    made = executed(piece.releases, SKILLS["club"], np.random.default_rng(child))
    whole = run(sweep)
    again = throw_piece(piece)
    np.testing.assert_array_equal(whole.y[0, 1, PIECE_SIZE : 2 * PIECE_SIZE], again.y)
    assert np.std(np.hypot(made["vx"], made["vy"]) - np.hypot(
        piece.releases["vx"], piece.releases["vy"])) == pytest.approx(0.03, rel=0.05)  # fmt: skip
    turned = np.arctan2(made["vx"], made["vy"]) - np.arctan2(
        piece.releases["vx"], piece.releases["vy"]
    )
    assert np.std(turned) == pytest.approx(0.0052, rel=0.05)
    assert np.std(made["omega"] - piece.releases["omega"]) == pytest.approx(0.2, rel=0.05)


def test_few_throws_with_many_seeds_go_together():
    sweep = a_sweep(3, seeds=range(3000))
    assert sweep.piece_count == len(list(sweep.pieces())) == 2 * 3
    ends = run(sweep)
    for seed in (0, 1364, 1365, 2999):
        alone = run(a_sweep(3, seeds=(seed,)))
        np.testing.assert_array_equal(ends.x[:, seed], alone.x[:, 0])


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"ices": []}, "one of the ices"),
        ({"seeds": ()}, "one of the seeds"),
        ({"throws": 0}, "one of the releases"),
        ({"seeds": (-1,)}, "at least 0"),
        ({"skill": "god"}, "unknown skill"),
    ],
)
def test_invalid_values_are_refused(options, says):
    with pytest.raises(InputError, match=says):
        a_sweep(**{"throws": 3, **options})


# --- whoever does it ------------------------------------------------------------------------------


@pytest.mark.parametrize("workers", ["0", "-2", "many", "ray:/x", "²"])
def test_workers_that_make_no_sense_are_refused(workers):
    with pytest.raises(InputError, match="workers must be"), executor(workers):
        pass


def test_results_come_in_order_and_errors_as_they_are():
    for workers in (1, 2):
        with executor(workers) as crew:
            assert list(crew.map(math.factorial, range(30))) == [
                math.factorial(k) for k in range(30)
            ]
            with pytest.raises(ValueError, match="negative"):
                list(crew.map(math.factorial, [3, 4, -1, 5]))
            assert list(crew.map(math.factorial, [])) == []


def test_bad_input_in_a_worker_is_reported_as_in_this_process():
    sweep = a_sweep(10)
    sweep.releases["vx"][3] = np.nan
    for workers in (1, 2):
        with executor(workers) as crew, pytest.raises(InputError, match="finite"):
            run(sweep, crew)


def test_a_piece_that_kills_its_workers_is_given_up():
    with pytest.raises(WorkersLostError, match="died"):
        list(ProcessExecutor(1).map(os._exit, [1]))


def test_processes_give_the_same_numbers_after_one_was_killed(knife):
    sweep = a_sweep()
    with executor(2) as crew:
        ends = run(sweep, crew)
    assert not knife.exists()
    assert_same(ends, run(sweep))
    assert multiprocessing.active_children() == []


@pytest.mark.slow
def test_a_ray_cluster_gives_the_same_numbers_after_a_worker_was_killed(knife, monkeypatch):
    ray = pytest.importorskip("ray")
    monkeypatch.setenv("RAY_USAGE_STATS_ENABLED", "0")
    sweep = a_sweep()
    knife.unlink()
    alone = run(sweep)  # also compiles, once for all
    knife.touch()
    ray.cloudpickle.register_pickle_by_value(sys.modules["deadly"])
    ray.init(
        "local", num_cpus=1, include_dashboard=False, log_to_driver=False,
        object_store_memory=100_000_000, _node_ip_address="127.0.0.1",
    )  # fmt: skip
    try:
        with executor("ray") as crew:
            ends = run(sweep, crew)
            spoilt = a_sweep(10)
            spoilt.releases["vx"][3] = np.nan
            with pytest.raises(InputError, match="finite"):
                run(spoilt, crew)
        assert ray.is_initialized()  # not this executor's to end
    finally:
        ray.shutdown()
    assert not knife.exists()
    assert_same(ends, alone)


def test_without_ray_one_line_reports_the_missing_package(curling, monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "ray", None)
    path = tmp_path / "r.csv"
    write_releases(path, [Throw(speed=2.1).release()])
    result = curling("sweep", "--releases", path, "--workers", "ray", "-o", tmp_path / "e.csv")
    assert "curling-sheet[ray]" in result.complaint
    assert not (tmp_path / "e.csv").exists()


# --- the command ----------------------------------------------------------------------------------


def test_the_command_writes_where_the_stones_ended(curling, tmp_path):
    releases = [Throw(speed=v, angle=-0.05, spin=1.0).release() for v in (1.9, 2.1, 4.0)]
    write_releases(tmp_path / "r.csv", releases)
    common = ("sweep", "--releases", tmp_path / "r.csv", "--ice", "standard", "--ice", "fcv1",
              "--skill", "club", "--seeds", 4, "--seed", 5)  # fmt: skip
    for workers in (1, 2):
        result = curling(*common, "--workers", workers, "-o", tmp_path / f"{workers}.csv")
        assert result.status == 0, result.err
    assert (tmp_path / "1.csv").read_text() == (tmp_path / "2.csv").read_text()
    table = read_table(tmp_path / "1.csv", required=("ice", "seed", "throw", "x", "y", "end"))
    assert len(table) == 2 * 4 * 3
    assert set(table.integers("seed").tolist()) == {5, 6, 7, 8}
    assert set(table.text("end")) == {"rest", "left_bounds"}
    ends = run(
        Sweep(ices=[load_ice("standard")], releases=releases, seeds=range(5, 9), skill="club")
    )
    np.testing.assert_allclose(table.numbers("y")[:12], ends.y.ravel(), atol=1e-6)


def test_the_command_refuses_in_one_line(curling, tmp_path):
    write_releases(tmp_path / "r.csv", [Throw(speed=2.1).release()])
    for arguments, words in (
        (["--workers", "lots"], "workers must be a number of processes"),
        (["--skill", "god"], "unknown skill 'god'"),
        (["--ice", "nowhere.json"], "nowhere.json"),
    ):
        full = ["sweep", "--releases", tmp_path / "r.csv", "-o", tmp_path / "e.csv", *arguments]
        assert words in curling(*full).complaint
