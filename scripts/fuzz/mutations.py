"""Damaged files: bytes changed at random, and numbers, cells and members replaced on purpose."""

from __future__ import annotations

import io
import json
import random
import re
import zipfile
import zlib
from typing import Any

NASTY_NUMBERS = (
    "0", "-1", "1e308", "-1e308", "1e-320", "1e23", "nan", "inf", "-inf", "1_000", "٣", "4e9",
    "2147483648", "9007199254740993", "1" * 400, "1" * 5000, "0x10", "1,5", "", "- 1", "1e", "+-1",
)  # fmt: skip
"""Texts that stand where a number belongs."""
NASTY_TEXTS = (
    "", " ", "\0", "\x1b[31m", "💥" * 50, "A" * 5000, "../../etc/passwd", "/dev/zero", "<script>",
    '"', "'", "\n", "\r", "\t", ",", ";", "#", "%s", "{}", "null", "\ufeff", "\udcff", "NaN",
)  # fmt: skip
NASTY_VALUES: tuple[Any, ...] = (
    None, True, False, 0, -1, 1e308, -1e308, 1e-320, 10**30, 10**400, "", "x", [], {}, [[]], [None],
    {"": ""}, [[1, 2], [3]], "<img src=x onerror=alert(1)>", 0.5, 3, 1e15, -0.0, float("nan"),
    float("inf"), "\ud800", "\x00", "\n" * 50, "A" * 5000, [0] * 3000, 2**53, 1e-12,
)  # fmt: skip


def damaged(content: bytes, rng: random.Random) -> bytes:
    """A file with one to four faults of any kind."""
    for _ in range(rng.choice((1, 1, 1, 2, 4))):
        content = rng.choice(_ways(content))(content, rng)
    return content


def _ways(content: bytes) -> list[Any]:
    ways: list[Any] = [_flipped, _cut, _doubled, _noise, _swapped, _word]
    head = content[:1]
    if head in (b"{", b"["):
        ways += [_member, _member, _member, _number, _key_twice]
    elif content[:2] == b"PK":
        ways += [_packed, _packed, _flipped]
    elif head == b"\x89":
        ways += [_claim, _claim]
    elif b"\0" not in content[:200]:
        ways += [_number, _number, _cell, _line, _cell, _wide]
    return ways


def _flipped(content: bytes, rng: random.Random) -> bytes:
    changed = bytearray(content)
    for _ in range(rng.choice((1, 1, 8, 100)) if changed else 0):
        changed[rng.randrange(len(changed))] ^= 1 << rng.randrange(8)
    return bytes(changed)


def _cut(content: bytes, rng: random.Random) -> bytes:
    a, b = sorted(rng.randrange(len(content) + 1) for _ in range(2))
    return rng.choice((content[:a], content[b:], content[:a] + content[b:], b""))


def _doubled(content: bytes, rng: random.Random) -> bytes:
    a, b = sorted(rng.randrange(len(content) + 1) for _ in range(2))
    return content[:b] + content[a:b] * rng.choice((1, 2, 20)) + content[b:]


def _noise(content: bytes, rng: random.Random) -> bytes:
    at = rng.randrange(len(content) + 1)
    return content[:at] + rng.randbytes(rng.choice((1, 4, 100))) + content[at:]


def _swapped(content: bytes, rng: random.Random) -> bytes:
    return rng.choice(
        (
            b"\0" * 100,
            content[::-1],
            b"[" * 20_000,
            b"\xff\xfe" + content,
            b"\xef\xbb\xbf" + content,
            content.decode(errors="replace").encode("utf-16"),
            content.replace(b"\n", b"\r\n"),
            content.replace(b"\n", b"\r"),
            content.replace(b"\n", b""),
            b"\n" * 1000 + content,
            b"{" * 2000 + b"}" * 2000,
            b'{"a":' * 5000,
            b"&a [*a, *a]\n" + content,
            b"#!/bin/sh\n" + content,
            content.replace(b"0", b"9", 3),
        )
    )


def _word(content: bytes, rng: random.Random) -> bytes:
    """Four bytes that may say how long something is, replaced by an extreme."""
    at = rng.randrange(max(len(content) - 3, 1))
    extreme = rng.choice((0, 1, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF, 0x00FFFFFF))
    return content[:at] + extreme.to_bytes(4, rng.choice(("big", "little"))) + content[at + 4 :]


def _claim(content: bytes, rng: random.Random) -> bytes:
    """A PNG whose header is right and claims another size."""
    sides = [rng.choice((0, 1, 60, 6000, 65535, 100_000, 2**31 - 1)).to_bytes(4) for _ in "wh"]
    header = content[12:16] + b"".join(sides) + content[24:29]
    return content[:12] + header + zlib.crc32(header).to_bytes(4) + content[33:]


