"""Compiled functions call only functions covered by their cache: the physics, and their own folder.

The name of a kernel's cache holds a digest of those sources (`curling_env.physics.compiled`); one
that called a kernel of another folder would go on running machine code that is out of date.
"""

from __future__ import annotations

import ast
from pathlib import Path

ROOT = Path(__file__).parent.parent
PACKAGES = ("curling_env", "friction_estimation", "agents")
DECORATORS = {"compiled", "part", "inlined", "effect_kernel"}


def kernels(tree: ast.Module) -> list[ast.FunctionDef]:
    return [
        node
        for node in tree.body
        if isinstance(node, ast.FunctionDef)
        and any(ast.unparse(d).split("(")[0] in DECORATORS for d in node.decorator_list)
    ]


def test_kernels_call_only_kernels_of_the_physics_and_of_their_folder() -> None:
    trees = {
        ".".join(path.relative_to(ROOT).with_suffix("").parts): ast.parse(path.read_bytes())
        for package in PACKAGES
        for path in (ROOT / package).rglob("*.py")
    }
    defined = {(name, kernel.name) for name, tree in trees.items() for kernel in kernels(tree)}
    assert len(defined) > 50
    wrong = []
    for name, tree in trees.items():
        folder, own = name.rpartition(".")[0], kernels(tree)
        if not own:
            continue
        imported = {
            alias.asname or alias.name: (node.module, alias.name)
            for node in ast.walk(tree)
            if isinstance(node, ast.ImportFrom)
            for alias in node.names
        }
        for kernel in own:
            for used in {node.id for node in ast.walk(kernel) if isinstance(node, ast.Name)}:
                module, function = imported.get(used, ("", ""))
                if (module, function) in defined and not (
                    f"{module}.".startswith("curling_env.physics.")
                    or str(module).rpartition(".")[0] == folder
                ):
                    wrong.append(f"{name}.{kernel.name} calls {module}.{function}")
    assert wrong == []
