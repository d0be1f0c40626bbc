"""Public readers by name: Python functions that take an untrusted file."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path


def readers() -> dict[str, Callable[[Path], object]]:
    """Return the readers."""
    from agents import TrainedPolicy
    from agents.digital_curling.dc4.web_host import read_passwords
    from agents.learning.configuration import load_settings
    from agents.planning import read_stones
    from agents.playing import read_record
    from agents.playing.replay.page import page_of
    from agents.playing.search.value_network import load_network
    from curling_env import load_ice, read_releases
    from friction_estimation import load_scene
    from friction_estimation.camera import load_lens
    from friction_estimation.camera.pose import camera_from_scene
    from friction_estimation.donation import read_session
    from friction_estimation.estimation.evidence_file import load_evidence
    from friction_estimation.film.pictures import read_picture
    from friction_estimation.film.video import Film
    from friction_estimation.tracks.importers import read_export
    from friction_estimation.tracks.throw_list import load_tracks, throws_beside

    def film(path: Path) -> int:
        opened = Film.open(path)
        opened.sample(5)
        opened.part(0.2, 0.8).pick([0, 2])
        return sum(1 for _ in opened.frames())

    def evidence(path: Path) -> object:
        ice = path.with_name("e.json")
        return load_evidence(load_ice(ice), ice)

    return {
        "ice": load_ice,
        "releases": read_releases,
        "session": read_session,
        "tracks": load_tracks,
        "notes": lambda path: throws_beside(path.with_name("t.csv")),
        "scene": lambda path: camera_from_scene(load_scene(path), (60, 120)),
        "lens": load_lens,
        "stones": read_stones,
        "passwords": read_passwords,
        "game": lambda path: page_of(read_record(path)),
        "picture": read_picture,
        "film": film,
        "export": read_export,
        "configuration": load_settings,
        "network": load_network,
        "model": TrainedPolicy.load,
        "evidence": evidence,
    }
