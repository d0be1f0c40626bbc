"""The public readers by name: what programs in Python call with a file that a stranger has made."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path


def read(name: str, path: Path) -> int:
    """Read a file as a program would; a status as of `curling`, with its one line."""
    from curling_env.errors import CurlingError
    from curling_env.infrastructure.streams import only_our_words

    try:
        with only_our_words():  # libpng speaks for itself; a program may let it or not
            READERS[name](path)
    except CurlingError as error:
        print("curling:", " ".join(str(error).split())[:290], file=sys.stderr)
        return 2
    return 0


def _ice(path: Path) -> object:
    from curling_env import load_ice

    return load_ice(path)


def _releases(path: Path) -> object:
    from curling_env import read_releases

    return read_releases(path)


def _tracks(path: Path) -> object:
    from friction_estimation.tracks.throw_list import load_tracks

    return load_tracks(path)


def _session(path: Path) -> object:
    from friction_estimation.donation import read_session

    return read_session(path)


def _notes(path: Path) -> object:
    from friction_estimation.tracks.throw_list import throws_beside

    return throws_beside(path.with_name("t.csv"))


def _scene(path: Path) -> object:
    from friction_estimation import load_scene
    from friction_estimation.camera.pose import camera_from_scene

    return camera_from_scene(load_scene(path), (60, 120))


def _lens(path: Path) -> object:
    from friction_estimation.camera.scene import load_lens

    return load_lens(path)


def _stones(path: Path) -> object:
    from agents.planning.stones_file import read_stones

    return read_stones(path)


def _passwords(path: Path) -> object:
    from agents.digital_curling.dc4.web_host import read_passwords

    return read_passwords(path)


def _game(path: Path) -> object:
    from agents.playing.record import read_record
    from agents.playing.replay.page import page_of

    return page_of(read_record(path))


def _picture(path: Path) -> object:
    from friction_estimation.film.pictures import read_picture

    return read_picture(path)


def _film(path: Path) -> object:
    from friction_estimation.film.video import Film

    film = Film.open(path)
    film.sample(5)
    film.part(0.2, 0.8).pick([0, 2])
    return sum(1 for _ in film.frames())


def _export(path: Path) -> object:
    from friction_estimation.tracks.importers import read_export

    return read_export(path)


def _configuration(path: Path) -> object:
    from agents.learning.configuration import load_settings

    return load_settings(path)


def _network(path: Path) -> object:
    from agents.playing.search.value_network import load_network

    return load_network(path)


def _model(path: Path) -> object:
    from agents import TrainedPolicy

    return TrainedPolicy.load(path)


def _evidence(path: Path) -> object:
    from curling_env import load_ice
    from friction_estimation.estimation.evidence_file import load_evidence

    ice = path.with_name("e.json")
    return load_evidence(load_ice(ice), ice)


READERS: dict[str, Callable[[Path], object]] = {
    "ice": _ice,
    "releases": _releases,
    "session": _session,
    "tracks": _tracks,
    "notes": _notes,
    "scene": _scene,
    "lens": _lens,
    "stones": _stones,
    "passwords": _passwords,
    "game": _game,
    "picture": _picture,
    "film": _film,
    "export": _export,
    "configuration": _configuration,
    "network": _network,
    "model": _model,
    "evidence": _evidence,
}
