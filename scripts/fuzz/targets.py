"""What is fuzzed: command lines, and which of their files are damaged."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from fuzz.good_files import make_good_files

HEAVY = frozenset({"estimate", "discover", "train", "tournament", "design"})
"""Commands that take seconds a run."""


@dataclass(frozen=True, kw_only=True)
class Target:
    """A command and its files.

    Parameters
    ----------
    arguments : what follows `curling`; names of files are those of `files`
    files : the good files by name, of which one at a time is damaged
    damaged : names of the files that are damaged
    weight : how often it is chosen
    """

    arguments: Sequence[str]
    files: Mapping[str, bytes]
    damaged: Sequence[str]
    weight: float = 1.0

    @property
    def name(self) -> str:
        """The command and the files that it is fuzzed with."""
        return f"{self.arguments[0]} {','.join(self.damaged)}"


TARGETS = """
# weight, damaged files, command line; `read` calls a reader of readers.py

3    ice.json         throw --ice ice.json --speed 2.1
3    full.json        throw --ice full.json --speed 2.1
3    r.csv            simulate --ice standard --releases r.csv --fps 5 -o o.csv
1    ice.json         validate ice.json
0.5  full.json        validate full.json
1    r.csv            sweep --releases r.csv --skill club -o o.csv
0.5  full.json        plan --ice full.json --target 0,17
1    st.json          plan --ice standard --target 0,17 --stones st.json

1    ice.json         convert ice.json -o o.csv
2    t.csv            convert t.csv -o o.csv
3    k.csv            convert k.csv -o o.csv
2    k.txt            convert k.txt -o o.csv
1    t.csv            throws t.csv -o o.csv
0.5  throws.csv       throws t.csv
0.5  athletes.csv     throws t.csv
1    throws.csv       hand-or-ice t.csv --ice ice.json -o o.csv
0.5  t.csv,ice.json   hand-or-ice t.csv --ice ice.json --believed standard
0.3  throws.csv       athletes t.csv --ice ice.json -o found
0.5  t.csv            match-stones t.csv --ice ice.json -o o.json
0.5  skill.json       plan --ice standard --target 0,17 --skill skill.json
1    t.csv,s.json     donate t.csv --scene s.json --consent All-who-threw-agree-to-this -o o.json
0.5  throws.csv       donate t.csv --scene s.json --consent All-who-threw-agree-to-this -o o.json
3    session.json     convert session.json -o o.csv
2    t.csv,ice.json   compare t.csv --ice ice.json
0.3  t.csv            compare t.csv --ice ice.json -o found

0.6  t.csv            estimate t.csv -o o.json
1    t.csv            estimate t.csv --uniform --effects none -o o.json
0.3  e.json           estimate t.csv --prior e.json -o o.json
2    e.evidence.npz   estimate t.csv --update e.json -o e.json
0.3  s.json           discover t.csv --scene s.json -o found
0.1  t.csv            discover t.csv -o found
0.3  ice.json         design --ice ice.json --precision 5

1    e.png            calibrate e.png -o o.json
1    e.png,s.json     locate e.png --start s.json -o o.json
1    n.png,e.png,s.json  stones n.png --empty e.png --scene s.json -o o.json
0.5  e.png,s.json     corners e.png --no-browser --start s.json -o o.json
1    q.json           corners e.png --no-browser --start s.json -o o.json

2    hall.json        track f.mp4 --scene hall.json -o o.csv
2    f.mp4            track f.mp4 --scene hall.json -o o.csv
0.3  f.mp4            track f.mp4 --scene hall.json --overlay o.mp4 -o o.csv
0.3  f.mp4,hall.json  estimate f.mp4 --scene hall.json -o o.json
1    cam.json         track f.mp4 --scene hall.json --camera cam.json -o o.csv
1    f.mp4.times.csv  track f.mp4 --scene hall.json -o o.csv
0.5  f.mp4,g.mp4,hall.json  join-cameras f.mp4 g.mp4 --scene hall.json --scene hall.json -o o.csv
0.5  f.mp4,hall.json  live file://{here}/f.mp4 --scene hall.json --throws 1 --keep kept -o o.csv
0.3  r.csv,ice.json   film --ice ice.json --releases r.csv --fps 2 --size 64x48 -o films

4    g.jsonl          replay g.jsonl -o o.html
0.3  g.jsonl          replay g.jsonl --speed 100 -o o.mp4
0.5  ice.json         play --home draw --away draw --ends 1 --ice ice.json
0.6  net.npz          tournament net.npz draw --games 1 --ends 1
0.6  ice.json         host --ice ice.json --team0 draw --team1 draw --ends 1 --port 0 -o match
0.6  ice.json         join 127.0.0.1:1 --player draw --ice ice.json -o match
0.6  c.yml            train --config c.yml --targets 1 -o runs
0.4  l.yml            train --config l.yml -o runs
1    c.npz            train --resume c.npz --targets 1 -o runs

