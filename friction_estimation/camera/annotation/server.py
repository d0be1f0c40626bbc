"""The page on which keypoints are clicked, served to browsers on this machine only."""

# pyright: reportArgumentType=false, reportCallIssue=false

from __future__ import annotations

import base64
import json
import secrets
from collections.abc import Callable
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib.resources import files
from threading import Event, Thread
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from curling_env.errors import CurlingError, InputError, OutputError
from friction_estimation.camera.annotation.annotate import VIEW_PX_PER_M, Annotation, Clicks
from friction_estimation.camera.annotation.thrower import thrower, thrower_px
from friction_estimation.camera.markings import keypoints_of
from friction_estimation.camera.scene import Scene

MAX_REQUEST_BYTES = 100_000
"""Longer requests are refused; the page sends only a few points."""
ADDRESS = "127.0.0.1"


class AnnotationServer:
    """Serves the page until the scene is saved.

    The address holds a secret that only the opened page knows, so that no other page in the same
    browser can send requests or save.

    Parameters
    ----------
    annotation : the film or picture
    save : called with the scene; a `CurlingError` that it raises is shown on the page
    port : port at which the page is served; 0 takes any free one

    Raises
    ------
    OutputError : the port is taken
    """

    def __init__(
        self,
        annotation: Annotation,
        save: Callable[[Scene], None],
        *,
        port: int = 0,
    ) -> None:
        self.annotation = annotation
        self.saved: Scene | None = None
        self._save = save
        self._done = Event()
        self._secret = secrets.token_urlsafe(16)
        try:
            self._server = ThreadingHTTPServer((ADDRESS, port), _handler(self))
        except OSError as error:
            raise OutputError(f"port {port} cannot be used: {error.strerror}") from error

    @property
    def url(self) -> str:
        """Address of the page."""
        return f"http://{ADDRESS}:{self._server.server_address[1]}/{self._secret}/"

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
                page = files("friction_estimation.camera.annotation").joinpath("page.html")
                return HTTPStatus.OK, "text/html; charset=utf-8", page.read_bytes()
            if path == "film.json":
                return _json(self._film())
            if path.startswith("still/") and path[6:].isdecimal():
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
        _, given, *rest = path.split("?")[0].split("/", 2)
        return "/".join(rest) if secrets.compare_digest(given, self._secret) else None

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
        }

    def _solve(self, request: Any) -> dict[str, Any]:
        try:
            clicks, still = _clicks(request), int(request.get("still", 0))
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
    except (TypeError, KeyError, ValueError, AttributeError) as error:
        raise InputError("expected clicks as {keypoint: [u, v]}") from error
    if not all(np.isfinite(px).all() for px in clicks.values()):
        raise InputError("expected finite pixels")
    return clicks


def _json(document: Any) -> tuple[HTTPStatus, str, bytes]:
    return HTTPStatus.OK, "application/json", json.dumps(document).encode()


def _jpeg(image: NDArray[np.uint8], quality: int) -> bytes:
    return cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, quality])[1].tobytes()


def _handler(server: AnnotationServer) -> type[BaseHTTPRequestHandler]:
    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            self._reply(None)

        def do_POST(self) -> None:
            length = self.headers.get("Content-Length", "")
            if not length.isdecimal() or int(length) > MAX_REQUEST_BYTES:
                self.send_error(HTTPStatus.REQUEST_ENTITY_TOO_LARGE)
                return
            try:
                request = json.loads(self.rfile.read(int(length)))
            except ValueError:
                request = {}
            self._reply(request)

        def _reply(self, request: Any) -> None:
            path = server.path_below_secret(self.path)
            if path is None:
                self.send_error(HTTPStatus.NOT_FOUND)
                return
            status, kind, content = server.answer(path, request)
            self.send_response(status)
            self.send_header("Content-Type", kind)
            self.send_header("Content-Length", str(len(content)))
            self.send_header("Cache-Control", "no-store")
            self.end_headers()
            self.wfile.write(content)

        def log_message(self, format: str, *args: Any) -> None:
            """Log nothing, because standard error is for the user's messages."""

    return Handler
