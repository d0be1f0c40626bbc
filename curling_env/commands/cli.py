"""The `curling` command, and what its sub-commands share.

A sub-command is a function with Typer annotations, declared under the entry-point group
`curling.commands`. So no lower package imports a higher one, and anyone can add a command. Only the
command that is run is imported. One that cannot be imported is listed with the reason and does not
disturb the others.
"""

from __future__ import annotations

import errno
import importlib.metadata
import json
import os
import re
import signal
import sys
from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NoReturn

import typer

from curling_env.commands.outputs import Writes, guarded
from curling_env.commands.terminal import (
    only_our_words,
    open_streams,
    remarks_at_the_end,
    say,
    shortened,
)
from curling_env.errors import CurlingError
from curling_env.infrastructure.files.storage import format_json
from curling_env.infrastructure.files.writing import CommandFiles, command_files
from curling_env.infrastructure.plugins import what_hides
from curling_env.infrastructure.provenance import typed
from curling_env.typing import Progress
from curling_env.units import Units

if TYPE_CHECKING:
    from curling_env.ice import Ice

__all__ = [
    "IceOption",
    "OutputDirectory",
    "OutputFile",
    "SeedOption",
    "TracksFile",
    "Writes",
    "main",
    "print_json",
    "progress_bar",
    "say",
    "say_what_is_lacking",
]

COMMAND_GROUP = "curling.commands"

BAD_INPUT = 2
"""Exit status for bad usage, bad input and output that cannot be written."""
INTERRUPTED = 130
"""128 + signal number, as shells report SIGINT."""
TRACEBACK = "CURLING_TRACEBACK"
"""Environment variable: where it is set, a mistake of the program shows its place in the code."""

EXTRAS = {
    "torch": "train",
    "stable_baselines3": "train",
    "tensorboard": "train",
    "yaml": "train",
    "pygame": "viewer",
    "pettingzoo": "game",
    "ray": "ray",
    "ray.rllib": "rllib",
    "pyarrow": "parquet",
    "h5netcdf": "science",
    "h5py": "science",
    "minari": "offline",
    "starlette": "digital-curling",
    "uvicorn": "digital-curling",
    "jinja2": "app",
}
"""Module -> the extra of the distribution that brings it."""

HELP = """From film to throw: measure the friction of curling ice, simulate stones, plan throws.

\b
A first look:       curling demo
Film to throws:     curling corners FILM.mp4 -o SCENE.json
                    curling track FILM.mp4 --scene SCENE.json -o tracks.csv
                    curling throws tracks.csv
Throws to ice:      curling estimate tracks.csv -o ice.json
Ice to throw:       curling plan --ice ice.json --target 0,17.37
                    curling throw --ice ice.json --speed 2.1 --angle 0 --spin 1.5

Lengths are in metres, times in seconds, angles in radians. An ICE is an ice file or the name of a
preset: standard (championship ice), fitted (the same, fitted to what is published), club (slower
and straighter), fcv1 (the law of Digital Curling) or paper (uniform friction).
"""

# --- what sub-commands share -------------------------------------------------------------------

IceOption = Annotated[
    str,
    typer.Option(
        "--ice",
        metavar="ICE",
        help="An ice file, or a preset: standard, fitted, club, fcv1, paper.",
    ),
]
SeedOption = Annotated[
    int,
    typer.Option(
        "--seed", min=0, help="Seed of all randomness; the same seed gives the same result."
    ),
]
OutputFile = Annotated[
    Path, typer.Option("-o", "--output", metavar="FILE", help="File for the result."), Writes()
]
TracksFile = Annotated[
    Path,
    typer.Option("-o", "--output", metavar="FILE", help="File for the result."),
    Writes(kinds=("tracks",), added_by="append"),
]
OutputDirectory = Annotated[
    Path,
    typer.Option("-o", "--output", metavar="DIR", help="Directory for the results."),
    Writes(folder=True),
]


DeliveryOption = Annotated[
    str,
    typer.Option(
        help="Where throws begin: hog-line, tee-line, or hack as in Digital Curling, with π/2 "
        "rad/s and at most 4 m/s."
    ),
]
JsonOption = Annotated[
    bool,
    typer.Option("--json", help="Print the result as JSON, as it is where stdout is no terminal."),
]
UnitsOption = Annotated[
    Units, typer.Option("--units", help="What lengths are told in where people read them.")
]


def conclude(document: Any, *sentences: str, as_json: bool = False) -> None:
    """Print the result of a command: its sentences on a terminal, and JSON for programs.

    Where stdout is no terminal it gets the JSON, and the sentences go to stderr.

    Parameters
    ----------
    document : the result as plain numbers, lists and dictionaries
    sentences : what a person wants to know of it, in one sentence or two
    as_json : whether the JSON is wanted on a terminal too, and no sentence
    """
    if sys.stdout.isatty() and not as_json:
        for sentence in sentences:
            print(sentence)
        return
    if not as_json:
        for sentence in sentences:
            say(sentence)
    print_json(document)