def _wide(content: bytes, rng: random.Random) -> bytes:
    """A table of which one row, or every row, is far too wide."""
    lines = content.split(b"\n")
    many = b",7" * rng.choice((1, 300, 20_000))
    k = rng.randrange(len(lines))
    wide = [line + many if n == k or len(many) < 10 else line for n, line in enumerate(lines)]
    return b"\n".join(wide)


def _key_twice(content: bytes, rng: random.Random) -> bytes:
    """A JSON document with one of its keys given twice."""
    keys = re.findall(rb'"(\w+)":', content[:200_000])
    if not keys:
        return content
    key = rng.choice(keys)
    value = json.dumps(rng.choice((0, "x", None, [], {}))).encode()
    again = b'"' + key + b'": ' + value + b', "' + key + b'":'
    return content.replace(b'"' + key + b'":', again, 1)


def _number(content: bytes, rng: random.Random) -> bytes:
    """One number in a text replaced."""
    found = list(re.finditer(rb"-?\d+(\.\d+)?([eE][-+]?\d+)?", content[:200_000]))
    if not found:
        return content
    place = rng.choice(found)
    new = rng.choice(NASTY_NUMBERS).encode()
    return content[: place.start()] + new + content[place.end() :]


def _cell(content: bytes, rng: random.Random) -> bytes:
    lines = content.split(b"\n")
    k = rng.randrange(len(lines))
    cells = lines[k].split(b",")
    new = rng.choice((*NASTY_TEXTS, *NASTY_NUMBERS)).encode(errors="surrogateescape")
    cells[rng.randrange(len(cells))] = new
    lines[k] = b",".join(cells)
    return b"\n".join(lines)


def _line(content: bytes, rng: random.Random) -> bytes:
    lines = content.split(b"\n")
    k, other = rng.randrange(len(lines)), rng.randrange(len(lines))
    what = rng.randrange(4)
    if what == 0:
        del lines[k]
    elif what == 1:
        lines.insert(k, lines[other])
    elif what == 2:
        lines[k], lines[other] = lines[other], lines[k]
    else:
        lines[k] = b""
    return b"\n".join(lines)


def _member(content: bytes, rng: random.Random) -> bytes:
    """One member of a JSON document replaced, removed or added; of JSON lines, in one of them."""
    lines = content.decode(errors="replace").split("\n")
    k = 0
    try:
        document: Any = json.loads(content)
        lines = [""]
    except (ValueError, RecursionError):
        k = rng.randrange(len(lines))
        try:
            document = json.loads(lines[k])
        except (ValueError, RecursionError):
            return content
    places: list[tuple[Any, Any]] = []

    def walk(value: Any) -> None:
        if isinstance(value, dict | list) and len(places) < 3000:
            keys = list(value) if isinstance(value, dict) else list(range(min(len(value), 20)))
            places.extend((value, key) for key in keys)
            for key in keys:
                walk(value[key])

    walk(document)
    if not places:
        return content
    holder, key = rng.choice(places)
    what = rng.randrange(5)
    if what == 0:
        del holder[key]
    elif what == 1 and isinstance(holder, dict):
        holder["x" * rng.choice((1, 300))] = rng.choice(NASTY_VALUES)
    elif what == 2 and isinstance(holder, list):
        holder.extend(holder[:50])
    else:
        holder[key] = rng.choice(NASTY_VALUES)
    lines[k] = _dumps(document)
    return "\n".join(lines).encode()


def _dumps(document: Any) -> str:
    import sys

    limit = sys.get_int_max_str_digits()
    sys.set_int_max_str_digits(0)
    try:
        return json.dumps(document)
    finally:
        sys.set_int_max_str_digits(limit)


def _packed(content: bytes, rng: random.Random) -> bytes:
    """An archive whose checksums are right and one of whose arrays is not."""
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            members = {name: archive.read(name) for name in archive.namelist()}
    except Exception:
        return content
    name = rng.choice(list(members))
    what = rng.randrange(6)
    if what == 0:
        del members[name]
    elif what == 1:
        members[name] = _flipped(members[name], rng)
    elif what == 2:
        members[name] = _cut(members[name], rng)
    elif what == 3:
        members[name] = members[name].replace(
            b"<f8", rng.choice((b"<c8", b"|O8", b"<i8", b"<U2")), 1
        )
    elif what == 4:
        members[name] = members[rng.choice(list(members))]
    else:
        members[name] = members[name][:80] + _number(members[name][80:], rng)
    out = io.BytesIO()
    with zipfile.ZipFile(
        out, "w", rng.choice((zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED))
    ) as archive:
        for key, value in members.items():
            archive.writestr(key, value)
    return out.getvalue()
