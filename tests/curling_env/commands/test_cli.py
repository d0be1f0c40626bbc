"""The command gathers sub-commands, isolates their errors, and reports them in one line."""

from __future__ import annotations

import errno
import importlib.metadata
import io
import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import pytest
import typer

from curling_env.commands import cli
from curling_env.commands.options import Measured, grouped
from curling_env.errors import InputError, OutputError


def greet(name: str, loud: Annotated[bool, typer.Option(help="Shout.")] = False) -> None:
    """Say hello to a sweeper.

    More about sweepers.
    """
    cli.print_json({"hello": name.upper() if loud else name})


@grouped
def measure(*, results: Measured) -> None:
    """Measure a draw."""
    results.show({"hog_to_hog": 14.2}, "14.2 s hog to hog")


def refuse() -> None:
    """Refuse."""
    raise InputError("expected μ > 0,\nfound -1", source="ice.json", where="row 3")


def fill_the_disk() -> None:
    raise OutputError("a.csv: cannot be written: no space left on device")


def lose_a_file() -> None:
    raise FileNotFoundError(errno.ENOENT, "No such file or directory", "stones.json")


def interrupt() -> None:
    raise KeyboardInterrupt


def break_the_pipe() -> None:
    raise OSError(errno.EPIPE, "Broken pipe")


def want_torch() -> None:
    raise ModuleNotFoundError("No module named 'torch'", name="torch")


def have_a_bug() -> None:
    raise ZeroDivisionError


def end_too_early() -> None:
    raise EOFError


def take_all_memory() -> None:
    raise MemoryError


def nest_too_deep() -> None:
    nest_too_deep()


def say_much() -> None:
    raise InputError("\x1b[31m" + 1_000_000 * "sweep " + "the end")


@pytest.fixture(autouse=True)
def declared(monkeypatch: pytest.MonkeyPatch) -> None:
    """The commands of this file in place of the installed ones, and one that does not exist."""
    functions = (
        greet,
        measure,
        refuse,
        fill_the_disk,
        lose_a_file,
        interrupt,
        break_the_pipe,
        want_torch,
        have_a_bug,
        end_too_early,
        take_all_memory,
        nest_too_deep,
        say_much,
    )
    entries = [
        importlib.metadata.EntryPoint(f.__name__, f"{__name__}:{f.__name__}", cli.COMMAND_GROUP)
        for f in functions
    ]
    absent = importlib.metadata.EntryPoint("absent", "no_such_package:run", cli.COMMAND_GROUP)

    def entry_points(**criteria: str) -> list[importlib.metadata.EntryPoint]:
        assert criteria == {"group": cli.COMMAND_GROUP}
        return [*entries, absent]

    monkeypatch.setattr(importlib.metadata, "entry_points", entry_points)


def test_a_command_writes_its_result_to_stdout(curling: Callable[..., Any]) -> None:
    result = curling("greet", "Ada", "--loud")
    assert (result.status, result.err) == (0, "")
    assert result.json() == {"hello": "ADA"}


@pytest.mark.parametrize(
    ("terminal", "arguments", "out", "err"),
    [
        (True, [], "14.2 s hog to hog\n", ""),
        (True, ["--json"], '{\n  "hog_to_hog": 14.2\n}\n', ""),
        (False, [], '{\n  "hog_to_hog": 14.2\n}\n', "14.2 s hog to hog\n"),
        (False, ["--json"], '{\n  "hog_to_hog": 14.2\n}\n', ""),
    ],
)
def test_a_terminal_gets_the_sentence_and_a_program_the_json(
    curling: Callable[..., Any],
    monkeypatch: pytest.MonkeyPatch,
    terminal: bool,
    arguments: list[str],
    out: str,
    err: str,
) -> None:
    monkeypatch.setattr(sys.stdout, "isatty", lambda: terminal, raising=False)
    result = curling("measure", *arguments)
    assert (result.status, result.out, result.err) == (0, out, err)


