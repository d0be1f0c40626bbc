"""What is fuzzed: commands with small real files, made by the program itself."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

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


@dataclass(frozen=True, kw_only=True)
class Target:
    """A command and its files.

    Parameters
    ----------
    name : what is fuzzed
    arguments : what follows `curling`; names of files are those of `files`
    files : the good files by name, of which one at a time is damaged
    damaged : names of the files that are damaged
    weight : how often it is chosen
    """

    name: str
    arguments: Sequence[str]
    files: dict[str, bytes]
    damaged: Sequence[str]
    weight: float = 1.0


OPTIONS: tuple[Sequence[str], ...] = (
    ("throw", "--ice", "standard", "--speed", "2.1", "--angle", "0.1", "--spin", "1", "--x", "0.1"),
    ("plan", "--ice", "standard", "--target", "0,17.3", "--skill", "elite", "--spin", "1", "--x",
     "0"),
    ("plan", "--ice", "standard", "--task", "draw", "--target", "0,17.3", "--seed", "3"),
    ("design", "--resolution", "4", "--precision", "5", "--noise", "0.005", "--fps", "30",
     "--mu", "0.009", "--spread", "5", "--speeds", "1.8,2.2"),
    ("simulate", "--ice", "standard", "--releases", "r.csv", "--fps", "10", "-o", "o.csv"),
    ("sweep", "--ice", "standard", "--releases", "r.csv", "--seeds", "2", "--seed", "1", "--skill",
     "club", "--workers", "1", "-o", "o.csv"),
    ("convert", "k.csv", "--unit", "cm", "--origin", "0,-17", "--along", "x", "-o", "o.csv"),
    ("compare", "t.csv", "--ice", "ice.json", "--window", "2"),
    ("play", "--home", "draw", "--away", "draw", "--ends", "1", "--rules", "world_curling_2024",
     "--skill", "elite", "--hammer", "home", "--seed", "2", "--json"),
    ("tournament", "draw", "draw", "--games", "1", "--ends", "1", "--seed", "0", "--json"),
    ("replay", "g.jsonl", "--end", "1", "--speed", "90", "-o", "o.mp4"),
    ("calibrate", "e.png", "--squares", "9x7", "--square-size", "0.03", "--board", "chessboard",
     "-o", "o.json"),
    ("locate", "e.png", "--mark", "away_tee=30,30", "--mark", "away_hog_centre=30,90", "--height",
     "5", "-o", "o.json"),
    ("stones", "n.png", "--empty", "e.png", "--scene", "s.json", "-o", "o.json"),
    ("track", "f.mp4", "--scene", "s.json", "-o", "o.csv"),
    ("film", "--ice", "standard", "--releases", "r.csv", "--camera", "end", "--fps", "2", "--size",
     "64x48", "--noise", "2", "-o", "films"),
    ("estimate", "t.csv", "-o", "o.json", "--seed", "1"),
    ("train", "--config", "c.yml", "--steps", "8", "--targets", "1", "--seed", "0", "-o", "runs"),
    ("throws", "t.csv", "--units", "feet", "-o", "o.csv"),
    ("join-cameras", "f.mp4", "g.mp4", "--scene", "s.json", "--scene", "s.json", "-o", "o.csv"),
    ("corners", "e.png", "--start", "s.json", "--sheet", "44.5x4.5", "--port", "0", "--no-browser",
     "-o", "o.json"),
    ("live", "0", "--scene", "s.json", "--throws", "1", "-o", "o.csv"),
    ("demo", "--throws", "0", "--workers", "1", "--seed", "0", "-o", "demo"),
    ("discover", "t.csv", "--known-length", "21.3,21.9", "--clock", "20,24", "-o", "found"),
)  # fmt: skip
"""Command lines of which single words are replaced. `bench` reads nothing and takes no value; what
`demo` has here is refused, because a whole run takes a minute."""


JOIN = "join-cameras f.mp4 g.mp4 --scene s.json --scene s.json -o o.csv"
CORNERS = "corners e.png --no-browser -o o.json"
LIVE = "live file://{here}/f.mp4 --scene s.json --throws 1 --keep kept -o o.csv"
READ = (
    ("ice", "ice.json"),
    ("ice", "full.json"),
    ("releases", "r.csv"),
    ("tracks", "t.csv"),
    ("notes", "throws.csv"),
    ("scene", "s.json"),
    ("lens", "cam.json"),
    ("stones", "st.json"),
    ("game", "g.jsonl"),
    ("picture", "e.png"),
    ("film", "f.mp4"),
    ("export", "k.csv"),
    ("export", "k.txt"),
    ("configuration", "c.yml"),
    ("network", "net.npz"),
    ("model", "c.npz"),
    ("evidence", "e.evidence.npz"),
)
"""Readers of `readers.READERS`, and the file that each is given."""
HEAVY = frozenset({"estimate", "discover", "train", "league", "resume", "tournament", "design"})
"""Commands that take seconds a run."""


def make_targets(folder: Path, *, light: bool = False) -> list[Target]:
    """All targets; the files are made in a folder, which also compiles what they need.

    Raises
    ------
    RuntimeError : a good file is refused
    """
    import cv2
    import numpy as np

    good = _good_files(folder, np, cv2, light)

    def target(name: str, line: str, damaged: str, weight: float = 1.0) -> Target:
        words = line.split()
        files = {key: good[key] for key in good if key in words or key in _beside(words)}
        return Target(
            name=name, arguments=words, files=files, damaged=damaged.split(), weight=weight
        )

    every = [
        target("throw", "throw --ice ice.json --speed 2.1", "ice.json", 3),
        target("throw effects", "throw --ice full.json --speed 2.1", "full.json", 3),
        target("simulate", "simulate --ice standard --releases r.csv --fps 5 -o o.csv", "r.csv", 3),
        target("sweep", "sweep --releases r.csv --skill club -o o.csv", "r.csv"),
        target("convert ice", "convert ice.json -o o.csv", "ice.json"),
        target("convert Kinovea", "convert k.csv -o o.csv", "k.csv", 3),
        target("convert Tracker", "convert k.txt -o o.csv", "k.txt", 2),
        target("convert tracks", "convert t.csv -o o.csv", "t.csv", 2),
        target("replay page", "replay g.jsonl -o o.html", "g.jsonl", 4),
        target("replay film", "replay g.jsonl --speed 100 -o o.mp4", "g.jsonl", 0.3),
        target("plan stones", "plan --ice standard --target 0,17 --stones st.json", "st.json", 1),
        target("plan ice", "plan --ice full.json --target 0,17", "full.json", 0.5),
        target("compare", "compare t.csv --ice ice.json", "t.csv ice.json", 2),
        target("compare to", "compare t.csv --ice ice.json -o found", "t.csv", 0.3),
        target("estimate", "estimate t.csv -o o.json", "t.csv", 0.6),
        target("estimate alone", "estimate t.csv --uniform --effects none -o o.json", "t.csv", 1),
        target("estimate prior", "estimate t.csv --prior e.json -o o.json", "e.json", 0.3),
        target("estimate update", "estimate t.csv --update e.json -o e.json", "e.evidence.npz", 2),
        target("design", "design --ice ice.json --precision 5", "ice.json", 0.3),
        target("calibrate", "calibrate e.png -o o.json", "e.png"),
        target(
            "stones", "stones n.png --empty e.png --scene s.json -o o.json", "n.png e.png s.json"
        ),
        target("locate", "locate e.png --start s.json -o o.json", "e.png s.json"),
        target("track scene", "track f.mp4 --scene s.json -o o.csv", "s.json", 2),
        target("track film", "track f.mp4 --scene s.json -o o.csv", "f.mp4", 2),
        target("track camera", "track f.mp4 --scene s.json --camera cam.json -o o.csv", "cam.json"),
        target("track times", "track f.mp4 --scene s.json -o o.csv", "f.mp4.times.csv"),
        target("train", "train --config c.yml --targets 1 -o runs", "c.yml", 0.6),
        target("league", "train --config l.yml -o runs", "l.yml", 0.4),
        target("tournament", "tournament net.npz draw --games 1 --ends 1", "net.npz", 0.6),
        target("resume", "train --resume c.npz --targets 1 -o runs", "c.npz", 1),
        target("discover", "discover t.csv -o found", "t.csv", 0.1),
        target("throws", "throws t.csv -o o.csv", "t.csv", 1),
        target("throws notes", "throws t.csv", "throws.csv", 0.5),
        target("join-cameras", JOIN, "f.mp4 g.mp4 s.json", 0.5),
        target("corners", f"{CORNERS} --start s.json", "e.png s.json", 0.5),
        target("corners request", f"{CORNERS} --start s.json", "q.json", 1),
        target("live", LIVE, "f.mp4 s.json", 0.5),
        *(
            target(f"read {name}", f"read {name} {file}", file, 0.5)
            for name, file in READ
            if file in good
        ),
    ]
    return [k for k in every if not (light and k.arguments[0] in HEAVY)]


def _beside(words: Sequence[str]) -> set[str]:
    """Files that a command reads without their being named."""
    beside = {f"{word}.times.csv" for word in words if word.endswith(".mp4")}
    beside |= {word.replace(".json", ".evidence.npz") for word in words}
    more = {"throws": "throws.csv", "corners": "q.json", "live": "f.mp4"}
    if "e.evidence.npz" in words:
        beside.add("e.json")
    return beside | ({more[words[0]]} if words[0] in more else set())


def _good_files(folder: Path, np: Any, cv2: Any, light: bool) -> dict[str, bytes]:
    from curling_env.commands.cli import main
    from curling_env.ice import Ice, save_ice
    from curling_env.throw import Throw, write_releases

    def curling(line: str) -> None:
        import contextlib
        import io

        with (
            contextlib.redirect_stdout(io.StringIO()),
            contextlib.redirect_stderr(io.StringIO()) as said,
        ):
            status = main(
                [str(folder / w) if (folder / w).suffix in _OURS else w for w in line.split()]
            )
        if status:
            raise RuntimeError(f"{line}: {said.getvalue()}")

    throws = [
        Throw(speed=2.0 + 0.05 * k, angle=0.01 * k, spin=1.2 * (-1) ** k).release(clock=40.0 * k)
        for k in range(3)
    ]
    write_releases(folder / "r.csv", throws)
    save_ice(Ice.uniform(0.009), folder / "ice.json")
    document = json.loads((folder / "ice.json").read_text())
    document["friction"] |= {"mu": 0.009, "sigma": 0.0001, "observed": 1}
    document["effects"] = [
        {"name": "curl", "parameters": {"strength": 0.008}, "sigma": {"strength": 0.0005}},
        {"name": "air_drag", "parameters": {"coefficient": 0.00095}, "believed": []},
    ]
    (folder / "full.json").write_text(json.dumps(document))
    curling("simulate --ice standard --releases r.csv --fps 6 -o t.csv")
    curling("throw --ice full.json --speed 2.1")
    if not light:
        curling("estimate t.csv --uniform --effects none -o e.json")
    (folder / "game").mkdir()
    curling(
        "play --home draw --away draw --ends 1 -o game.d".replace("game.d", str(folder / "game"))
    )
    (folder / "g.jsonl").write_bytes((folder / "game" / "game.jsonl").read_bytes())
    rng = np.random.default_rng(0)
    empty = (200 + rng.normal(0, 2, (120, 60, 3))).clip(0, 255).astype(np.uint8)
    cv2.circle(empty, (30, 30), 25, (200, 80, 40), 3)
    now = empty.copy()
    cv2.circle(now, (40, 50), 6, (60, 60, 60), -1)
    for name, picture in (("e.png", empty), ("n.png", now)):
        (folder / name).write_bytes(cv2.imencode(".png", picture)[1].tobytes())
    corners = {"home_left": [5, 115], "home_right": [55, 115], "away_right": [45, 5]}
    scene = {"corners_px": {**corners, "away_left": [15, 5]}, "stone": {"radius": 0.145}}
    (folder / "s.json").write_text(json.dumps(scene))
    camera = {
        "camera_matrix": [[90, 0, 30], [0, 90, 60], [0, 0, 1]],
        "distortion": [0.1, 0, 0, 0, 0],
    }
    (folder / "cam.json").write_text(json.dumps(camera))
    (folder / "st.json").write_text('[{"x": 0.3, "y": 17.0, "team": "own"}, {"x": -1, "y": 16.5}]')
    from friction_estimation.film.writer import film_writer

    with film_writer(folder / "f.mp4", (60, 120), 10.0) as film:
        for k in range(12):
            frame = empty.copy()
            cv2.circle(frame, (30, 110 - 8 * k), 5, (60, 60, 60), -1)
            film.write(frame)
    (folder / "g.mp4").write_bytes((folder / "f.mp4").read_bytes())
    request = {"clicks": scene["corners_px"], "still": 0, "paint": True}
    (folder / "q.json").write_text(json.dumps(request))
    (folder / "throws.csv").write_text(
        "throw,athlete,stone,called,note\n0,Anna,1,draw,\n2,Bo,,,x\n"
    )
    (folder / "f.mp4.times.csv").write_text("t\n" + "".join(f"{k / 10}\n" for k in range(12)))
    for name, text in (
        ("k.csv", KINOVEA),
        ("k.txt", TRACKER),
        ("c.yml", CONFIGURATION),
        ("l.yml", LEAGUE),
    ):
        (folder / name).write_text(text)
    if light:
        (folder / "c.yml").unlink()
    else:
        _models(folder)
    return {p.name: p.read_bytes() for p in folder.iterdir() if p.is_file() and p.name[0] != "."}


_OURS = {".json", ".csv", ".jsonl", ".yml", ".npz"}


def _models(folder: Path) -> None:
    """A network that plays, and a checkpoint."""
    from agents.learning.configuration import settings_from
    from agents.learning.training import train
    from agents.playing.search.value_network import load_network, save_network

    save_network(folder / "net.npz", load_network())
    import yaml

    settings = settings_from(yaml.safe_load(CONFIGURATION), checkpoint_every=16, n_timesteps=48)
    train(settings, folder / "train")
    (folder / "c.npz").write_bytes(sorted((folder / "train").glob("checkpoint-*"))[-1].read_bytes())
