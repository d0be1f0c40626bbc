"""Command lines to fuzz, and their files to damage."""

from __future__ import annotations

import importlib.metadata
import random
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from fuzz.mutations import NASTY_NUMBERS, NASTY_TEXTS

HEAVY = frozenset({"estimate", "discover", "train", "tournament", "design"})
"""Commands that take seconds per run."""
REFUSED = frozenset({"calibrate", "locate", "join", "demo", "live", "discover t.csv --scene"})
"""Commands whose good files are refused here, or that are never run to the end."""


@dataclass(frozen=True, kw_only=True)
class Target:
    """A command and its files.

    Parameters
    ----------
    arguments : words after `curling`; names of files are those of `files`
    files : the good files by name, of which one at a time is damaged
    damaged : names of the files that are damaged; none where only the words are
    weight : how often it is chosen
    """

    arguments: Sequence[str]
    files: Mapping[str, bytes]
    damaged: Sequence[str]
    weight: float = 1.0

    @property
    def name(self) -> str:
        """Name of the command and of its files."""
        return f"{self.arguments[0]} {','.join(self.damaged)}".strip()

    @property
    def succeeds(self) -> bool:
        """Return whether the command ends with success on its good files."""
        line = " ".join(self.arguments)
        return not any(line.startswith(words) for words in REFUSED)


TARGETS = """
# weight, damaged files, command line; `read` calls a reader of readers.py

3    ice.json         throw --ice ice.json --speed 2.1
3    full.json        throw --ice full.json --speed 2.1 --angle 0.1 --spin 1 --x 0.1
3    r.csv            simulate --ice standard --releases r.csv --fps 5 -o o.csv
1    ice.json         validate ice.json --json
0.5  full.json        validate full.json
1    r.csv            sweep --releases r.csv --skill club --seeds 2 --workers 1 -o o.csv
0.1  r.csv            sweep --releases r.csv --skill club --seeds 200 --workers 2 -o o.csv
0.5  full.json        plan --ice full.json --target 0,17
0.5  st.json          plan --ice standard --target 0,17 --stones st.json
0.5  skill.json       plan --ice standard --target 0,17 --skill skill.json --task draw

1    ice.json         convert ice.json -o o.csv
3    t.csv            convert t.csv -o o.csv
3    k.csv            convert k.csv --unit cm --origin 0,-17 --along x -o o.csv
3    k.txt            convert k.txt -o o.csv
1    t.csv            throws t.csv --units feet -o o.csv
0.5  throws.csv       throws t.csv
0.5  athletes.csv     throws t.csv
1    throws.csv       hand-or-ice t.csv --ice ice.json -o o.csv
1    t.csv,ice.json   hand-or-ice t.csv --ice ice.json --believed standard --seed 1
0.3  throws.csv       athletes t.csv --ice ice.json -o found
0.5  t.csv            match-stones t.csv --ice ice.json -o o.json
1    t.csv,s.json     donate t.csv --scene s.json --consent All-who-threw-agree-to-this -o o.json
0.5  throws.csv       donate t.csv --scene s.json --consent All-who-threw-agree-to-this -o o.json
3    session.json     convert session.json -o o.csv
2    t.csv,ice.json   compare t.csv --ice ice.json
0.3  t.csv            compare t.csv --ice ice.json -o found

0.6  t.csv            estimate t.csv --seed 1 -o o.json
2    t.csv            estimate t.csv --uniform --effects none -o o.json
0.3  e.json           estimate t.csv --prior e.json -o o.json
2    e.evidence.npz   estimate t.csv --update e.json -o e.json
2    t.csv            estimate t.csv --update e.json -o e.json
0.3  s.json           discover t.csv --scene s.json -o found
0.2  t.csv            discover t.csv --known-length 21.3,21.9 --clock 20,24 -o found
0.2  ice.json         design --ice ice.json --precision 5 --resolution 4 --speeds 1.8,2.2

1    e.png            calibrate e.png --squares 9x7 --square-size 0.03 -o o.json
1    e.png,s.json     locate e.png --start s.json --mark away_tee=30,30 -o o.json
1    n.png,e.png,s.json  stones n.png --empty e.png --scene s.json -o o.json
0.3  e.png,s.json     corners e.png --no-browser --port 0 --start s.json -o o.json
0.7  q.json           corners e.png --no-browser --start s.json --sheet 44.5x4.5 -o o.json

0.8  hall.json        track f.mp4 --scene hall.json -o o.csv
1    f.mp4            track f.mp4 --scene hall.json -o o.csv
0.3  f.mp4            track g.mp4 f.mp4 --scene hall.json -o o.csv
0.2  f.mp4            track f.mp4 --scene hall.json --overlay o.mp4 -o o.csv
0.1  turned.mp4       track turned.mp4 --scene hall.json --overlay o.mp4 -o o.csv
0.1  f.mp4,hall.json  estimate f.mp4 --scene hall.json -o o.json
0.4  cam.json         track f.mp4 --scene hall.json --camera cam.json -o o.csv
0.4  f.mp4.times.csv  track f.mp4 --scene hall.json -o o.csv
0.1  f.mp4,g.mp4,hall.json  join-cameras f.mp4 g.mp4 --scene hall.json --scene hall.json -o o.csv
0.1  f.mp4,hall.json  live file://{here}/f.mp4 --scene hall.json --throws 1 --keep kept -o o.csv
0.2  r.csv,ice.json   film --ice ice.json --releases r.csv --fps 2 --size 64x48 -o films

4    g.jsonl          replay g.jsonl -o o.html
0.1  g.jsonl          replay g.jsonl --speed 100 -o o.mp4
0.3  ice.json         play --home draw --away draw --ends 1 --ice ice.json --skill elite --seed 2
0.3  net.npz          tournament net.npz draw --games 1 --ends 1
0.2  ice.json         host --ice ice.json --team0 draw --team1 draw --ends 1 --port 0 -o match
0.4  ice.json         join 127.0.0.1:1 --player draw --ice ice.json --name Us -o match
0.4  c.yml            train --config c.yml --targets 1 -o runs
0.2  l.yml            train --config l.yml -o runs
0.7  c.npz            train --resume c.npz --targets 1 -o runs
0.2  -                benchmark random --task draw --episodes 2
0.2  -                demo --throws 0 --workers 1 --seed 0 -o demo
0.2  -                live 0 --scene hall.json --throws 1 -o o.csv

0.7  ice.json         read ice ice.json
0.7  full.json        read ice full.json
0.7  r.csv            read releases r.csv
0.7  session.json     read session session.json
1    t.csv            read tracks t.csv
0.7  throws.csv       read notes throws.csv
0.7  s.json           read scene s.json
0.7  cam.json         read lens cam.json
0.7  st.json          read stones st.json
0.4  p.json           read passwords p.json
0.7  g.jsonl          read game g.jsonl
0.7  e.png            read picture e.png
0.7  f.mp4            read film f.mp4
0.2  turned.mp4       read film turned.mp4
0.7  k.csv            read export k.csv
0.7  k.txt            read export k.txt
0.7  c.yml            read configuration c.yml
0.7  net.npz          read network net.npz
0.7  c.npz            read model c.npz
0.7  e.evidence.npz   read evidence e.evidence.npz
"""


