"""Which tests run which lines, recorded by coverage.py one test file at a time."""

from __future__ import annotations

import ast
import json
import os
from collections import defaultdict
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from mutants.operators import Mutant

RECORDING_LIMIT = 90
"""Processor time after which no further test of a file is recorded [s]; slow ones never are."""
TEST_BUDGET = 30.0
"""Processor time of the tests that one mutant is run against [s]."""


class Recorder:
    """A pytest plugin that records lines of the sources by the test that ran them.

    What a fixture shared by several tests runs counts for all tests that ask for it.
    """

    def __init__(self, sources: list[str]) -> None:
        import coverage

        self.begun = _processor_time()
        self.coverage = coverage.Coverage(data_file=None, include=sources, config_file=False)
        self.coverage.start()
        self.last = self.begun
        self.seconds: dict[str, float] = defaultdict(float)
        self.fixtures: dict[str, list[str]] = {}
        self.failed: set[str] = set()

    def pytest_runtest_protocol(self, item: Any) -> None:
        if _processor_time() - self.begun > RECORDING_LIMIT:
            item.session.shouldstop = "recorded for long enough"
        self.last = _processor_time()
        self.fixtures[_name(item.nodeid)] = item.fixturenames
        self.coverage.switch_context(_name(item.nodeid))

    def pytest_fixture_setup(self, fixturedef: Any) -> None:
        if fixturedef.scope != "function":
            self.coverage.switch_context(f"fixture {fixturedef.argname}")

    def pytest_runtest_call(self, item: Any) -> None:
        self.coverage.switch_context(_name(item.nodeid))

    def pytest_runtest_logreport(self, report: Any) -> None:
        now = _processor_time()
        self.seconds[_name(report.nodeid)] += now - self.last
        self.last = now
        if report.failed:
            self.failed.add(_name(report.nodeid))

    def pytest_runtest_logfinish(self) -> None:
        self.coverage.switch_context("")

    def lines(self) -> dict[str, dict[str, list[int]]]:
        """Test that passed -> source file -> lines that it runs."""
        self.coverage.stop()
        data = self.coverage.get_data()
        of: dict[str, dict[str, set[int]]] = defaultdict(lambda: defaultdict(set))
        for path in data.measured_files():
            for line, contexts in data.contexts_by_lineno(path).items():
                for context in contexts:
                    of[context][os.path.relpath(path)].add(line)
        found: dict[str, dict[str, list[int]]] = {}
        for test in self.seconds.keys() - self.failed:
            found[test] = {}
            for context in (test, *(f"fixture {name}" for name in self.fixtures[test])):
                for path, lines in of[context].items():
                    found[test][path] = sorted({*found[test].get(path, []), *lines})
        return found


def _processor_time() -> float:
    """Of this process and its children [s]: how busy the machine is does not matter."""
    return sum(os.times()[:4])


def _name(nodeid: str) -> str:
    """A test without its parameters."""
    return nodeid.split("[")[0]


def record(test_file: str, sources: list[str], out: Path) -> None:
    """Run one test file in this process and write which of its tests run which lines."""
    import pytest

    recorder = Recorder(sources)
    pytest.main(
        [test_file, "-q", "-n0", "-m", "not slow", "-p", "no:cacheprovider"], plugins=[recorder]
    )
    out.write_text(json.dumps({"lines": recorder.lines(), "seconds": recorder.seconds}))


@dataclass
class Touched:
    """Which tests run which lines of functions; what runs at import says nothing of a test.

    Parameters
    ----------
    bodies : source file -> lines of its functions
    seconds : test -> how long it takes [s]
    lines : source file -> test -> lines of functions that it runs
    """

    bodies: dict[str, set[int]]
    seconds: dict[str, float] = field(default_factory=dict)
    lines: dict[str, dict[str, set[int]]] = field(default_factory=lambda: defaultdict(dict))

    def add(self, recorded: dict[str, Any]) -> None:
        for test, files in recorded["lines"].items():
            self.seconds[test] = recorded["seconds"][test]
            for path, lines in files.items():
                if called := self.bodies.get(path, set()).intersection(lines):
                    self.lines[path][test] = called

    def tests_for(self, mutant: Mutant, area: list[str]) -> list[str]:
        """The tests that may notice a mutant, the closest and quickest first, within TEST_BUDGET.

        These are the tests that run its line and then those at the mirrored place. Where the line
        is hidden, they are those that call anything in its module, or else in one of its area.
        """
        statement = set(range(mutant.first, mutant.last + 1))
        here = self.lines.get(mutant.path, {})
        tests = {test for test, lines in here.items() if lines & statement}
        if mutant.hidden:
            tests = set(here) or {test for path in area for test in self.lines.get(path, {})}
        beside = {test for test in self.seconds if distance(mutant.path, test) <= 1} - tests
        if mutant.hidden:
            tests, beside = tests | beside, set[str]()
        ordered = [
            test
            for some in (tests, beside)
            for test in sorted(some, key=lambda t: (distance(mutant.path, t), self.seconds[t]))
        ]
        chosen, spent = [], 0.0
        for test in ordered:
            spent += self.seconds[test]
            if chosen and spent > TEST_BUDGET:
                continue
            chosen.append(test)
        return chosen


def body_lines(source: str) -> set[int]:
    """The lines of all functions of a module."""
    functions = (n for n in ast.walk(ast.parse(source)) if isinstance(n, ast.FunctionDef))
    return {
        line
        for function in functions
        for statement in function.body
        for line in range(statement.lineno, (statement.end_lineno or statement.lineno) + 1)
    }


def distance(path: str, test: str) -> int:
    """How far a test stands from the mirrored place of a module; 0 for the module's own."""
    file = Path(test.split("::")[0])
    mirrored = Path("tests") / path
    if file == mirrored.with_name(f"test_{mirrored.name}"):
        return 0
    common = os.path.commonpath([file.parent, mirrored.parent])
    return 1 + len(mirrored.parent.parts) - len(Path(common).parts)
