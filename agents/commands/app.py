"""`curling app`: the rink's own app in the browser."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from curling_env.commands.cli import say

if TYPE_CHECKING:
    from collections.abc import Sequence

    from agents.app.club import Club


def app(
    folder: Annotated[
        Path,
        typer.Argument(
            metavar="FOLDER", help="The club folder; it is made if it is not there yet."
        ),
    ] = Path("club"),
    demo: Annotated[
        bool,
        typer.Option("--demo", help="Fill the folder with a made-up evening, to look around."),
    ] = False,
    take_in: Annotated[
        list[Path] | None,
        typer.Option(
            "--import",
            metavar="DIR",
            help="Begin a session from files that are there: tracks.csv, and ice.json if it is "
            "there; may be given again and again.",
        ),
    ] = None,
    port: Annotated[
        int | None,
        typer.Option(
            min=0,
            max=65535,
            metavar="N",
            help="Port of the page; 0 takes any free one. By default 8711, or a free one.",
        ),
    ] = None,
    browser: Annotated[
        bool, typer.Option("--browser/--no-browser", help="Open the page in the browser.")
    ] = True,
    share: Annotated[
        bool,
        typer.Option(
            "--share", help="Let others in the same network open it, by an address with a secret."
        ),
    ] = False,
) -> None:
    """Open the page for athletes and coaches: film, ice, throw and athlete, in the browser.

    The address is printed, and the page is opened. Everything works on this machine, without the
    internet: new sessions, films, throws, ice, plans. The club folder holds it all: one database
    (club.sqlite) for names and notes, and beside it the films, tracks and ices as files that every
    other command reads.

    The address holds a secret: only who has it gets in, and only on this machine. With --share
    others in the same network get in too, for instance a tablet at the other end of the sheet; its
    address has a secret of its own, and is also shown as a QR code. Whoever has that address may
    see and change everything.

    Ctrl-C ends the app. Nothing is lost, also where the power goes: the next start goes on.

    \b
    Examples:
        curling app
        curling app ~/curling-club --share
        curling app /tmp/look --demo
        curling app club --import runs/demo
    """
    import webbrowser
    from contextvars import Context

    import jinja2  # noqa: F401  of the extra `app`, which is named where it is missing

    from agents.app.club import Club
    from agents.app.serve import serve

    club, folders = Club(folder), take_in or []

    def tell(address: str, shared: str | None) -> None:
        print(address, flush=True)
        if shared is not None:
            say(f"whoever is in this network and has this address may see all: {shared}", now=True)
            if sys.stderr.isatty():
                from curling_env.infrastructure.qr_code import qr_code

                say(qr_code(shared))
        if browser:
            webbrowser.open(address)

    def run() -> None:
        with club.alone():
            _check(folders)
            serve(
                club,
                port=port,
                share=share,
                opened=tell,
                begin=lambda: _begin(club, folders, demo=demo),
            )

    try:
        # A club's files are read and written again and again: the rule that a command writes over
        # nothing that it has read does not hold here.
        Context().run(run)
    except KeyboardInterrupt:
        say(f"closed; everything is kept in {folder}")


def _check(folders: Sequence[Path]) -> None:
    """See that all folders can be taken in before the first one is."""
    if folders:
        from agents.app.take_in import look_through

        for folder in folders:
            look_through(folder)


def _begin(club: Club, folders: Sequence[Path], *, demo: bool) -> None:
    """Begin the sessions that were asked for; they are filled while the page is open."""
    import datetime

    from agents.app.demo import begin_evening
    from agents.app.take_in import begin_from, is_in
    from agents.app.work.jobs import submit

    today = datetime.date.today().isoformat()
    for folder in folders:
        if is_in(club, folder):
            say(f"{folder}: is in this club already")
            continue
        session = begin_from(club, folder, name=folder.resolve().name, day=today, sheet="")
        submit(club, "import", session, str(folder.resolve()))
    evening = begin_evening(club, today) if demo else None
    if evening is not None:
        submit(club, "make up", evening)
