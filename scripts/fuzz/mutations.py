"""Damaged files: random changes of bytes, and replaced numbers, cells and members."""

from __future__ import annotations

import io
import json
import random
import re
import zipfile
import zlib
from collections.abc import Callable
from contextlib import suppress
from typing import Any

import numpy as np

NASTY_NUMBERS = (
    "0", "-1", "1e308", "-1e308", "1e-320", "1e23", "nan", "inf", "-inf", "1_000", "٣", "4e9",
    "2147483648", "9007199254740993", "1" * 400, "1" * 5000, "0x10", "1,5", "", "- 1", "1e", "+-1",
)  # fmt: skip
"""Texts in place of a number."""
NASTY_TEXTS = (
    "", " ", "\0", "\x1b[31m", "💥" * 50, "A" * 5000, "../../etc/passwd", "/dev/zero", "<script>",
    '"', "'", "\n", "\r", "\t", ",", ";", "#", "%s", "{}", "null", "\ufeff", "\udcff", "NaN",
)  # fmt: skip
NASTY_VALUES: tuple[Any, ...] = (
    None, True, False, 0, -1, 1e308, -1e308, 1e-320, 10**30, 10**400, "", "x", [], {}, [[]], [None],
    {"": ""}, [[1, 2], [3]], "<img src=x onerror=alert(1)>", 0.5, 3, 1e15, -0.0, float("nan"),
    float("inf"), "\ud800", "\x00", "\n" * 50, "A" * 5000, [0] * 3000, 2**53, 1e-12,
)  # fmt: skip
LARGE = 10 * 2**20
"""Approximate size of an enlarged file [bytes]."""
NUMBER = re.compile(rb"-?\d+(\.\d+)?([eE][-+]?\d+)?")
Way = Callable[[bytes, random.Random], bytes]


def damaged(content: bytes, rng: random.Random) -> bytes:
    """Return a file with one to four faults of any kind."""
    for _ in range(rng.choice((1, 1, 1, 2, 4))):
        content = rng.choice(_ways(content))(content, rng)
    return content


def _ways(content: bytes) -> list[Way]:
    ways: list[Way] = [_flipped, _cut, _doubled, _noise, _swapped, _word]
    head = content[:1]
    if head in (b"{", b"["):
        ways += [_member, _member, _member, _number, _key_twice]
    elif content[:2] == b"PK":
        ways += [_packed, _packed, _flipped]
    elif head == b"\x89":
        ways += [_claim, _claim]
    elif b"\0" not in content[:200]:
        ways += [_number, _number, _cell, _line, _cell, _wide, _column, _column, _headings_alone]
    return ways


# --- bytes ----------------------------------------------------------------------------------------


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
    """Replace four bytes, which may be a length, by an extreme value."""
    at = rng.randrange(max(len(content) - 3, 1))
    extreme = rng.choice((0, 1, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF, 0x00FFFFFF))
    return content[:at] + extreme.to_bytes(4, rng.choice(("big", "little"))) + content[at + 4 :]


def _claim(content: bytes, rng: random.Random) -> bytes:
    """Return a PNG whose valid header states another size."""
    sides = [rng.choice((0, 1, 60, 6000, 65535, 100_000, 2**31 - 1)).to_bytes(4) for _ in "wh"]
    header = content[12:16] + b"".join(sides) + content[24:29]
    return content[:12] + header + zlib.crc32(header).to_bytes(4) + content[33:]


def _packed(content: bytes, rng: random.Random) -> bytes:
    """Return an archive with valid checksums and one invalid array."""
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            members = {name: archive.read(name) for name in archive.namelist()}
    except Exception:
        return content
    name = rng.choice(list(members))
    types = (b"<c8", b"|O8", b"<i8", b"<U2")
    members[name] = rng.choice(
        (
            lambda array: b"",
            lambda array: _flipped(array, rng),
            lambda array: _cut(array, rng),
            lambda array: array.replace(b"<f8", rng.choice(types), 1),
            lambda array: members[rng.choice(list(members))],
            lambda array: array[:80] + _number(array[80:], rng),
        )
    )(members[name])
    return _archive(members)


def _archive(members: dict[str, bytes]) -> bytes:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        for key, value in members.items():
            if value:
                archive.writestr(key, value)
    return out.getvalue()


# --- tables and other texts -----------------------------------------------------------------------


def _number(content: bytes, rng: random.Random) -> bytes:
    """Replace one number in a text, or change its power of ten."""
    found = list(NUMBER.finditer(content[:200_000]))
    if not found:
        return content
    place = rng.choice(found)
    power = b"%be%d" % (place[0].partition(b"e")[0], rng.randrange(-12, 13))
    new = rng.choice((power, *(text.encode() for text in NASTY_NUMBERS)))
    return content[: place.start()] + new + content[place.end() :]


def _wide(content: bytes, rng: random.Random) -> bytes:
    """Return a table in which one row, or every row, has far too many cells."""
    lines = content.split(b"\n")
    many = b",7" * rng.choice((1, 300, 20_000))
    k = rng.randrange(len(lines))
    wide = [line + many if n == k or len(many) < 10 else line for n, line in enumerate(lines)]
    return b"\n".join(wide)


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
    lines[k : k + 1] = rng.choice(([], [lines[other], lines[k]], [b""], [lines[other]]))
    return b"\n".join(lines)


