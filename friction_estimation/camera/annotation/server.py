"""The page on which keypoints are clicked, served to browsers on this machine, or to a tablet."""

# pyright: reportArgumentType=false, reportCallIssue=false

from __future__ import annotations

import base64
import json
import secrets
from collections.abc import Callable
from http import HTTPStatus
from importlib.resources import files
from threading import Event, Thread
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from curling_env.errors import CurlingError, InputError, OutputError
from curling_env.infrastructure.files.storage import parse_json
from curling_env.infrastructure.local_server import (
    ADDRESS,
    LocalHandler,
    LocalServer,
    network_address,
)
from curling_env.infrastructure.page_policy import directives_of
from curling_env.units import Units
from friction_estimation.camera.annotation.annotate import VIEW_PX_PER_M, Annotation, Clicks
from friction_estimation.camera.annotation.thrower import thrower, thrower_px
from friction_estimation.camera.markings import keypoints_of
from friction_estimation.camera.scene import Scene

MAX_PIXEL = 1e6
"""Farther clicks are refused [px]."""


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
        self._units = units
        self.saved: Scene | None = None
        self._save = save
        self._done = Event()
        self._secret = secrets.token_urlsafe(16)
        try:
            self._host = network_address() if share else ADDRESS
        except OSError as error:
            raise OutputError("this machine is in no network in which to share the page") from error
        try:
            everywhere = {"address": "0.0.0.0", "hosts": [self._host]} if share else {}
            self._server = LocalServer(_handler(self), port, **everywhere)
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
        """The answer to a request: its status, content type and content.

        Parameters
        ----------
        path : the part of the request's path that follows the secret
        request : the JSON document of a POST; None for a GET
        """
        if request is None:
            if path == "":
                return HTTPStatus.OK, "text/html; charset=utf-8", _page()
            if path == "film.json":
                return _json(self._film())
            if path.startswith("still/") and path[6:].isdecimal() and len(path) < 12:
                index = int(path[6:])
                if index < len(self.annotation.stills):
                    return HTTPStatus.OK, "image/jpeg", _jpeg(self.annotation.stills[index], 95)
        elif path == "solve":
            return _json(self._solve(request))
        elif path == "save":
            return _json(self._save_scene(request))
        return HTTPStatus.NOT_FOUND, "text/plain", b"not here"

    def path_below_secret(self, path: str) -> str | None:
        """The part of a path that follows the secret; None where the secret is wrong."""
        _, given, *rest = [*path.split("?")[0].split("/", 2), ""][:3]
        known = secrets.compare_digest(given.encode(errors="replace"), self._secret.encode())
        return "/".join(rest) if known else None

    def _film(self) -> dict[str, Any]:
        sheet = self.annotation.sheet
        return {
            "name": self.annotation.name,
            "size": self.annotation.size,
            "stills": len(self.annotation.stills),
            "sheet": {"length": sheet.length, "width": sheet.width},
            "keypoints": keypoints_of(sheet),
            "clicks": dict(self.annotation.clicks),
            "lens": self.annotation.known.get("camera_matrix") is not None,
            "px_per_m": VIEW_PX_PER_M,
            "thrower": [shape.tolist() for shape in thrower()],
            "feet": self._units is Units.FEET,
        }

    def _solve(self, request: Any) -> dict[str, Any]:
        try:
            clicks, still = _clicks(request), request.get("still", 0)
            if not isinstance(still, int):
                raise InputError("expected the number of a frame")
            found = self.annotation.solve(clicks, paint=bool(request.get("paint")))
        except CurlingError as error:
            return {"problem": _plain(error)}
        camera = found.camera
        still = still if 0 <= still < len(self.annotation.stills) else 0
        view = _jpeg(self.annotation.top_view(camera, still), 88)
        return {
            "problem": None,
            "misfit_px": found.misfit_px,
            "paint_px": found.paint_px,
            "lines": self.annotation.lines_px(camera),
            "view": "data:image/jpeg;base64," + base64.b64encode(view).decode(),
            "focal_px": camera.lens.focal_px,
            "position": camera.position.tolist(),
            "height_range": found.height_range,
            "thrower": [shape.tolist() for shape in thrower_px(camera)],
        }

    def _save_scene(self, request: Any) -> dict[str, Any]:
        try:
            scene = self.annotation.solve(_clicks(request)).scene
            self._save(scene)
        except CurlingError as error:
            return {"problem": _plain(error)}
        self.saved = scene
        self._done.set()
        return {"problem": None}


def _plain(error: CurlingError) -> str:
    return error.problem if isinstance(error, InputError) else str(error)


def _clicks(request: Any) -> Clicks:
    try:
        clicks = {str(k): (float(u), float(v)) for k, (u, v) in request["clicks"].items()}
    except (TypeError, KeyError, ValueError, AttributeError, OverflowError) as error:
        raise InputError("expected clicks as {keypoint: [u, v]}") from error
    if not all((np.abs(px) <= MAX_PIXEL).all() for px in clicks.values()):
        raise InputError("expected finite pixels of this picture")
    return clicks


def _json(document: Any) -> tuple[HTTPStatus, str, bytes]:
    return HTTPStatus.OK, "application/json", json.dumps(document).encode()


def _jpeg(image: NDArray[np.uint8], quality: int) -> bytes:
    return cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, quality])[1].tobytes()


def _handler(server: AnnotationServer) -> type[LocalHandler]:
    class Handler(LocalHandler):
        policy = directives_of(_page().decode(), connect=True)

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


def _page() -> bytes:
    return files("friction_estimation.camera.annotation").joinpath("page.html").read_bytes()
