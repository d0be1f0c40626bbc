"""Valid files for the fuzzer to damage: small, and made by the program itself."""

from __future__ import annotations

import contextlib
import io
import json
from pathlib import Path

KINOVEA = 'Time (ms),"stone/0/X","stone/0/Y"\n' + "".join(
    f'{33 * k},"{0.01 * k:.3f}","{1.5 * k / 10:.3f}"\n' for k in range(12)
)
TRACKER = "mass A\nt\tx\ty\n" + "".join(f"{k / 30:.4f}\t{k / 10}\t0.0\n" for k in range(12))
CONFIGURATION = """algorithm: ppo
n_timesteps: 16
n_envs: 8
policy: MlpPolicy
policy_kwargs: {net_arch: [4], log_std_init: -1.0}
normalize: true
env_kwargs:
  target: [0.0, 0.0]
  throw_range: {speed: [1.5, 2.5], angle: [-0.15, 0.15], spin: [0.5, 1.5]}
skill: club
gamma: 0.0
n_steps: 2
batch_size: 8
n_epochs: 1
learning_rate: lin_1e-2
"""
LEAGUE = (
    "algorithm: league\ngenerations: [2]\ntried: 8\nlayers: [4, 4, 4, 4]\nepochs: 1\nseed: 0\n"
    "ice: standard\nskill: elite\nrules: world_curling_2024\n"
)
SCENE = {
    "corners_px": {
        "home_left": [5, 115],
        "home_right": [55, 115],
        "away_right": [45, 5],
        "away_left": [15, 5],
    },
    "stone": {"radius": 0.145},
}
REQUEST = {"clicks": SCENE["corners_px"], "still": 0, "paint": True}
"""Request of the page of `curling corners`."""
EFFECTS = [
    {"name": "curl", "parameters": {"strength": 0.008}, "sigma": {"strength": 0.0005}},
    {"name": "air_drag", "parameters": {"coefficient": 0.00095}, "believed": []},
]
SLIDING = "throw,x,y,vx,vy,theta,omega\n0,0.2,-2.0,0.0,1.7,0.0,1.2\n"
FILM = "film --ice standard --releases @one.csv --fps 6 --noise 0.5 --size 384x216 --camera gantry"
"""Throw whose film of 126 small frames can be tracked."""
TEXTS = {
    "one.csv": SLIDING,
    "k.csv": KINOVEA,
    "k.txt": TRACKER,
    "c.yml": CONFIGURATION,
    "l.yml": LEAGUE,
    "s.json": json.dumps(SCENE),
    "q.json": json.dumps(REQUEST),
    "st.json": '[{"x": 0.3, "y": 17.0, "team": "own"}, {"x": -1, "y": 16.5}]',
    "p.json": '{"anna": "keen ice", "ben": "heavy ice"}',
    "throws.csv": "throw,athlete,stone,called,note\n"
    '0,Anna,1,"draw 0.2,-1 in",\n1,Bo,2,guard,x\n2,Anna,2,draw top four,\n',
    "athletes.csv": "athlete,hand\nAnna,left\n",
    "skill.json": json.dumps(
        {
            "format": "curling-skill/1",
            "name": "Anna",
            "sigma_speed": 0.03,
            "sigma_angle": 0.005,
            "sigma_spin": 0.2,
        }
    ),
}


def make_good_files(folder: Path, *, light: bool = False) -> dict[str, bytes]:
    """Make every good file in a folder, which also compiles what commands need.

    Parameters
    ----------
    light : without estimates and models, which take a minute

    Returns
    -------
    contents by name

    Raises
    ------
    RuntimeError : a good file is refused
    """
    for name, text in TEXTS.items():
        (folder / name).write_text(text)
    _ices_and_throws(folder)
    _game(folder)
    _pictures(folder)
    _films(folder)
    if not light:
        _curling(folder, "estimate @t.csv --uniform --effects none -o @e.json")
        _models(folder)
    return {p.name: p.read_bytes() for p in folder.iterdir() if p.is_file() and p.name[0] != "."}


def _curling(folder: Path, line: str) -> None:
    """Run a command; ``@`` in its line stands for the folder."""
    from curling_env.commands.cli import main

    words = [word.replace("@", f"{folder}/") for word in line.split()]
    errors = io.StringIO()
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(errors):
        status = main(words)
    if status:
        raise RuntimeError(f"{line}: {errors.getvalue()}")


