"""Docstrings describe existing parameters only."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PACKAGES = ("curling_env", "friction_estimation", "agents")


def described(docstring: str) -> list[str]:
    """Names in a docstring's section of parameters."""
    section = re.search(
        r"^ *Parameters\n *-{3,}\n(.*?)(?:\n *\w+\n *-{3,}\n|\Z)", docstring, re.M | re.S
    )
    if section is None:
        return []
    lines = section[1].splitlines()
    indent = min(len(line) - len(line.lstrip()) for line in lines if line.strip())
    entries = [line.strip() for line in lines if len(line) - len(line.lstrip()) == indent]
    names = [entry.split(" : ")[0] for entry in entries if " : " in entry]
    return [name.strip("* ") for entry in names for name in entry.split(",")]


def there(node: ast.FunctionDef | ast.ClassDef) -> set[str]:
    """Arguments of a function or fields of a class, inherited ones left out."""
    if isinstance(node, ast.ClassDef):
        own = {s.target.id for s in node.body if isinstance(s, ast.AnnAssign)}
        for method in node.body:
            if isinstance(method, ast.FunctionDef) and method.name in ("__init__", "__call__"):
                wraps_another = any("wraps" in ast.unparse(d) for d in method.decorator_list)
                own |= set() if wraps_another else there(method)
        return own
    args = node.args
    every = [*args.posonlyargs, *args.args, *args.kwonlyargs, args.vararg, args.kwarg]
    return {arg.arg for arg in every if arg}


def documented(package: str) -> Iterator[tuple[str, ast.FunctionDef | ast.ClassDef]]:
    for path in sorted((ROOT / package).rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.FunctionDef | ast.ClassDef) and ast.get_docstring(node):
                yield f"{path.relative_to(ROOT)}:{node.lineno} {node.name}", node


@pytest.mark.parametrize("package", PACKAGES)
def test_every_parameter_that_a_docstring_describes_exists(package: str) -> None:
    wrong = []
    for where, node in documented(package):
        if isinstance(node, ast.ClassDef) and node.bases and not there(node):
            continue  # what it describes is inherited
        missing = [n for n in described(ast.get_docstring(node) or "") if n not in there(node)]
        wrong += [f"{where}: {name}" for name in missing]
    assert wrong == []
