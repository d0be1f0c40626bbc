"""Mutants of a module: its code with one operator, number, condition or statement changed.

Left alone are docstrings, messages, annotations, decorators, assertions, and calls that only tell a
person how far the work is.
"""

from __future__ import annotations

import ast
import re
from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

SWAPS: dict[type[ast.AST], list[str]] = {
    ast.Lt: ["<=", ">"], ast.LtE: ["<", ">"], ast.Gt: [">=", "<"], ast.GtE: [">", "<"],
    ast.Eq: ["!="], ast.NotEq: ["=="], ast.Is: ["is not"], ast.IsNot: ["is"],
    ast.In: ["not in"], ast.NotIn: ["in"], ast.And: ["or"], ast.Or: ["and"],
    ast.Add: ["-"], ast.Sub: ["+"], ast.Mult: ["/"], ast.Div: ["*"], ast.FloorDiv: ["*"],
    ast.Mod: ["*"], ast.Pow: ["*"], ast.BitAnd: ["|"], ast.BitOr: ["&"],
}  # fmt: skip
"""Operator -> what it is changed into."""
SYMBOLS = {
    ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!=",
    ast.Is: "is", ast.IsNot: r"is\s+not", ast.In: "in", ast.NotIn: r"not\s+in", ast.And: "and",
    ast.Or: "or", ast.Add: r"\+", ast.Sub: "-", ast.Mult: r"\*", ast.Div: "/",
    ast.FloorDiv: "//", ast.Mod: "%", ast.Pow: r"\*\*", ast.BitAnd: "&", ast.BitOr: r"\|",
}  # fmt: skip
NAMES = {
    "min": "max", "max": "min", "minimum": "maximum", "maximum": "minimum", "any": "all",
    "all": "any", "argmin": "argmax", "argmax": "argmin", "floor": "ceil", "ceil": "floor",
    "sin": "cos", "cos": "sin",
}  # fmt: skip
"""Function -> the one that takes its place."""
SILENT = {"print", "progress", "with_progress", "say", "warn", "cast", "field", "TypeVar"}
"""Functions whose calls are left alone: they only tell, or declare."""
COMPILERS = {"compiled", "inlined", "effect_kernel"}
"""Decorators of kernels."""


@dataclass(frozen=True)
class Mutant:
    """One small change of one module.

    `first` and `last` are the lines of its statement, which is hidden if no test is seen to run it:
    it is in a compiled kernel, or runs at import.
    """

    area: str
    path: str
    line: int
    start: int
    end: int
    text: str
    original: str
    mutant: str
    first: int
    last: int
    hidden: bool
    verdict: str = ""
    killed_by: str = ""
    seconds: float = 0.0

    def applied_to(self, source: bytes) -> bytes:
        """The module with the change."""
        return source[: self.start] + self.text.encode() + source[self.end :]

    def is_python(self, root: Path) -> bool:
        """Whether the changed module can still be parsed."""
        try:
            ast.parse(self.applied_to((root / self.path).read_bytes()))
        except SyntaxError:
            return False
        return True


