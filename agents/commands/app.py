"""`curling app`: the rink's own app in the browser."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Argument, Option

from curling_env.commands.terminal import say

if TYPE_CHECKING:
    from collections.abc import Sequence

    from agents.app.club import Club


def app(
    folder: Annotated[
        Path, Argument(metavar="FOLDER", help="The club folder, made if it is missing.")
    ] = Path("club"),
    demo: Annotated[
        bool, Option("--demo", help="Fill the folder with a made-up evening, to look around.")
    ] = False,
    take_in: Annotated[
        list[Path] | None,
        Option(
            "--import",
            metavar="DIR",
            help="Begin a session from tracks.csv and ice.json in DIR; may be repeated.",
        ),
    ] = None,
    port: Annotated[
        int | None,
        Option(min=0, max=65535, metavar="N", help="Port; 0 takes any free one. By default 8711."),
    ] = None,
    browser: Annotated[
        bool, Option("--browser/--no-browser", help="Open the page in the browser.")
    ] = True,
    share: Annotated[
        bool, Option("--share", help="Open the page to the local network, by a secret address.")
    ] = False,
) -> None:
    """Open the page for athletes and coaches: film, ice, throw and athlete, in the browser.

    \b
    Examples:
        curling app
        curling app ~/curling-club --share
        curling app /tmp/look --demo
        curling app club --import runs/demo

    The address is printed, and the page is opened. Everything works on this machine, without the
    internet. The club folder holds a database (club.sqlite) for names and notes, and beside it the
    films, tracks and ices as files that every other command reads.

    The address holds a secret: only those who have it get in, and only on this machine. With
    --share others in the same network get in too, by an address with another secret, which is also
    shown as a QR code; anyone who has it may see and change everything.

    Ctrl-C ends the app. Nothing is lost, even in a power cut. See docs/app.md.
    """
    import webbrowser
    from contextvars import Context

    import jinja2  # noqa: F401  of the extra `app`, which is named where it is missing

    from agents.app.club import Club
    from agents.app.serve import serve
    from agents.app.take_in import look_through

    club, folders = Club(folder), take_in or []

    def show(address: str, shared: str | None) -> None:
        print(address, flush=True)
        if shared is not None:
            say(f"anyone in this network who has this address may see all: {shared}", now=True)
            if sys.stderr.isatty():
                from curling_env.infrastructure.qr_code import qr_code

                say(qr_code(shared))
        if browser:
            webbrowser.open(address)

    def run() -> None:
        with club.alone():
            for one in folders:  # all of them, before the first is taken in
                look_through(one)
            serve(
                club,
                port=port,
                share=share,
                opened=show,
                begin=lambda: _begin(club, folders, demo=demo),
            )

    try:
        # A club's files are read and written again and again: the rule that a command writes over
        # nothing that it has read does not hold here.
        Context().run(run)
    except KeyboardInterrupt:
        say(f"closed; everything is kept in {folder}")


def _begin(club: Club, folders: Sequence[Path], *, demo: bool) -> None:
    """Begin the sessions that were asked for; they are filled while the page is open."""
    import datetime

    from agents.app.demo import begin_evening
    from agents.app.take_in import begin_from, is_in
    from agents.app.work.queue import submit

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
