"""The `curling` command: find a sub-command, run it and report its outcome in one line.

A sub-command is a function with Typer annotations, declared under the entry-point group
`curling.commands`. So no lower package imports a higher one, and anyone can add a command. Only the
command that is run is imported. One that cannot be imported is listed with the reason and does not
disturb the others.
"""

from __future__ import annotations

import errno
import importlib.metadata
import os
import signal
import sys
from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager, suppress
from contextvars import copy_context
from typing import Annotated, Any, NoReturn

import typer
import typer.core

from curling_env.commands.options import (
    OUTPUT,
    IceOption,
    OutputDirectory,
    OutputFile,
    SeedOption,
    TracksFile,
)
from curling_env.commands.outputs import Writes, guarded
from curling_env.commands.terminal import (
    conclude,
    print_json,
    print_remark,
    progress_bar,
    remarks_at_the_end,
    shortened,
)
from curling_env.errors import CurlingError
from curling_env.infrastructure.files.writing import CommandFiles, command_files
from curling_env.infrastructure.plugins import shadowed_by
from curling_env.infrastructure.provenance import typed
from curling_env.infrastructure.streams import open_streams, silenced_libraries

__all__ = [
    "IceOption",
    "OutputDirectory",
    "OutputFile",
    "SeedOption",
    "TracksFile",
    "Writes",
    "conclude",
    "main",
    "print_json",
    "print_remark",
    "progress_bar",
]

COMMAND_GROUP = "curling.commands"

BAD_INPUT = 2
"""Exit status for bad usage, bad input and output that cannot be written."""
INTERRUPTED = 130
"""128 + signal number, as shells report SIGINT."""
TRACEBACK = "CURLING_TRACEBACK"
"""Environment variable: shows where in the code an internal error was raised."""

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
"""Extra of the distribution that installs each module."""

HELP = """From film to throw: measure the friction of curling ice, simulate stones, plan throws.

\b
First look:     curling demo
Film to throws: curling corners FILM.mp4 -o SCENE.json
                curling track FILM.mp4 --scene SCENE.json -o tracks.csv
                curling throws tracks.csv
Throws to ice:  curling estimate tracks.csv -o ice.json
Ice to throw:   curling plan --ice ice.json --target 0,17.37
                curling throw --ice ice.json --speed 2.1 --angle 0 --spin 1.5

Lengths are in metres, times in seconds, angles in radians. An ICE is an ice file or a preset:
standard (championship ice), fitted (the same, fitted to published measurements), club (slower and
straighter), fcv1 (the law of Digital Curling) or paper (uniform friction).
"""


class CommandError(CurlingError):
    """A declared sub-command cannot be loaded."""