class Finder(ast.NodeVisitor):
    """Every change of a module's code that the operators allow, as (start, end, text) in bytes."""

    def __init__(self, source: str) -> None:
        self.source = source.encode()
        self.starts = [0]
        for row in self.source.splitlines(keepends=True):
            self.starts.append(self.starts[-1] + len(row))
        self.found: list[tuple[int, int, str, int, int, bool]] = []
        self.first, self.last = 1, 1
        self.hidden = True

    def place(self, node: ast.AST, *, end: bool = False) -> int:
        where: Any = node
        if end:
            return self.starts[where.end_lineno - 1] + where.end_col_offset
        return self.starts[where.lineno - 1] + where.col_offset

    def add(self, start: int, end: int, text: str) -> None:
        self.found.append((start, end, text, self.first, self.last, self.hidden))

    def replace(self, node: ast.AST, text: str) -> None:
        self.add(self.place(node), self.place(node, end=True), text)

    def swap(self, operator: ast.AST, left: ast.AST, right: ast.AST, assigned: str = "") -> None:
        """Change the operator that stands between two nodes."""
        start, end = self.place(left, end=True), self.place(right)
        symbol = SYMBOLS.get(type(operator))
        between = re.search(rf"{symbol}{assigned}".encode(), self.source[start:end])
        if symbol and between:
            for text in SWAPS[type(operator)]:
                self.add(start + between.start(), start + between.end(), text + assigned)

    def negate(self, test: ast.expr) -> None:
        if isinstance(test, ast.UnaryOp):
            return  # `not` is taken away elsewhere
        code = self.source[self.place(test) : self.place(test, end=True)].decode()
        self.replace(test, f"(not ({code}))")

    def visit(self, node: ast.AST) -> None:
        if isinstance(node, ast.stmt):
            before = self.first, self.last
            body = getattr(node, "body", None)
            last = body[0].lineno - 1 if body else node.end_lineno or node.lineno
            self.first, self.last = node.lineno, max(last, node.lineno)
            super().visit(node)
            self.first, self.last = before
        else:
            super().visit(node)

    def visit_FunctionDef(self, node: ast.FunctionDef) -> None:
        for default in (*node.args.defaults, *filter(None, node.args.kw_defaults)):
            self.visit(default)
        before = self.hidden
        decorators = {ast.unparse(decorator).split("(")[0] for decorator in node.decorator_list}
        self.hidden = not decorators.isdisjoint(COMPILERS)
        for statement in node.body:
            self.visit(statement)
        self.hidden = before

    def visit_ClassDef(self, node: ast.ClassDef) -> None:
        for statement in node.body:
            self.visit(statement)

    def visit_Import(self, node: ast.Import) -> None: ...

    def visit_ImportFrom(self, node: ast.ImportFrom) -> None: ...

    def visit_Assert(self, node: ast.Assert) -> None: ...

    def visit_JoinedStr(self, node: ast.JoinedStr) -> None: ...

    def visit_AnnAssign(self, node: ast.AnnAssign) -> None:
        if node.value is not None and "TypeAlias" not in ast.unparse(node.annotation):
            self.visit(node.value)

    def visit_Raise(self, node: ast.Raise) -> None:
        self.replace(node, "pass")

    def visit_Expr(self, node: ast.Expr) -> None:
        if isinstance(node.value, ast.Call) and not self.is_silent(node.value):
            self.replace(node, "pass")
        self.generic_visit(node)

    def visit_Return(self, node: ast.Return) -> None:
        if node.value is not None and not isinstance(node.value, ast.Constant):
            self.replace(node.value, "None")
        self.generic_visit(node)

    def visit_Assign(self, node: ast.Assign) -> None:
        if isinstance(node.targets[0], ast.Subscript | ast.Attribute):
            self.replace(node, "pass")
        if ast.unparse(node.targets[0]) != "__all__":
            self.generic_visit(node)

    def visit_AugAssign(self, node: ast.AugAssign) -> None:
        self.replace(node, "pass")
        self.swap(node.op, node.target, node.value, assigned="=")
        self.generic_visit(node)

    def visit_Break(self, node: ast.Break) -> None:
        self.replace(node, "continue")

    def visit_Continue(self, node: ast.Continue) -> None:
        self.replace(node, "break")

    def visit_If(self, node: ast.If) -> None:
        if ast.unparse(node.test) in ("TYPE_CHECKING", "__name__ == '__main__'"):
            return
        self.negate(node.test)
        self.generic_visit(node)

    def visit_While(self, node: ast.While) -> None:
        self.negate(node.test)
        self.generic_visit(node)

    def visit_IfExp(self, node: ast.IfExp) -> None:
        self.negate(node.test)
        self.generic_visit(node)

    def visit_comprehension(self, node: ast.comprehension) -> None:
        for test in node.ifs:
            self.negate(test)
        self.generic_visit(node)

    def visit_Compare(self, node: ast.Compare) -> None:
        for left, operator, right in zip(
            [node.left, *node.comparators], node.ops, node.comparators, strict=False
        ):
            self.swap(operator, left, right)
        self.generic_visit(node)

    def visit_BoolOp(self, node: ast.BoolOp) -> None:
        for left, right in zip(node.values, node.values[1:], strict=False):
            self.swap(node.op, left, right)
        self.generic_visit(node)

    def visit_BinOp(self, node: ast.BinOp) -> None:
        if not isinstance(node.left, ast.Constant | ast.JoinedStr) or not isinstance(
            getattr(node.left, "value", None), str
        ):
            self.swap(node.op, node.left, node.right)
        self.generic_visit(node)

    def visit_UnaryOp(self, node: ast.UnaryOp) -> None:
        if isinstance(node.op, ast.Not | ast.USub) and not isinstance(node.operand, ast.Constant):
            self.add(self.place(node), self.place(node.operand), "")
        self.generic_visit(node)

    def visit_Call(self, node: ast.Call) -> None:
        if self.is_silent(node):
            return
        name = node.func
        if isinstance(name, ast.Name | ast.Attribute):
            end = self.place(name, end=True)
            called = name.id if isinstance(name, ast.Name) else name.attr
            if called in NAMES:
                self.add(end - len(called), end, NAMES[called])
        self.generic_visit(node)

    def visit_keyword(self, node: ast.keyword) -> None:
        if node.arg not in ("strict", "where", "source", "title"):
            self.visit(node.value)

    def visit_Constant(self, node: ast.Constant) -> None:
        if isinstance(node.value, bool):
            self.replace(node, str(not node.value))
        elif isinstance(node.value, int | float):
            self.replace(node, repr(node.value + 1))

    @staticmethod
    def is_silent(node: ast.Call) -> bool:
        return ast.unparse(node.func).split(".")[-1] in SILENT


def mutants_of(area: str, root: Path, path: str) -> Iterator[Mutant]:
    """Every mutant of one module."""
    source = (root / path).read_text(encoding="utf-8")
    finder = Finder(source)
    finder.visit(ast.parse(source))
    for start, end, text, first, last, hidden in finder.found:
        line = bisect_right(finder.starts, start)
        begin, after = finder.starts[line - 1], finder.starts[line]
        rest = finder.source[end:].split(b"\n", 1)[0]
        yield Mutant(
            area=area,
            path=path,
            line=line,
            start=start,
            end=end,
            text=text,
            original=finder.source[begin:after].decode().strip(),
            mutant=(finder.source[begin:start] + text.encode() + rest).decode().strip(),
            first=first,
            last=last,
            hidden=hidden,
        )