0.5  ice.json         read ice ice.json
0.5  full.json        read ice full.json
0.5  r.csv            read releases r.csv
0.5  session.json     read session session.json
0.5  t.csv            read tracks t.csv
0.5  throws.csv       read notes throws.csv
0.5  s.json           read scene s.json
0.5  cam.json         read lens cam.json
0.5  st.json          read stones st.json
0.5  p.json           read passwords p.json
0.5  g.jsonl          read game g.jsonl
0.5  e.png            read picture e.png
0.5  f.mp4            read film f.mp4
0.5  k.csv            read export k.csv
0.5  k.txt            read export k.txt
0.5  c.yml            read configuration c.yml
0.5  net.npz          read network net.npz
0.5  c.npz            read model c.npz
0.5  e.evidence.npz   read evidence e.evidence.npz
"""

OPTIONS = """
# Command lines whose words are replaced, and to which further options are added. `bench` reads
# nothing; what `demo` has here is refused, because a whole run takes minutes; nobody listens where
# `join` would play. `app` serves until it is ended, and `record-games` needs an extra.

throw --ice standard --speed 2.1 --angle 0.1 --spin 1 --x 0.1
validate standard --json
plan --ice standard --target 0,17.3 --skill elite --spin 1 --x 0
plan --ice standard --task draw --target 0,17.3 --seed 3
design --resolution 4 --precision 5 --noise 0.005 --fps 30 --mu 0.009 --spread 5 --speeds 1.8,2.2
simulate --ice standard --releases r.csv --fps 10 -o o.csv
sweep --ice standard --releases r.csv --seeds 2 --seed 1 --skill club --workers 1 -o o.csv
film --ice standard --releases r.csv --camera end --fps 2 --size 64x48 --noise 2 -o films
convert k.csv --unit cm --origin 0,-17 --along x -o o.csv
throws t.csv --units feet -o o.csv
hand-or-ice t.csv --ice ice.json --believed standard --units feet --seed 1 -o o.csv
athletes t.csv --ice ice.json --believed standard --seed 1 -o found
match-stones t.csv --ice ice.json --units feet --seed 1 -o o.json
donate t.csv --scene s.json --consent All-who-threw-agree-to-this -o o.json --json
compare t.csv --ice ice.json
estimate t.csv -o o.json --seed 1
discover t.csv --known-length 21.3,21.9 --clock 20,24 -o found
calibrate e.png --squares 9x7 --square-size 0.03 --board chessboard -o o.json
locate e.png --mark away_tee=30,30 --mark away_hog_centre=30,90 --height 5 -o o.json
corners e.png --start s.json --sheet 44.5x4.5 --port 0 --no-browser -o o.json
stones n.png --empty e.png --scene s.json -o o.json
track f.mp4 --scene hall.json -o o.csv
join-cameras f.mp4 g.mp4 --scene hall.json --scene hall.json -o o.csv
live file://{here}/f.mp4 --scene hall.json --throws 1 --keep kept -o o.csv
live 0 --scene hall.json --throws 1 -o o.csv
play --home draw --away draw --ends 1 --skill elite --hammer home --seed 2 --json
tournament draw draw --games 1 --ends 1 --seed 0 --json
benchmark random --task draw --episodes 2
host --team0 draw --team1 draw --ends 1 --time 9 --noise0 none --port 0 --http 0 --seed 1 -o match
join 127.0.0.1:1 --player draw --ice standard --name Us --seed 1 -o match
replay g.jsonl --end 1 --speed 90 -o o.mp4
train --config c.yml --steps 8 --targets 1 --seed 0 -o runs
demo --throws 0 --workers 1 --seed 0 -o demo
"""


def make_targets(folder: Path, *, light: bool = False) -> list[Target]:
    """All targets; the good files are made in a folder.

    Parameters
    ----------
    light : without the commands that take seconds a run

    Raises
    ------
    RuntimeError : a good file is refused
    """
    good = make_good_files(folder, light=light)
    targets: list[Target] = []
    for line in lines_of(TARGETS):
        weight, damaged, command = line.split(None, 2)
        words, names = command.split(), damaged.split(",")
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


def lines_of(table: str) -> list[str]:
    """The lines of a table without its remarks."""
    return [line for line in table.splitlines() if line and not line.startswith("#")]


def _read_by(words: Sequence[str]) -> list[str]:
    """Names of the files that a command reads, also of those that lie beside one it is given."""
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