def _headings_alone(content: bytes, rng: random.Random) -> bytes:
    """Keep only the first lines of a table: its header and at most a few rows."""
    return b"".join(content.splitlines(keepends=True)[: rng.randrange(1, 5)])


def _column(content: bytes, rng: random.Random) -> bytes:
    """Change a whole column of a table: other units, no values, noise, another order."""
    lines = content.split(b"\n")
    mark = b"\t" if b"\t" in content[:200] else b","
    k = rng.randrange(max(line.count(mark) for line in lines[:4]) + 1)
    power = rng.choice((-15, -9, -6, -3, -2, -1, 1, 2, 3, 6, 9, 12, 15, 300))
    noise = np.random.default_rng(rng.randrange(1000))
    change: Callable[[float], str] = rng.choice(
        (
            lambda x: f"{x}e{power}",
            lambda x: f"{x}e{power}",
            lambda x: "",
            lambda x: "0",
            lambda x: f"{-x}",
            lambda x: "nan",
            lambda x: f"{x + noise.normal() * 10.0 ** min(power, 15)}",
            lambda x: f"{noise.integers(-9, 9)}",
        )
    )
    for n, line in enumerate(lines):
        cells = line.split(mark)
        with suppress(ValueError, IndexError):
            cells[k] = change(float(cells[k].strip(b'"'))).encode()
            lines[n] = mark.join(cells)
    return b"\n".join(lines)


# --- JSON -----------------------------------------------------------------------------------------


def _key_twice(content: bytes, rng: random.Random) -> bytes:
    """Return a JSON document with one of its keys given twice."""
    keys = re.findall(rb'"(\w+)":', content[:200_000])
    if not keys:
        return content
    key = rng.choice(keys)
    value = json.dumps(rng.choice((0, "x", None, [], {}))).encode()
    again = b'"' + key + b'": ' + value + b', "' + key + b'":'
    return content.replace(b'"' + key + b'":', again, 1)


def _member(content: bytes, rng: random.Random) -> bytes:
    """Replace, remove or add a member of a JSON document, or of one of the lines of JSON."""
    lines, k = [content.decode(errors="replace")], 0
    if content[:1] == b"{" and b"}\n{" in content:
        lines = lines[0].split("\n")
        k = rng.randrange(len(lines))
    try:
        document: Any = json.loads(lines[k])
    except (ValueError, RecursionError):
        return content
    places = list(_places(document))[:3000]
    if not places:
        return content
    holder, key = rng.choice(places)
    way = rng.randrange(5)
    if way == 0:
        del holder[key]
    elif way == 1 and isinstance(holder, dict):
        holder["x" * rng.choice((1, 300))] = rng.choice(NASTY_VALUES)
    elif way == 2 and isinstance(holder, list):
        holder.extend(holder[:50])
    else:
        holder[key] = rng.choice(NASTY_VALUES)
    lines[k] = json.dumps(document)
    return "\n".join(lines).encode()


def _places(value: Any) -> Any:
    """Return every container and key of a document; of a list, the first twenty."""
    if isinstance(value, dict | list):
        keys: list[Any] = list(value) if isinstance(value, dict) else [*range(min(len(value), 20))]
        yield from ((value, key) for key in keys)
        for key in keys:
            yield from _places(value[key])


# --- large files ----------------------------------------------------------------------------------


def enlarged(content: bytes, rng: random.Random) -> bytes:
    """Return a file of some 10 MB that is valid for as long as it can be.

    The limits of meaning are reached, and not only those of syntax.
    """
    if content[:2] == b"PK":
        array = io.BytesIO()
        np.lib.format.write_array(array, np.zeros(rng.choice((4, 75_000_000))))
        many = LARGE // 300 if array.tell() < 1000 else 1
        return _archive({f"a{k}.npy": array.getvalue() for k in range(many)})
    if content[:1] == b"\x89":  # thousands of remarks before the picture
        text = b"tEXtnote\0" + b"x" * 200
        chunk = (len(text) - 4).to_bytes(4, "big") + text + zlib.crc32(text).to_bytes(4, "big")
        return content[:33] + chunk * (LARGE // len(chunk)) + content[33:]
    if content[:1] in (b"{", b"["):
        return _large_json(content, rng)
    if b": [" in content:  # YAML that multiplies itself
        parts = (f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 9)}]\n" for k in range(1, 12))
        return b"a0: &a0 [1, 1]\n" + "".join(parts).encode() + content
    lines = content.splitlines(keepends=True)
    few = rng.choice((1, len(lines)))  # the last row alone, or all of them
    return content + b"".join(lines[-few:]) * (LARGE // max(1, sum(map(len, lines[-few:]))))


def _large_json(content: bytes, rng: random.Random) -> bytes:
    """Return a document with a long list, many members, or a long text."""
    head, end, rest = content.partition(b"\n") if b"}\n{" in content else (content, b"", b"")
    document: Any = json.loads(head)
    lists = [holder[key] for holder, key in _places(document) if isinstance(holder[key], list)]
    way = rng.randrange(3)
    if isinstance(document, list):
        document *= LARGE // max(1, len(content))
    elif way == 0 and any(lists):
        chosen = rng.choice([k for k in lists if k])
        chosen *= LARGE // len(json.dumps(chosen))
    elif way == 1:
        document |= {f"note {k}": "of a hall" for k in range(LARGE // 26)}
    else:
        document["note"] = "x" * LARGE
    return json.dumps(document).encode() + end + rest
