"""A host in a thread, for tests whose clients are in others."""

from __future__ import annotations

import threading
from abc import ABC, abstractmethod
from typing import Self

from agents.digital_curling import Hosting


class HostThread(ABC):
    """Host in a separate thread, which is open within the block and has ended after it.

    Parameters
    ----------
    hosting : the game
    """

    def __init__(self, hosting: Hosting) -> None:
        self.hosting = hosting
        self._open = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)

    @abstractmethod
    def _run(self) -> None:
        """Host the game to its end, and set `_open` once clients may come."""

    def __enter__(self) -> Self:
        self._thread.start()
        assert self._open.wait(30)
        return self

    def __exit__(self, *error: object) -> None:
        if error and error[0] is not None:
            return
        self._thread.join(60)
        assert not self._thread.is_alive()

    @property
    def game(self):
        assert self.hosting.game is not None
        return self.hosting.game
