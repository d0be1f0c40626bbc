"""Errors for unknown keyword arguments that list the valid ones."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from functools import wraps
from typing import Any, TypeVar

from curling_env.errors import UnknownOptionError

Called = TypeVar("Called", bound=Callable[..., Any])


def rejects_unknown_keywords(name: str) -> Callable[[Called], Called]:
    """Decorate a function or class to reject unknown keywords with a list of the valid ones.

    Parameters
    ----------
    name : name in the message
    """

    def decorated(called: Called) -> Called:
        plain: Any = called.__init__ if isinstance(called, type) else called
        kinds = inspect.signature(plain).parameters.values()
        known = [p.name for p in kinds if p.kind in (p.POSITIONAL_OR_KEYWORD, p.KEYWORD_ONLY)]
        known = [option for option in known if option != "self"]

        @wraps(plain)
        def checked(*args: Any, **options: Any) -> Any:
            unknown = [option for option in options if option not in known]
            if unknown:
                raise UnknownOptionError(
                    f"unknown option {unknown[0]!r} of {name}; expected one of {', '.join(known)} "
                    f"(unexpected keyword argument {unknown[0]!r})"
                )
            return plain(*args, **options)

        whole: Any = called
        if isinstance(called, type):
            whole.__init__ = checked
            return whole
        return checked  # pyright: ignore[reportReturnType]  (of the same signature)

    return decorated