@pytest.mark.parametrize("arguments", [[], ["--help"], ["-h"]])
def test_the_list_names_every_command_with_its_first_line(
    curling: Callable[..., Any], arguments: list[str]
) -> None:
    result = curling(*arguments)
    assert result.status == 0
    assert "Say hello to a sweeper." in result.out
    assert "More about sweepers." not in result.out
    assert "(not available: No module named" in result.out


def test_the_help_of_a_command_is_its_whole_docstring(curling: Callable[..., Any]) -> None:
    result = curling("greet", "--help")
    assert result.status == 0
    assert "Usage: curling greet" in result.out
    assert "More about sweepers." in result.out
    assert "Shout." in result.out


def test_the_options_of_a_group_share_a_panel_of_the_help(curling: Callable[..., Any]) -> None:
    shown = curling("measure", "--help").out
    assert re.search(r"Output:\n +--json +Print JSON.*\n +--units .*\n.* --help", shown)
    assert curling("measure", "--units", "miles").complaint


def test_version(curling: Callable[..., Any]) -> None:
    result = curling("--version")
    assert result.status == 0
    assert result.out == f"curling-sheet {importlib.metadata.version('curling-sheet')}\n"


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["refuse"], "ice.json, row 3: expected μ > 0, found -1"),
        (["fill_the_disk"], "a.csv: cannot be written: no space left on device"),
        (["lose_a_file"], "stones.json: no such file or directory"),
        (["want_torch"], "pip install 'curling-sheet[train]'"),
        (["absent", "--some", "x"], "the command absent cannot be loaded: No module named"),
        (["gret"], "No such command 'gret'"),
        (["greet"], "Missing argument 'name'. (see `curling greet --help`)"),
        (["greet", "Ada", "Bea"], "unexpected extra argument"),
        (["greet", "Ada", "--lowd"], "--lowd"),
    ],
)
def test_errors_are_reported_in_one_line(
    curling: Callable[..., Any], arguments: list[str], complaint: str
) -> None:
    result = curling(*arguments)
    assert complaint in result.complaint
    assert result.out == ""


def test_an_interrupt_reports_that_nothing_was_kept(curling: Callable[..., Any]) -> None:
    result = curling("interrupt")
    message = "curling: interrupted; nothing was written; repeat the command to start again\n"
    assert (result.status, result.out, result.err) == (130, "", message)


def test_an_internal_error_is_reported_as_such(
    curling: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(ZeroDivisionError):  # as in all tests
        curling("have_a_bug")
    monkeypatch.delenv(cli.TRACEBACK)
    complaint = curling("have_a_bug").complaint
    assert "internal error" in complaint
    assert "ZeroDivisionError" in complaint


@pytest.mark.parametrize(
    ("command", "complaint"),
    [
        ("end_too_early", "a file ends before it is complete"),
        ("take_all_memory", "not enough memory"),
        ("nest_too_deep", "nested too deep"),
    ],
)
def test_every_other_end_is_one_line_too(
    curling: Callable[..., Any], command: str, complaint: str
) -> None:
    assert complaint in curling(command).complaint


def test_a_line_has_at_most_300_characters_that_any_terminal_can_show(
    curling: Callable[..., Any],
) -> None:
    message = curling("say_much").err
    assert len(message) <= 301
    assert message.endswith("the end\n")
    assert "\x1b" not in message


def test_a_bar_on_a_terminal_follows_counts_and_shares(monkeypatch: pytest.MonkeyPatch) -> None:
    shown = io.StringIO()
    monkeypatch.setattr(shown, "isatty", lambda: True)
    monkeypatch.setattr(sys, "stderr", shown)
    with cli.progress_bar("piece") as progress:
        for what, done, total in (("sweep", 0, 300), ("sweep", 300, 300), ("fit", 0.4, 1.0)):
            progress(what, done, total)
            time.sleep(0.6)
    assert "300/300" in shown.getvalue()
    assert "fit:  40%" in shown.getvalue()


# --- the process as a whole


def run(program: str, **options: Any) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", program],
        stderr=subprocess.PIPE,
        text=True,
        check=False,
        **options,
    )


