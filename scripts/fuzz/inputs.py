"""Inputs of the fuzzer, drawn by hypothesis: commands and messages, each with a fault."""

from __future__ import annotations

import json
import random
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

from hypothesis import strategies as st

from fuzz.mutations import damaged, enlarged
from fuzz.surroundings import ODD_VALUES, SPECIAL, SURROUNDINGS, VARIABLES
from fuzz.targets import Target, odd_command_line

SCHEMAS = Path(__file__).parents[2] / "docs" / "schemas"
FORMS = {
    "ice.json": "ice", "full.json": "ice", "s.json": "scene", "hall.json": "scene",
    "cam.json": "lens", "st.json": "stones", "skill.json": "skill", "session.json": "session",
    "g.jsonl": "game",
}  # fmt: skip
"""Published schema of each file."""
BESIDE = ("throws.csv", "athletes.csv", "f.mp4.times.csv", "hall.solved.json", "e.evidence.npz")
"""Files that are read from the folder of the named ones."""
MOST_BYTES = 255
"""Maximum length of a file name on most disks [bytes]."""


@dataclass(frozen=True, kw_only=True)
class Input:
    """One run, or two of the same command.

    Parameters
    ----------
    name : the target and the kind of fault
    words : words after `curling`
    files : contents by name; the kind of a special file instead of its content
    surroundings : one of `SURROUNDINGS`; empty for the usual ones
    variables : environment variables of a Python that is started again
    again : good files with which the command is then run again, and must succeed
    kill : time after which the process is killed [s]
    room : largest file that it may write [bytes]
    """

    name: str
    words: Sequence[str]
    files: Mapping[str, bytes | str]
    surroundings: str = ""
    variables: Mapping[str, str] | None = None
    again: Mapping[str, bytes] | None = None
    kill: float | None = None
    room: int | None = None


Way = Callable[[Target, str, random.Random, st.DrawFn], Input | None]
"""Maker of an input with a fault of one kind; returns None if the fault is impossible."""


def inputs(
    targets: Sequence[Target], messages: Sequence[bytes], kinds: Sequence[str] = ()
) -> st.SearchStrategy[Input]:
    """Return the strategy of all inputs.

    Parameters
    ----------
    targets : the commands
    messages : requests to the app
    kinds : names of `KINDS`; all by default
    """
    ways = [(name, way) for name, (weight, way) in KINDS.items() for _ in range(weight)]
    ways = [way for way in ways if way[0] in (kinds or KINDS)]
    shares = [target for target in targets for _ in range(round(10 * target.weight))]

    @st.composite
    def drawn(draw: st.DrawFn) -> Input:
        rng = draw(st.randoms(use_true_random=False, note_method_calls=False))
        kind, way = rng.choice(ways)
        if kind == "message":
            k = rng.randrange(len(messages))
            content = damaged_message(messages[k], rng)
            return Input(name="app", words=["read", f"app {k}", "message"],
                         files={"message": content})  # fmt: skip
        target = rng.choice(shares)
        if not target.damaged:
            kind, way = "options", _options
        name = rng.choice(target.damaged or [""])
        tried = way(target, name, rng, draw)
        if tried is None:
            kind, tried = "damage", _damage(target, name, rng, draw)
        return replace(tried, name=f"{target.name} {kind}".removesuffix(" damage"))

    return drawn()


def _input(target: Target, files: Mapping[str, bytes | str] | None = None, **more: Any) -> Input:
    words = list(target.arguments)
    return Input(**{"name": "", "words": words, "files": {**target.files, **(files or {})}, **more})


def _damage(target: Target, name: str, rng: random.Random, draw: st.DrawFn) -> Input:
    return _input(target, {name: damaged(target.files[name], rng)})


def _again(target: Target, name: str, rng: random.Random, draw: st.DrawFn) -> Input:
    """Run the good files after a damaged one; one of them may be written differently."""
    good = dict(target.files)
    other = rng.choice(sorted(good))
    if other.endswith(".json") and other != "q.json":
        good[other] = b" " + good[other]
    tried = _damage(target, name, rng, draw)
    return replace(tried, again=good if target.succeeds else None)


def _from_the_schema(
    target: Target, name: str, rng: random.Random, draw: st.DrawFn
) -> Input | None:
    if name not in FORMS:
        return None
    return _input(target, {name: draw(documents(FORMS[name]))})


def _special(target: Target, name: str, rng: random.Random, draw: st.DrawFn) -> Input:
    chosen = rng.choice([n for n in (name, *BESIDE) if n != "q.json"])  # the fuzzer reads that one
    return _input(target, {chosen: rng.choice(list(SPECIAL))})


def _surroundings(target: Target, name: str, rng: random.Random, draw: st.DrawFn) -> Input:
    content = target.files[name] if rng.random() < 0.5 else damaged(target.files[name], rng)
    surroundings = "" if target.arguments[0] == "read" else rng.choice(list(SURROUNDINGS))
    return _input(target, {name: content}, surroundings=surroundings)


def _variables(target: Target, name: str, rng: random.Random, draw: st.DrawFn) -> Input | None:
    if target.arguments[0] in ("read", "corners", "live"):
        return None
    return _input(target, variables={rng.choice(VARIABLES): rng.choice(ODD_VALUES)})