def _ices_and_throws(folder: Path) -> None:
    """Make a uniform ice, one with effects, releases, and their tracks."""
    from curling_env.ice import Ice, save_ice
    from curling_env.throw import Throw, write_releases

    throws = [
        Throw(speed=2.0 + 0.05 * k, angle=0.01 * k, spin=1.2 * (-1) ** k).release(clock=40.0 * k)
        for k in range(3)
    ]
    write_releases(folder / "r.csv", throws)
    save_ice(Ice.uniform(0.009), folder / "ice.json")
    document = json.loads((folder / "ice.json").read_text())
    document["friction"] |= {"mu": 0.009, "sigma": 0.0001, "observed": 1}
    (folder / "full.json").write_text(json.dumps(document | {"effects": EFFECTS}))
    _curling(folder, "simulate --ice standard --releases @r.csv --fps 6 -o @t.csv")
    _curling(folder, "throw --ice @full.json --speed 2.1")
    consent = "All-who-threw-agree-to-this"
    _curling(folder, f"donate @t.csv --scene @s.json --consent {consent} -o @session.json")


def _game(folder: Path) -> None:
    _curling(folder, "play --home draw --away draw --ends 1 -o @game")
    (folder / "g.jsonl").write_bytes((folder / "game" / "game.jsonl").read_bytes())


def _pictures(folder: Path) -> None:
    """Make a small picture of a house, and the same with a stone."""
    import cv2
    import numpy as np

    rng = np.random.default_rng(0)
    empty = (200 + rng.normal(0, 2, (120, 60, 3))).clip(0, 255).astype(np.uint8)
    cv2.circle(empty, (30, 30), 25, (200, 80, 40), 3)
    now = empty.copy()
    cv2.circle(now, (40, 50), 6, (60, 60, 60), -1)
    for name, picture in (("e.png", empty), ("n.png", now)):
        (folder / name).write_bytes(cv2.imencode(".png", picture)[1].tobytes())


def _films(folder: Path) -> None:
    """Make a film of a throw, twice, with its scene, its lens and the times of its frames."""
    from friction_estimation.film.video import Film

    _curling(folder, f"{FILM} -o @films")
    films = folder / "films"
    for name in ("f.mp4", "g.mp4"):
        (folder / name).write_bytes((films / "gantry-0.mp4").read_bytes())
    (folder / "hall.json").write_bytes((films / "gantry.scene.json").read_bytes())
    camera = json.loads((films / "gantry.truth.json").read_text())["camera"]
    lens = {"camera_matrix": camera["matrix"], "distortion": camera["distortion"]}
    (folder / "cam.json").write_text(json.dumps(lens))
    (folder / "turned.mp4").write_bytes(_turned(folder / "f.mp4"))
    frames = Film.open(folder / "f.mp4").frame_count
    times = "".join(f"{k / 6}\n" for k in range(frames))
    (folder / "f.mp4.times.csv").write_text(f"t\n{times}")


def _turned(film: Path) -> bytes:
    """Make a film whose frames change their size in the middle, from two films."""
    import av

    with av.open(str(film)) as container:
        frames = list(container.decode(video=0))[:40]
    parts: list[bytes] = []
    for half, (width, height) in ((frames[:20], (384, 216)), (frames[20:], (216, 384))):
        part = io.BytesIO()
        with av.open(part, "w", format="mpegts") as out:
            stream = out.add_stream("libx264", rate=6)
            stream.width, stream.height, stream.pix_fmt = width, height, "yuv420p"
            for frame in half:
                picture = frame.reformat(width, height, "yuv420p")
                picture.pts, picture.time_base = frame.pts, frame.time_base
                out.mux(stream.encode(picture))
            out.mux(stream.encode(None))
        parts.append(part.getvalue())
    return b"".join(parts)


def _models(folder: Path) -> None:
    """Make a network that plays, and a checkpoint."""
    import yaml

    from agents.learning.configuration import settings_from
    from agents.learning.training import train
    from agents.playing.search.value_network import load_network, save_network

    save_network(folder / "net.npz", load_network())
    settings = settings_from(yaml.safe_load(CONFIGURATION), checkpoint_every=16, n_timesteps=48)
    train(settings, folder / "train")
    (folder / "c.npz").write_bytes(sorted((folder / "train").glob("checkpoint-*"))[-1].read_bytes())
