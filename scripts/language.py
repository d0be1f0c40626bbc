"""Check of the wording: docstrings, comments, messages, pages and commit subjects.

``python scripts/language.py`` lists the places of each pattern of ``language.toml`` in everything
that git tracks, and of each word that ``docs/glossary.md`` replaces, and fails if there are any.
``--commit-message FILE`` checks a message.
"""

from __future__ import annotations

import argparse
import ast
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
SUFFIXES = (".py", ".md", ".html", ".js")
LONGEST_SUBJECT = 72
LONGEST_HELP = 100
NOT_IMPERATIVE = frozenset(
    {"What", "Whether", "How", "Where", "When", "Who", "Whose", "Which", "Why", "That"}
    | {"So", "As", "A", "An", "The", "Results"}
)
WORD_LISTS = ("docs/glossary.md", "scripts/language.py", "tests/scripts/test_language.py")


@dataclass(frozen=True, kw_only=True)
class Place:
    """Violation of a rule."""

    file: str
    line: int
    text: str

    def __str__(self) -> str:
        return f"{self.file}:{self.line}: {self.text.strip()}"


def long_helps(file: str, source: str) -> Iterator[Place]:
    """Yield option helps longer than one line."""
    if "help" not in source and "option(" not in source:
        return
    for node in ast.walk(ast.parse(source)):
        match node:
            case (
                ast.keyword(arg="help", value=ast.Constant(value=str(text)) as value)
                | ast.Call(
                    func=ast.Name(id="option" | "output_to"),
                    args=[_, ast.Constant(value=str(text)) as value, *_],
                )
            ) if len(text) > LONGEST_HELP:
                yield Place(file=file, line=value.lineno, text=text)


def replaced_words(glossary: str) -> dict[str, str]:
    """Return the words of the glossary's last column, each with its replacement."""
    words: dict[str, str] = {}
    for line in glossary.splitlines():
        cells = [cell.strip() for cell in line.strip().strip("|").split("|")]
        if line.startswith("|") and len(cells) == 3 and not set(cells[2]) <= set("-: "):
            words |= {word: cells[0] for word in re.findall(r"`([^`]+)`", cells[2])}
    return words


def broken(rules: list[dict[str, Any]], root: Path = ROOT) -> dict[str, list[Place]]:
    """Return the violations of each rule, by its name."""
    # Lower case and patterns that begin with a letter: Python searches these ten times faster.
    patterns = {
        rule["name"]: re.compile(rule["pattern"], re.MULTILINE)
        for rule in rules
        if "pattern" in rule
    }
    places: dict[str, list[Place]] = {rule["name"]: [] for rule in rules}
    for file in tracked(root):
        source = (root / file).read_text(encoding="utf-8")
        lower, lines = source.lower(), source.split("\n")
        for name, pattern in patterns.items():
            for hit in pattern.finditer(lower):
                begin = hit.start()
                if not (begin and lower[begin - 1 : begin + 1].isalnum()):
                    line = lower.count("\n", 0, begin)
                    places[name].append(Place(file=file, line=line + 1, text=lines[line]))
        if file.endswith(".py"):
            places["long help"] += long_helps(file, source)
    for rule in rules:
        places[rule["name"]] = [
            place for place in places[rule["name"]] if not is_allowed(place, rule)
        ]
    return places


def is_allowed(place: Place, rule: dict[str, Any]) -> bool:
    """Return whether a rule lists a place as an exception."""
    return any(
        place.file.startswith(exception["file"]) and exception["text"] in place.text
        for exception in rule.get("allowed", ())
    )


def tracked(root: Path) -> list[str]:
    """Return tracked files with prose, except the word lists."""
    command = ["git", "ls-files", *(f"*{suffix}" for suffix in SUFFIXES)]
    listed = subprocess.run(command, cwd=root, capture_output=True, text=True, check=True)
    files = [file for file in listed.stdout.split() if (root / file).is_file()]
    return [file for file in files if file not in WORD_LISTS]


def subject_faults(message: str) -> list[str]:
    """Return the faults of a commit message's first line."""
    subject = message.splitlines()[0] if message.strip() else ""
    words = subject.split()
    if not words:
        return ["the subject is empty; expected an imperative: Add ..., Fix ..."]
    faults: list[str] = []
    if len(subject) > LONGEST_SUBJECT:
        faults.append(f"the subject has {len(subject)} characters; expected {LONGEST_SUBJECT}")
    first = words[0].rstrip(":,")
    if (
        first in NOT_IMPERATIVE
        or re.search(r"(?<!e)(?<!Emb)(?<!Br)(ed|ing)$", first)
        or not first[0].isupper()
    ):
        faults.append(f"the subject opens with '{first}'; expected an imperative: Add ..., Fix ...")
    return faults


def main(arguments: list[str] | None = None) -> int:
    """Run the check; return 1 if there is a violation."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--commit-message", type=Path, metavar="FILE", help="check a message")
    options = parser.parse_args(arguments)
    if options.commit_message:
        faults = subject_faults(options.commit_message.read_text(encoding="utf-8"))
        print("\n".join(faults), file=sys.stderr)
        return int(bool(faults))
    rules = tomllib.loads((ROOT / "scripts/language.toml").read_text("utf-8"))["rules"]
    words = replaced_words((ROOT / "docs/glossary.md").read_text("utf-8"))
    either = "|".join(re.escape(word) for word in sorted(words, key=len, reverse=True))
    for rule in rules:
        if rule["name"] == "glossary":
            rule["pattern"] = rf"({either})(?![a-z])"
    places = broken(rules)
    for rule in rules:
        for place in places[rule["name"]]:
            print(f"{place}\n  {rule['name']}; write instead: {rule['instead']}")
    return int(any(places.values()))


if __name__ == "__main__":
    sys.exit(main())