MAIN = "import sys; from curling_env.commands.cli import main; sys.exit(main(sys.argv[1:]))"
ONLY_WORK = """
import sys, typer, curling_env.commands.cli as cli
app = typer.Typer()
app.callback()(lambda: None)
app.command("work")(work)
cli._app = lambda arguments: app
sys.exit(cli.main(["work"]))
"""


@pytest.mark.parametrize("lines", [1, 100_000])  # noticed at the end, or half-way
def test_a_reader_that_leaves_early_is_no_error(lines: int) -> None:
    done = run(
        "import os\n"
        "reader, writer = os.pipe()\n"
        "os.dup2(writer, 1); os.close(writer); os.close(reader)\n"
        "def work() -> None:\n"
        f"    for _ in range({lines}): print('sweep')\n" + ONLY_WORK
    )
    assert (done.returncode, done.stderr) == (
        2,
        "curling: the program that reads the result ended before all of it was written\n",
    )


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="this system has no /dev/full")
def test_a_full_disk_behind_stdout_is_reported() -> None:
    with Path("/dev/full").open("w") as full:
        done = run(MAIN, stdout=full)
    assert (done.returncode, done.stderr) == (2, "curling: no space left on device\n")


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_termination_removes_half_written_files(tmp_path: Path, number: signal.Signals) -> None:
    done = run(
        "import os, signal, time\n"
        f"signal.signal({number:d}, signal.SIG_DFL)\n"  # the tests may run under nohup
        "from curling_env.infrastructure.files.writing import atomic_path\n"
        "def work() -> None:\n"
        f"    with atomic_path({str(tmp_path / 'a.txt')!r}) as draft:\n"
        "        draft.write_text('half')\n"
        f"        os.kill(os.getpid(), {number:d})\n"
        "        time.sleep(60)\n" + ONLY_WORK
    )
    assert done.returncode == 128 + number
    assert list(tmp_path.iterdir()) == []


def test_a_command_under_nohup_is_not_ended_by_its_terminal() -> None:
    done = run(
        "import os, signal\n"
        "signal.signal(signal.SIGHUP, signal.SIG_IGN)\n"  # as nohup does
        "def work() -> None:\n"
        "    os.kill(os.getpid(), signal.SIGHUP)\n" + ONLY_WORK
    )
    assert (done.returncode, done.stderr) == (0, "")


def test_printed_text_never_goes_into_a_file(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    done = run(
        "def work() -> None:\n"
        "    from curling_env.commands.cli import conclude\n"
        f"    with open({str(path)!r}, 'w') as file:\n"  # would take the place of a closed stdout
        "        conclude({'x': 1}, 'a sentence')\n"
        "        file.write('mine')\n" + ONLY_WORK,
        preexec_fn=lambda: os.closerange(0, 2),
    )
    assert (done.returncode, done.stderr) == (0, "a sentence\n")
    assert path.read_text() == "mine"


def test_letters_that_the_terminal_does_not_know_are_escaped() -> None:
    done = run(
        "def work() -> None:\n"
        "    from curling_env.commands.cli import print_json\n"
        "    print_json({'film': 'Zürich \\U0001f94c \\udcff'})\n" + ONLY_WORK,
        stdout=subprocess.PIPE,
        env={**os.environ, "PYTHONIOENCODING": "ascii"},
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert json.loads(done.stdout) == {"film": "Zürich \U0001f94c \udcff"}


@pytest.mark.parametrize("threads", ["0", "-1", "x"])
def test_no_threads_for_numba_stop_no_command(threads: str) -> None:
    done = run(
        "def work() -> None:\n    import numba\n" + ONLY_WORK,
        env={**os.environ, "NUMBA_NUM_THREADS": threads},
    )
    assert (done.returncode, done.stderr) == (0, "")