def _large(target: Target, name: str, rng: random.Random, draw: st.DrawFn) -> Input | None:
    if name.endswith(".mp4"):
        return None
    return _input(target, {name: enlarged(target.files[name], rng)})


def _killed(target: Target, name: str, rng: random.Random, draw: st.DrawFn) -> Input | None:
    """Kill the command at any moment; it must succeed when repeated."""
    if not target.succeeds or target.arguments[0] == "read":
        return None
    return _input(target, kill=10 ** rng.uniform(-2.5, 0.7), again=dict(target.files))


def _full(target: Target, name: str, rng: random.Random, draw: st.DrawFn) -> Input | None:
    """Leave disk space for small files only, such as stderr; then repeat with enough space."""
    if not target.succeeds or target.arguments[0] == "read":
        return None
    return _input(target, room=round(2 ** rng.uniform(10, 18)), again=dict(target.files))


def _options(target: Target, name: str, rng: random.Random, draw: st.DrawFn) -> Input | None:
    if target.arguments[0] == "read":
        return None
    return _input(target, words=odd_command_line(target.arguments, rng))


def _names(target: Target, name: str, rng: random.Random, draw: st.DrawFn) -> Input:
    """Give a file, or the result, a name of maximum length."""
    results = [word for before, word in zip(target.arguments, target.arguments[1:], strict=False)
               if before == "-o"]  # fmt: skip
    old = rng.choice([name, *results])
    suffix, letter = Path(old).suffix, rng.choice("öx氷💥")
    room = rng.choice((MOST_BYTES, MOST_BYTES - 4, MOST_BYTES + 1, 200)) - len(suffix)
    new = letter * (room // len(letter.encode())) + suffix
    files = {n: content for n, content in target.files.items() if n != old}
    if old in target.files and len(new.encode()) <= MOST_BYTES:
        files[new] = target.files[old]
    words = [word.replace(old, new) if word == old else word for word in target.arguments]
    return Input(name="", words=words, files=files)


KINDS: dict[str, tuple[int, Way]] = {
    "damage": (50, _damage),
    "message": (14, _damage),
    "from the schema": (11, _from_the_schema),
    "options": (9, _options),
    "special": (5, _special),
    "surroundings": (4, _surroundings),
    "again": (3, _again),
    "names": (1, _names),
    "variables": (1, _variables),
    "large": (1, _large),
    "killed": (1, _killed),
    "full disk": (1, _full),
}
"""Share of the inputs [%] and maker of each kind of fault."""


def damaged_message(message: bytes, rng: random.Random) -> bytes:
    """Return a damaged message: either its head or its body, which differ in form."""
    mark = b"\r\n\r\n"
    if rng.random() < 0.1:
        return damaged(message, rng)
    head, _, body = message.partition(mark)
    if body and rng.random() < 0.7:
        return head + mark + damaged(body.rstrip(), rng) + body[len(body.rstrip()) :]
    return damaged(head, rng) + mark + body


# --- documents ------------------------------------------------------------------------------------


@cache
def documents(name: str) -> st.SearchStrategy[bytes]:
    """Return the strategy of the files of a schema; their numbers reach its bounds."""
    (path,) = SCHEMAS.glob(f"{name}-*.schema.json")
    schema = json.loads(path.read_text(encoding="utf-8"))
    if name == "game":
        head, shot, result = (_values(part, schema["$defs"]) for part in schema["anyOf"])
        lines = st.tuples(head, st.lists(shot, max_size=3), result)
        return lines.map(lambda d: "\n".join(map(json.dumps, (d[0], *d[1], d[2]))).encode())
    return _values(schema, schema["$defs"]).map(lambda document: json.dumps(document).encode())


def _values(schema: Mapping[str, Any], parts: Mapping[str, Any]) -> st.SearchStrategy[Any]:
    """Return the strategy of the values of a part of a schema."""
    if "$ref" in schema:
        return _values(parts[schema["$ref"].rpartition("/")[2]], parts)
    if "anyOf" in schema:
        return st.one_of(*(_values(part, parts) for part in schema["anyOf"]))
    if "const" in schema or "enum" in schema:
        return st.sampled_from(schema.get("enum") or [schema["const"]])
    low, high = schema.get("minimum"), schema.get("maximum")
    match schema.get("type"):
        case "object":
            members = {k: _values(v, parts) for k, v in schema.get("properties", {}).items()}
            required = {k: members.pop(k) for k in schema.get("required", ()) if k in members}
            if not (required or members):
                inner = schema.get("additionalProperties") or {}
                return st.dictionaries(st.text(max_size=8), _values(inner, parts), max_size=3)
            return st.fixed_dictionaries(required, optional=members)
        case "array":
            if "prefixItems" in schema:
                return st.tuples(*(_values(part, parts) for part in schema["prefixItems"]))
            few, most = schema.get("minItems", 0), schema.get("maxItems", 6)
            items = _values(schema.get("items") or {}, parts)
            return st.lists(items, min_size=few, max_size=max(few, min(most, 6)))
        case "number":
            near = st.floats(max(-50, -50 if low is None else low), min(50, high or 50))
            return st.one_of(near, st.floats(low, high, allow_nan=False, allow_infinity=False))
        case "integer":
            return st.integers(low, min(high or 2**40, 2**40))
        case "string":
            return st.text(max_size=20)
        case "boolean":
            return st.booleans()
    return st.one_of(st.none(), st.integers(), st.text(max_size=5))
