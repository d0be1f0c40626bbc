"""The app as a whole: screens, files, and what is answered when something is wrong."""

from __future__ import annotations

import os
import traceback
from collections.abc import Collection

from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Mount, Route
from starlette.staticfiles import StaticFiles

from agents.app.club import Club
from agents.app.gate import READING, Door, Gate, Sharing
from agents.app.pages import go_to, page, session_of
from agents.app.screens import SCREENS
from agents.app.screens.share import SHARING
from agents.app.views.progress import job_in_words
from agents.app.work.causes import ComingError
from agents.app.work.jobs import OPEN
from agents.app.work.queue import WorkQueue
from curling_env.errors import CurlingError, InputError

TRACEBACK = "CURLING_TRACEBACK"
"""Environment variable: if it is set, internal errors are printed with their traceback."""


def application(
    club: Club,
    work: WorkQueue,
    *,
    secret: str,
    hosts: Collection[str],
) -> Gate:
    """The application of a club, for this machine; its `sharing` opens it to others.

    Parameters
    ----------
    club : its folder
    work : runs its long work
    secret : the first part of every address on this machine
    hosts : names, without a port, by which this machine's browsers call it
    """
    routes = [
        Route("/", lambda request: go_to(request, SCREENS[0].name)),
        *SHARING,
        Mount("/static", StaticFiles(packages=[("agents.app", "static")])),
        *(route for screen in SCREENS for route in screen.routes),
    ]
    app = Starlette(
        routes=routes,
        exception_handlers={
            HTTPException: _refuse,
            ComingError: _show_progress,
            CurlingError: _refuse,
            Exception: _internal_error,
        },
    )
    app.state.club, app.state.closed, app.state.screens = club, work.closed, SCREENS
    own = Door(secret, frozenset(host.lower() for host in hosts), is_own=True)
    app.state.sharing = Sharing(club, own)
    app.state.sharing.app = gate = Gate(app, app.state.sharing)
    return gate


async def _refuse(request: Request, error: Exception) -> Response:
    if isinstance(error, HTTPException):
        return _problem(request, error.detail, error.status_code)
    problem = error.problem if isinstance(error, InputError) else str(error)
    return _problem(request, problem, 422)


async def _show_progress(request: Request, error: Exception) -> Response:
    """Show the progress of the requested work; a script asks again until it is done."""
    assert isinstance(error, ComingError)
    is_open = any(job.state in OPEN for job in error.jobs)
    if not (request.method in READING and "text/html" in request.headers.get("Accept", "")):
        result = "; ".join(job.problem for job in error.jobs if job.problem)
        answer = {"problem": str(error) if is_open or not result else result, "coming": is_open}
        return JSONResponse(answer, 503 if is_open else 422)
    here = request.scope["path"].removeprefix(request.scope["root_path"]).strip("/").split("/")[0]
    return page(
        request,
        "coming.html",
        session=session_of(request),
        status=202,
        heading=next((screen.title for screen in SCREENS if screen.name == here), ""),
        jobs=[job_in_words(job) for job in error.jobs],
    )


async def _internal_error(request: Request, error: Exception) -> Response:
    """Report an internal error as such, and keep serving."""
    if os.environ.get(TRACEBACK):
        traceback.print_exception(error)
    result = "Internal error of the app; your entries are kept."
    return _problem(request, f"{result} ({type(error).__name__}: {str(error)[:200]})", 500)


def _problem(request: Request, problem: str, status: int) -> Response:
    """A page for people, and one sentence for scripts."""
    is_page = request.method in READING or "form" in request.headers.get("Content-Type", "")
    if is_page and "text/html" in request.headers.get("Accept", ""):
        return page(request, "problem.html", status=status, problem=problem)
    return JSONResponse({"problem": problem}, status)
