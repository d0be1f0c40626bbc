"""`curling app`: the rink's own app in the browser."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

from typer import Argument, Option

from curling_env.commands.terminal import print_remark


def app(
    folder: Annotated[Path, Argument(metavar="FOLDER", help="The club folder.")] = Path("club"),
    demo: Annotated[bool, Option("--demo", help="Add a made-up evening, to look around.")] = False,
    take_in: Annotated[
        list[Path] | None,
        Option(
            "--import",
            metavar="DIR",
            help="Import the session in DIR (tracks.csv, ice.json); may be repeated.",
        ),
    ] = None,
    port: Annotated[
        int | None, Option(min=0, max=65535, help="Port; 8711 by default, 0: any free one.")
    ] = None,
    browser: Annotated[bool, Option(help="Open the page in the browser.")] = True,
    share: Annotated[bool, Option("--share", help="Open the page to the local network.")] = False,
) -> None:
    """Open the app for athletes and coaches in the browser.

    \b
    Examples:
        curling app
        curling app ~/curling-club --share
        curling app /tmp/look --demo
        curling app club --import runs/demo

    Everything runs on this machine, without the internet. The club folder holds a database of
    names and notes (club.sqlite), and the films, tracks and ices as files for every other command.
    The printed address contains a secret key and works on this machine only; with --share, others
    in the same network get another one, also as a QR code. Ctrl-C ends the app. See docs/app.md.
    """
    import webbrowser
    from contextvars import Context

    import jinja2  # noqa: F401  of the extra `app`, reported here if it is missing

    from agents.app.club import Club
    from agents.app.serve import serve
    from agents.app.take_in import begin_sessions, look_through

    club, folders = Club(folder), take_in or []

    def show(address: str, shared: str | None) -> None:
        print(address, flush=True)
        if shared is not None:
            print_remark(
                f"anyone in this network with this address can see everything: {shared}", now=True
            )
            if sys.stderr.isatty():
                from curling_env.infrastructure.qr_code import qr_code

                print_remark(qr_code(shared))
        if browser:
            webbrowser.open(address)

    def run() -> None:
        with club.alone():
            for one in folders:  # all of them, before the first is imported
                look_through(one)
            serve(
                club,
                port=port,
                share=share,
                opened=show,
                begin=lambda: begin_sessions(club, folders, demo=demo, remark=print_remark),
            )

    try:
        # A club's files are read and written repeatedly: the rule that a command does not overwrite
        # its inputs does not apply here.
        Context().run(run)
    except KeyboardInterrupt:
        print_remark(f"closed; everything is kept in {folder}")
