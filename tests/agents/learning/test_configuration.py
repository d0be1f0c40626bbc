"""Valid and invalid configurations."""

from __future__ import annotations

from pathlib import Path

import pytest

pytest.importorskip("stable_baselines3")
pytest.importorskip("yaml")

from agents.learning import (
    load_settings,
    read_configuration,
    schedule_of,
    settings_from,
)
from agents.learning.configuration import configurations
from agents.playing import league_settings
from curling_env.envs.random_ice import RandomIces
from curling_env.errors import InputError

LEAGUES = [name for name in configurations() if "league" in name]


@pytest.mark.parametrize("name", sorted(set(configurations()) - set(LEAGUES)))
def test_the_projects_own_are_whole_and_come_back_from_their_document(name: str) -> None:
    settings = load_settings(name, seed=3)
    assert settings.seed == 3
    assert settings_from(settings.as_dict()) == settings


@pytest.mark.parametrize("name", LEAGUES)
def test_leagues_are_whole(name: str) -> None:
    league_settings(read_configuration(name))
    with pytest.raises(InputError, match="algorithm"):
        load_settings(name)


def test_a_file_states_what_is_learned(tmp_path: Path) -> None:
    (tmp_path / "mine.yml").write_text(
        "algorithm: ppo\nn_timesteps: 64\nlearning_rate: lin_1e-3\nent_coef: 1e-3\n"
        "policy_kwargs: {net_arch: [8, 8]}\n"
        "ices: {level: 0.05}\nenv_kwargs: {throw_range: {speed: [1.8, 2.4]}}\n"
    )
    settings = load_settings(tmp_path / "mine.yml")
    assert settings.ices == RandomIces(level=0.05)
    assert settings.environment()["throw_range"].speed == (1.8, 2.4)
    assert settings.hyperparameters["ent_coef"] == 1e-3  # YAML itself reads that as text
    falling = schedule_of(settings.hyperparameters["learning_rate"])
    assert [falling(part) for part in (1.0, 0.5, 0.0)] == [1e-3, 5e-4, 0.0]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("algorithm: dqn", "algorithm must be one of sac, td3, ppo"),
        ("algorithm: ppo\nlerning_rate: 1", "unknown key 'lerning_rate'"),
        ("algorithm: ppo\nbuffer_size: 10", "unknown key 'buffer_size'"),  # SAC's, not PPO's
        ("env_kwargs: {colour: red}", "unknown key 'colour' in env_kwargs"),
        ("env_kwargs: {throw_range: {pace: [1, 2]}}", "throw_range has no 'pace'"),
        ("env_kwargs: {throw_range: {speed: [2, 1]}}", "must rise"),
        ("ices: {slope: 1}", "ices has no 'slope'"),
        ("ices: {level: much}", "level must lie within 0 and 1"),
        ("policy_kwargs: {net_arch: [0]}", "net_arch"),
        ("policy_kwargs: {width: 3}", "unknown key 'width' in policy_kwargs"),
        ("learning_rate: lin_fast", "expected a schedule such as lin_"),
        ("n_timesteps: many", "n_timesteps must be a whole number"),
        ("skill: god", "unknown skill 'god'"),
        ("knows: all", "knows must be one of"),
        ("- a\n- b", "expected settings by name"),
        ("a: [1", "not YAML"),
    ],
)
def test_unknown_options_are_refused_in_one_line(tmp_path: Path, text: str, words: str) -> None:
    (tmp_path / "mine.yml").write_text(text)
    with pytest.raises(InputError) as caught:
        load_settings(tmp_path / "mine.yml")
    assert words in str(caught.value)
    assert "mine.yml" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_no_such_configuration_names_those_there_are() -> None:
    with pytest.raises(InputError, match="house-one-ice"):
        load_settings("nowhere")