class PanelledCommand(typer.core.TyperCommand):
    """A command whose help lists its options by panel, in plain text."""

    def format_options(self, ctx: Any, formatter: Any) -> None:
        panels: dict[str, list[tuple[str, str]]] = {}
        for parameter in self.get_params(ctx):
            kind = "Arguments" if parameter.param_type_name == "argument" else "Options"
            if parameter.name == "help" and OUTPUT in panels:
                kind = OUTPUT
            title = getattr(parameter, "rich_help_panel", None) or kind
            if record := parameter.get_help_record(ctx):
                panels.setdefault(title, []).append(record)
        for title in sorted(panels, key=lambda title: title == OUTPUT):
            with formatter.section(title):
                formatter.write_dl(panels[title])


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one sub-command.

    Parameters
    ----------
    arguments : words after `curling` on the command line; None takes those of the process

    Returns
    -------
    exit status: 0, or 2 for bad usage or bad input, which stderr then explains in one line
    """
    arguments = list(sys.argv[1:] if arguments is None else arguments) or ["--help"]
    # OpenCV and FFmpeg would report a bad film on stderr too, in addition to our one line.
    os.environ.setdefault("OPENCV_LOG_LEVEL", "SILENT")
    os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")
    threads = os.environ.get("NUMBA_NUM_THREADS", "1").strip()
    if not (threads.isdecimal() and int(threads[:9]) > 0):
        del os.environ["NUMBA_NUM_THREADS"]  # numba would not load with it, and needs no threads
    open_streams()
    files = CommandFiles()
    try:
        with silenced_libraries():
            # Units that an option chooses hold for this command.
            return copy_context().run(_run, arguments, files)
    except KeyboardInterrupt:  # a second one, while the first is handled
        return INTERRUPTED


def _run(arguments: list[str], files: CommandFiles) -> int:
    """Run a command and report its outcome, whatever it is."""
    try:
        with _orderly_termination(), typed(arguments), command_files(files), remarks_at_the_end():
            status = _app(arguments)(args=arguments, prog_name="curling", standalone_mode=False)
            sys.stdout.flush()  # a full disk behind a redirection is noticed here
            if status == INTERRUPTED:  # Typer reports an interrupt like this
                raise KeyboardInterrupt
            cache: Any = sys.modules.get("curling_env.infrastructure.kernel_cache")
            for text in () if cache is None else cache.remarks():
                print_remark(text)
            return status if isinstance(status, int) else 0
    except typer.TyperException as error:
        context = getattr(error, "ctx", None)
        path = context.command_path if context else "curling"
        return _complain(f"{error.format_message()} (see `{path} --help`)")
    except (KeyboardInterrupt, typer.Abort):
        written = _written(files)
        left = f"already written: {written}; repeat the command for the rest"
        nothing = "nothing was written; repeat the command to start again"
        _remark(f"interrupted; {files.kept or (left if written else nothing)}")
        return INTERRUPTED
    except (BrokenPipeError, SystemExit) as error:
        # Typer, if it notices first, requests an exit without a message.
        if isinstance(error, SystemExit) and not isinstance(error.__context__, BrokenPipeError):
            raise
        _discard_stdout()
        reason = "the program that reads the result ended before all of it was written"
    except Exception as error:  # every other failure is one line too
        reason = _message_of(error)
    written = _written(files)
    left = files.kept or (f"already written: {written}" if written else "")
    return _complain(f"{reason}; {left}" if left else reason)


def _message_of(error: Exception) -> str:
    """Return the message for an error; an internal error is reported as such."""
    match error:
        case CurlingError():
            return str(error)
        case ModuleNotFoundError() if (extra := _extra_of(error)) is not None:
            install = f"pip install 'curling-sheet[{extra}]'"
            return f"this needs {error.name}, which is not installed: {install}"
        case MemoryError():
            return "not enough memory: use less data or smaller files"
        case RecursionError():
            return "the input is nested too deeply"
        case OSError():
            if error.errno == errno.ENOSPC:
                _discard_stdout()
            reason = (error.strerror or str(error)).lower()
            return f"{error.filename}: {reason}" if error.filename else reason
        case _ if os.environ.get(TRACEBACK):
            raise error
        case _:
            return (
                f"internal error, not a fault of your input: {type(error).__name__}: "
                f"{str(error)[:120]} (please report it; {TRACEBACK}=1 shows where it was raised)"
            )


def _written(files: CommandFiles) -> str:
    """List the files that a command has completed."""
    written = [path for path in dict.fromkeys(files.written) if path.exists()]
    names = ", ".join(str(path) for path in written[:3])
    return names if len(written) <= 3 else f"{names} and {len(written) - 3} more"


def _app(arguments: Sequence[str]) -> typer.Typer:
    """Return the requested command, or all of them if it is not found (help, misspelling)."""
    declared = {entry.name: entry for entry in importlib.metadata.entry_points(group=COMMAND_GROUP)}
    app = typer.Typer(
        help=HELP,
        add_completion=False,
        rich_markup_mode=None,  # plain help, with panels, on terminals and in pipes
        pretty_exceptions_enable=False,
        context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    )
    app.callback()(_version_option)
    wanted = next((word for word in arguments if not word.startswith("-")), "")
    for name in [wanted] if wanted in declared else sorted(declared):
        try:
            command = declared[name].load()
        except Exception as error:  # a third party's module may raise anything
            # Accept any arguments: the message about the missing command matters more than usage
            # errors.
            lenient = {"ignore_unknown_options": True, "allow_extra_args": True}
            reason = shortened(shadowed_by(declared[name]) or str(error)) or type(error).__name__
            app.command(name, context_settings=lenient)(_unavailable(name, error, reason))
            continue
        if isinstance(command, typer.Typer):
            app.add_typer(command, name=name)
        else:
            app.command(name, cls=PanelledCommand)(guarded(command))
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


def _unavailable(name: str, error: Exception, reason: str) -> Callable[..., NoReturn]:
    """Stand in for a command that cannot be imported, in the list and when it is called."""

    def command(context: typer.Context) -> NoReturn:
        if isinstance(error, ModuleNotFoundError) and _extra_of(error):
            raise error
        raise CommandError(f"the command {name} cannot be loaded: {reason}") from error

    command.__doc__ = f"(not available: {reason})"
    command.__name__ = name
    return command


@contextmanager
def _orderly_termination() -> Generator[None]:
    """Let SIGTERM and a closed terminal unwind the stack, so that no half-written file remains."""

    def stop(signal_number: int, frame: object) -> NoReturn:
        raise SystemExit(128 + signal_number)  # as shells report it

    before: dict[signal.Signals, Any] = {}
    try:
        for number in (signal.SIGTERM, signal.SIGHUP):
            # `nohup` lets a command outlive its terminal, by this handler.
            if signal.getsignal(number) is not signal.SIG_IGN:
                before[number] = signal.signal(number, stop)
    except ValueError:  # not in the main thread, which owns the signals
        pass
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _extra_of(error: ModuleNotFoundError) -> str | None:
    name = error.name or ""
    return EXTRAS.get(name) or EXTRAS.get(name.partition(".")[0])


def _complain(problem: str) -> int:
    _remark(problem)
    return BAD_INPUT


def _remark(text: str) -> None:
    with suppress(OSError, ValueError):  # a closed stderr
        print(shortened(f"curling: {text}"), file=sys.stderr, flush=True)


def _discard_stdout() -> None:
    """Discard the rest of the buffer, which would raise again at exit."""
    with suppress(OSError, ValueError):  # stdout has no file descriptor
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


if __name__ == "__main__":
    sys.exit(main())