def print_json(document: Any) -> None:
    """Print JSON on stdout, in ASCII where that knows no other letters."""
    text = format_json(document)
    try:
        text.encode(sys.stdout.encoding or "utf-8")
    except UnicodeEncodeError:  # other letters stand in texts only, where JSON can escape them
        text = re.sub(r"[^\x00-\x7f]", lambda letter: json.dumps(letter[0])[1:-1], text)
    print(text)


@contextmanager
def progress_bar(unit: str = "") -> Generator[Progress]:
    """A `Progress` that draws a bar on a terminal (stderr), which vanishes when done.

    Parameters
    ----------
    unit : what is counted, such as ``frame``; a total of 1 is drawn in per cent
    """
    from tqdm import tqdm

    bar: Any = None

    def show(what: str, done: float, total: float = 1.0, /) -> None:
        nonlocal bar
        share = total == 1.0
        if bar is None or bar.total != (100 if share else total or None):
            if bar is not None:
                bar.close()
            # Delayed, so that work which is refused or done at once says only that.
            bar = tqdm(
                total=100 if share else total or None,
                unit="%" if share else unit,
                leave=False,
                delay=0.5,
                file=sys.stderr,
                disable=not sys.stderr.isatty(),  # a file wants no bar, and a refusal is one line
                bar_format="{desc}: {percentage:3.0f}%|{bar}| {elapsed}" if share else None,
            )
        bar.set_description(what, refresh=False)
        bar.update((100 * done if share else done) - bar.n)

    try:
        yield show
    finally:
        if bar is not None:
            bar.close()


def say_what_is_lacking(*ices: Ice) -> None:
    """Say on stderr, once for all of the ices, what they lack of what their tracks show."""
    from curling_env.physics.ice_remarks import what_is_lacking

    for remark in dict.fromkeys(remark for ice in ices for remark in what_is_lacking(ice)):
        say(remark)


class CommandError(CurlingError):
    """A declared sub-command cannot be loaded."""


