"""A screen: a word in the navigation, and the addresses it answers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from starlette.routing import BaseRoute


@dataclass(frozen=True, kw_only=True)
class Screen:
    """One of the pages that the navigation leads to.

    Parameters
    ----------
    name : first part of its addresses: ``/NAME`` for the latest session and ``/NAME/SESSION``
    title : what the navigation calls it
    routes : its addresses
    """

    name: str
    title: str
    routes: Sequence[BaseRoute]
