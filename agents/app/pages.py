"""Common parts of all screens: the page, the form that was sent, the club it is about."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any
from urllib.parse import parse_qsl

from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import HTMLResponse, RedirectResponse, Response
from starlette.routing import BaseRoute, Route

from agents.app.club import Club, Film, Session
from agents.app.gate import token_for
from agents.app.rendering import rendered
from curling_env.errors import InputError
from curling_env.infrastructure.files.reading import parse_json

MAX_FIELDS = 200
"""Fields of a form."""


def club_of(request: Request) -> Club:
    """The club whose app this is."""
    return request.app.state.club


def at(request: Request, path: str) -> str:
    """The address of a path in the app, such as ``throws/3``."""
    return f"{request.scope['root_path']}/{path.lstrip('/')}"


def go_to(request: Request, path: str) -> RedirectResponse:
    """Answer a form by another page, so that reloading it sends nothing twice."""
    return RedirectResponse(at(request, path), 303)


def session_of(request: Request) -> Session | None:
    """Return the session that the address names, or the latest one; None without sessions.

    Raises
    ------
    HTTPException : 404, the address names one that does not exist
    """
    club = club_of(request)
    number = request.path_params.get("session")
    if number is None:
        return next(iter(club.sessions()), None)
    found = club.session(number)
    if found is None:
        raise HTTPException(
            404, f"Session {number} does not exist or was removed; choose another one."
        )
    return found


def film_of(request: Request) -> tuple[Film, Session]:
    """Return the film that the address names, and its session.

    Raises
    ------
    HTTPException : 404, the address names one that does not exist
    """
    film = club_of(request).film(request.path_params["film"])
    session = None if film is None else club_of(request).session(film.session_id)
    if film is None or session is None:
        raise HTTPException(404, "That film does not exist or was removed.")
    return film, session


def page(
    request: Request,
    template: str,
    *,
    session: Session | None = None,
    status: int = 200,
    **content: Any,
) -> HTMLResponse:
    """A page from its template.

    Parameters
    ----------
    template : a name in `templates`, which extends ``base.html``
    session : the session that it is about; links to the other screens lead to the same one
    content : what the template shows; text is escaped
    """
    here = request.scope["path"].removeprefix(request.scope["root_path"]).strip("/")
    text = rendered(
        template,
        at=lambda path="": at(request, path),
        csrf=token_for(request.scope["root_path"].strip("/")),
        screens=request.app.state.screens,
        here=here.split("/")[0],
        session=session,
        door=request.scope["door"],
        shared=bool(request.app.state.sharing.addresses),
        chooser=[] if session is None else club_of(request).sessions(),
        **content,
    )
    return HTMLResponse(text, status)


async def form_of(request: Request) -> dict[str, str]:
    """The fields of a form that was sent, without white space around them.

    Raises
    ------
    InputError : more fields than a form of ours has
    """
    body = (await request.body()).decode("utf-8", "replace")
    try:
        fields = parse_qsl(body, keep_blank_values=True, max_num_fields=MAX_FIELDS)
    except ValueError as error:
        raise InputError(f"a form has at most {MAX_FIELDS} fields") from error
    return {name: value.strip() for name, value in fields}


def text_in(form: Mapping[str, str], name: str, most: int) -> str:
    """A text of a form; empty where the form lacks it.

    Raises
    ------
    InputError : more than `most` letters
    """
    text = form.get(name, "")
    if len(text) > most:
        raise InputError(f"has {len(text)} letters; expected at most {most}", source=name)
    return text


async def document_of(request: Request) -> dict[str, Any]:
    """The JSON object that a script sent.

    Raises
    ------
    InputError : no JSON, or no object
    """
    document = parse_json(await request.body(), source="the request")
    if not isinstance(document, dict):
        raise InputError("expected an object", source="the request")
    return document


def number_in(text: str, what: str) -> int:
    """A whole number of a form.

    Raises
    ------
    InputError : it is none
    """
    if not (text.isascii() and text.isdecimal() and len(text) < 18):
        raise InputError(f"expected the number of {what}, not {text[:20]!r}")
    return int(text)


@dataclass(frozen=True)
class Screen:
    """One of the pages that the navigation leads to.

    Parameters
    ----------
    name : first part of its addresses: ``/NAME`` for the latest session and ``/NAME/SESSION``
    title : what the navigation calls it
    show : answers these two
    more : further addresses
    """

    name: str
    title: str
    show: Callable[[Request], Response]
    more: Sequence[BaseRoute] = ()

    @property
    def routes(self) -> list[BaseRoute]:
        """Its addresses."""
        both = (f"/{self.name}", f"/{self.name}/{{session:int}}")
        return [*(Route(path, self.show) for path in both), *self.more]