# --- the command -------------------------------------------------------------------------------


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one sub-command.

    Parameters
    ----------
    arguments : what follows `curling` on the command line; None takes those of the process

    Returns
    -------
    exit status: 0, or 2 for bad usage or bad input, which stderr then explains in one line
    """
    arguments = list(sys.argv[1:] if arguments is None else arguments) or ["--help"]
    # OpenCV and FFmpeg would report a bad film on stderr as well, beside our one line.
    os.environ.setdefault("OPENCV_LOG_LEVEL", "SILENT")
    os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")
    if os.environ.get("NUMBA_NUM_THREADS", "").strip() == "0":
        del os.environ[
            "NUMBA_NUM_THREADS"
        ]  # numba does not load with it, and needs no threads here
    open_streams()
    files = CommandFiles()
    try:
        with only_our_words():
            return _run(arguments, files)
    except KeyboardInterrupt:  # a second one, while the first is answered
        return INTERRUPTED


def _run(arguments: list[str], files: CommandFiles) -> int:
    """Run a command and answer whatever it ends with."""
    try:
        with _orderly_termination(), typed(arguments), command_files(files), remarks_at_the_end():
            status = _app(arguments)(args=arguments, prog_name="curling", standalone_mode=False)
            sys.stdout.flush()  # a full disk behind a redirection is noticed here
            if status == INTERRUPTED:  # so Typer reports an interrupt
                raise KeyboardInterrupt
            _say_what_is_not_kept()
            return status if isinstance(status, int) else 0
    except typer.TyperException as error:
        return _complain(f"{error.format_message()} (`{_help_for(error)}` tells more)")
    except (KeyboardInterrupt, typer.Abort):
        _remark(f"interrupted; {_what_stays(files)}")
        return INTERRUPTED
    except (BrokenPipeError, SystemExit) as error:
        # Typer, where it notices first, asks for an end without a word.
        if isinstance(error, SystemExit) and not isinstance(error.__context__, BrokenPipeError):
            raise
        _mute_stdout()
        told = "whoever read the result has ended before all of it was written"
        return _complain(told + _and_what_stays(files))
    except Exception as error:  # every other end is one line too
        return _complain(_words_for(error) + _and_what_stays(files))


def _say_what_is_not_kept() -> None:
    """Say it where compiled code cannot be kept; a command without compiled code knows nothing."""
    cache: Any = sys.modules.get("curling_env.infrastructure.kernel_cache")
    if cache is not None:
        for text in cache.remarks():
            say(text)


def _words_for(error: Exception) -> str:
    """What an error means, in words; a mistake of the program is owned as one."""
    if isinstance(error, CurlingError):
        return str(error)
    if isinstance(error, ModuleNotFoundError) and (extra := _extra_of(error)) is not None:
        return (
            f"this needs {error.name}, which is not installed: pip install 'curling-sheet[{extra}]'"
        )
    if isinstance(error, MemoryError):
        return "this needs more memory than there is: give it less, or smaller files"
    if isinstance(error, RecursionError):
        return "something that was given is nested too deep"
    if isinstance(error, OSError):
        if error.errno == errno.ENOSPC:
            _mute_stdout()
        reason = (error.strerror or str(error)).lower()
        return f"{error.filename}: {reason}" if error.filename else reason
    if os.environ.get(TRACEBACK):
        raise error
    return (
        f"a mistake of this program, not of yours: {type(error).__name__}: "
        f"{str(error)[:120]} (please report it; with {TRACEBACK}=1 its place is shown)"
    )


def _what_stays(files: CommandFiles) -> str:
    """What an interrupted command leaves, and how to go on."""
    if files.kept:
        return files.kept
    written = _written(files)
    if written:
        return f"already written: {written}; repeat the command to make the rest"
    return "nothing was written; repeat the command to begin anew"


def _and_what_stays(files: CommandFiles) -> str:
    """What stands although a command has failed, such as a result of which nobody could be told."""
    if files.kept:
        return f"; {files.kept}"
    written = _written(files)
    return f"; written before: {written}" if written else ""


def _written(files: CommandFiles) -> str:
    """The files of a command that have taken their names, in words."""
    written = [path for path in dict.fromkeys(files.written) if path.exists()]
    names = ", ".join(str(path) for path in written[:3])
    return names if len(written) <= 3 else f"{names} and {len(written) - 3} more"


def _app(arguments: Sequence[str]) -> typer.Typer:
    """The command asked for, or all of them if it is not found (help, misspelling)."""
    declared = {entry.name: entry for entry in importlib.metadata.entry_points(group=COMMAND_GROUP)}
    app = typer.Typer(
        help=HELP,
        add_completion=False,
        rich_markup_mode=None,
        pretty_exceptions_enable=False,
        context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    )
    app.callback()(_version_option)
    wanted = next((word for word in arguments if not word.startswith("-")), "")
    for name in [wanted] if wanted in declared else sorted(declared):
        try:
            command = declared[name].load()
        except Exception as error:  # whatever a stranger's module may do
            # Any arguments: that the command is missing matters more than how it was called.
            lenient = {"ignore_unknown_options": True, "allow_extra_args": True}
            reason = shortened(what_hides(declared[name]) or str(error))
            app.command(name, context_settings=lenient)(_unavailable(name, error, reason))
            continue
        if isinstance(command, typer.Typer):
            app.add_typer(command, name=name)
        else:
            app.command(name)(guarded(command))
    return app


def _print_version(wanted: bool) -> None:
    if wanted:
        print(f"curling-sheet {importlib.metadata.version('curling-sheet')}")
        raise typer.Exit


def _version_option(
    version: Annotated[
        bool,
        typer.Option("--version", is_eager=True, callback=_print_version, help="Show the version."),
    ] = False,
) -> None:
    pass


def _unavailable(name: str, reason: Exception, text: str) -> Callable[..., NoReturn]:
    """What stands for a command that cannot be imported, in the list and when it is called."""
    text = text or type(reason).__name__

    def command(context: typer.Context) -> NoReturn:
        if isinstance(reason, ModuleNotFoundError) and _extra_of(reason):
            raise reason
        raise CommandError(f"the command {name} cannot be loaded: {text}") from reason

    command.__doc__ = f"(not available: {text})"
    command.__name__ = name
    return command


@contextmanager
def _orderly_termination() -> Generator[None]:
    """Let SIGTERM and a closed terminal unwind the stack, so that nothing half-written stays."""

    def stop(signal_number: int, frame: object) -> NoReturn:
        raise SystemExit(128 + signal_number)  # as shells report it

    before: dict[signal.Signals, Any] = {}
    try:
        for number in (signal.SIGTERM, signal.SIGHUP):
            # `nohup` lets a command outlive its terminal, and only that is left to it.
            if signal.getsignal(number) is not signal.SIG_IGN:
                before[number] = signal.signal(number, stop)
    except ValueError:  # not in the main thread, where signals are someone else's
        yield
        return
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _extra_of(error: ModuleNotFoundError) -> str | None:
    name = error.name or ""
    return EXTRAS.get(name) or EXTRAS.get(name.partition(".")[0])


def _help_for(error: typer.TyperException) -> str:
    context = getattr(error, "ctx", None)
    return f"{context.command_path if context else 'curling'} --help"


def _complain(problem: str) -> int:
    _remark(problem)
    return BAD_INPUT


def _remark(text: str) -> None:
    try:
        print(shortened(f"curling: {text}"), file=sys.stderr, flush=True)
    except (OSError, ValueError):  # nobody hears it
        return


def _mute_stdout() -> None:
    """Discard what is still buffered, which would fail again at exit: nobody reads it."""
    try:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except (OSError, ValueError):  # no file behind it
        return


if __name__ == "__main__":
    sys.exit(main())
