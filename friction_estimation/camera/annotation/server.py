"""Server of the page on which keypoints are clicked, for browsers on this machine or a tablet."""

from __future__ import annotations

import secrets
from collections.abc import Callable
from http import HTTPStatus
from threading import Event, Thread
from typing import Any

from curling_env.errors import InputError, OutputError
from curling_env.infrastructure.files.reading import parse_json
from curling_env.infrastructure.local_server import (
    ADDRESS,
    LocalHandler,
    LocalServer,
    network_address,
)
from curling_env.units import Units
from friction_estimation.camera.annotation.annotate import Annotation
from friction_estimation.camera.annotation.page import AnnotationPage
from friction_estimation.camera.scene import Scene


class AnnotationServer:
    """Serves the page until the scene is saved.

    The address holds a secret that only the opened page knows, so that no other page in the same
    browser can send requests or save.

    Parameters
    ----------
    annotation : the film or picture
    save : called with the scene; a `CurlingError` that it raises is shown on the page
    port : port at which the page is served; 0 takes any free one
    share : whether other machines in the same network may open it, such as a tablet; whoever has
        the address may then mark and save
    units : what the page tells lengths in

    Raises
    ------
    OutputError : the port is taken, or there is no network to share it in
    """

    def __init__(
        self,
        annotation: Annotation,
        save: Callable[[Scene], None],
        *,
        port: int = 0,
        share: bool = False,
        units: Units = Units.METRES,
    ) -> None:
        self.annotation = annotation
        self.saved: Scene | None = None
        self._save = save
        self.page = AnnotationPage(annotation, self._keep, units=units)
        self._done = Event()
        self._secret = secrets.token_urlsafe(16)
        self._host = network_address() if share else ADDRESS
        try:
            self._server = LocalServer(_handler(self), port, host=self._host)
        except OSError as error:
            raise OutputError(f"port {port} cannot be used: {error.strerror}") from error

    @property
    def url(self) -> str:
        """Address of the page."""
        return f"http://{self._host}:{self._server.server_address[1]}/{self._secret}/"

    def __enter__(self) -> AnnotationServer:
        Thread(target=self._server.serve_forever, daemon=True).start()
        return self

    def __exit__(self, *_: object) -> None:
        self._server.shutdown()
        self._server.server_close()

    def wait(self, timeout: float | None = None) -> Scene | None:
        """Wait until a scene is saved, and return it; None when the time [s] runs out first."""
        self._done.wait(timeout)
        return self.saved

    def answer(self, path: str, request: Any = None) -> tuple[HTTPStatus, str, bytes]:
        """Return the answer to a request, see `AnnotationPage.answer`."""
        return self.page.answer(path, request)

    def _keep(self, scene: Scene) -> None:
        self._save(scene)
        self.saved = scene
        self._done.set()

    def path_below_secret(self, path: str) -> str | None:
        """Return the part of a path that follows the secret; None where the secret is wrong."""
        _, given, *rest = [*path.split("?")[0].split("/", 2), ""][:3]
        known = secrets.compare_digest(given.encode(errors="replace"), self._secret.encode())
        return "/".join(rest) if known else None


def _handler(server: AnnotationServer) -> type[LocalHandler]:
    class Handler(LocalHandler):
        policy = server.page.policy

        def answer(self, path: str, body: bytes | None) -> tuple[HTTPStatus, str, bytes]:
            below = server.path_below_secret(path)
            if below is None:
                return HTTPStatus.NOT_FOUND, "text/plain", b"not here"
            if body is None:
                return server.answer(below)
            try:
                request = parse_json(body, source="the request")
            except InputError:
                request = {}
            return server.answer(below, request)

    return Handler
