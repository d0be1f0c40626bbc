"""Settings of the whole app: sharing with the network, and the units of lengths."""

from __future__ import annotations

from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from agents.app.pages import club_of, form_of, go_to, page
from curling_env.errors import InputError
from curling_env.infrastructure.qr_code import qr_outline
from curling_env.units import Units


def show(request: Request) -> Response:
    """Show the links, as codes for the cameras of other devices too; one that writes to its own."""
    may_write = request.scope["door"].may_write
    addresses = request.app.state.sharing.addresses
    links = [
        {"may_write": writes, "address": addresses[writes], "code": qr_outline(addresses[writes])}
        for writes in (False, True)
        if writes in addresses and may_write >= writes
    ]
    return page(request, "share.html", links=links)


async def switch(request: Request) -> Response:
    """Share the app, or end that; from this machine alone."""
    if not request.scope["door"].is_own:
        raise HTTPException(403, "Sharing is switched on or off on the computer that runs the app.")
    on = (await form_of(request)).get("share") == "on"
    await request.app.state.sharing.switch(on, request.scope["server"][1])
    return go_to(request, "share")


async def choose_units(request: Request) -> Response:
    """Choose metres or feet, for all pages of the club."""
    units = (await form_of(request)).get("units", "")
    if units not in list(Units):
        raise InputError(f"expected one of {', '.join(Units)}", source="units")
    club_of(request).choose_units(Units(units))
    return go_to(request, "practice")


SHARING = [
    Route("/share", show),
    Route("/share", switch, methods=["POST"]),
    Route("/units", choose_units, methods=["POST"]),
]