def make_targets(good: Mapping[str, bytes], *, light: bool = False) -> list[Target]:
    """Return all targets.

    Parameters
    ----------
    good : the good files by name
    light : without the commands that take seconds a run
    """
    targets: list[Target] = []
    for line in TARGETS.splitlines():
        if line[:1] in ("", "#"):
            continue
        weight, damaged, command = line.split(None, 2)
        words, names = command.split(), damaged.replace("-", "").split(",")
        if words[0] != "read":
            options_of(words[0])  # hypothesis draws constants of modules: they are loaded before
        names = [name for name in names if name]
        if (light and words[0] in HEAVY) or not good.keys() >= set(names):
            continue
        targets.append(
            Target(
                arguments=words,
                files={name: good[name] for name in _read_by(words) if name in good},
                damaged=names,
                weight=float(weight),
            )
        )
    return targets


def _read_by(words: Sequence[str]) -> list[str]:
    """Return the names of the files that a command reads, named or found beside a named one."""
    named = list(words)
    for word in words:
        if word.endswith(".mp4"):
            named += [Path(word).name, f"{word}.times.csv"]
        elif word.endswith(".json"):
            named.append(word.replace(".json", ".evidence.npz"))
        elif word == "e.evidence.npz":
            named.append("e.json")
    notes = ["throws.csv", "athletes.csv"]
    coaching = dict.fromkeys(("throws", "hand-or-ice", "athletes", "match-stones", "donate"), notes)
    beside = {**coaching, "corners": ["q.json"]}
    return [*named, *beside.get(words[0], [])]


# --- odd words ------------------------------------------------------------------------------------

ODD_WORDS = (".", "/", "/dev/full", "f.mp4", "ice.json", "-o", "--", "-", "~", "o.csv", "s.json")
"""Words in place of another kind of value."""
MEANT = (
    *("0", "1", "2", "0.5", "-1", "3.7", "100", "1000", "0,17.4", "21.3,21.9", "44.5x4.5"),
    *("standard", "ice.json", "full.json", "t.csv", "s.json", "cam.json", "f.mp4", "e.png"),
    *("draw", "club", "feet", "none", "all", "away_tee=30,30", "curl", "found", "new.html"),
)
"""Values that some options take."""


def odd_command_line(words: Sequence[str], rng: random.Random) -> list[str]:
    """Return a good command line with one to three faults.

    Parameters
    ----------
    words : the command and its good arguments
    """
    words = list(words)
    for _ in range(rng.choice((1, 1, 2, 3))):
        if rng.random() < 0.5:
            words += [rng.choice(options_of(words[0]))] * rng.choice((1, 1, 1, 2))
            words += [_value(rng)] * (rng.random() < 0.9)
        elif len(words) > 1:
            k = rng.randrange(1, len(words))
            words[k] = _value(rng) if rng.random() < 0.9 else words[k] + _value(rng)
    return words


@cache
def options_of(command: str) -> list[str]:
    """Return the names of all options of a command, as the command itself declares them."""
    import typer.main

    from curling_env.commands.cli import COMMAND_GROUP

    declared: Any = importlib.metadata.entry_points(group=COMMAND_GROUP)
    app = typer.Typer()
    app.command()(declared[command].load())
    known: Any = typer.main.get_command(app)
    return sorted({name for option in known.params for name in option.opts if name[:1] == "-"})


def _value(rng: random.Random) -> str:
    """Return a value without a zero byte, which no command line can hold."""
    return rng.choice((*NASTY_NUMBERS, *NASTY_TEXTS, *ODD_WORDS, *MEANT)).replace("\0", "")
