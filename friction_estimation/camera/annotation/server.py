"""The page that marks are made on, served to this machine's own browser and to no one else."""

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
from friction_estimation.camera.annotation.annotate import VIEW_PX_PER_M, Annotation
from friction_estimation.camera.markings import keypoints_of
from friction_estimation.camera.scene import Scene

LARGEST_QUESTION = 100_000
"""A question is some points; one longer than this many bytes is none of ours."""
ADDRESS = "127.0.0.1"


class AnnotationServer:
    """Serves the page until the marks are saved.

    The address holds a secret that only the opened page knows, so that no other page in the same
    browser can ask questions or save.

    Parameters
    ----------
    picking : film or picture
    save : keeps a scene; a `CurlingError` it raises is shown on the page
    port : 0 for any that is free

    Raises
    ------
    OutputError : the port is taken
    """

    def __init__(
        self,
        picking: Annotation,
        save: Callable[[Scene], None],
        *,
        port: int = 0,
    ) -> None:
        self.picking = picking
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
        """Where the page is."""
        return f"http://{ADDRESS}:{self._server.server_address[1]}/{self._secret}/"

    def __enter__(self) -> AnnotationServer:
        Thread(target=self._server.serve_forever, daemon=True).start()
        return self

    def __exit__(self, *_: object) -> None:
        self._server.shutdown()
        self._server.server_close()

    def wait(self, timeout: float | None = None) -> Scene | None:
        """Wait until a scene is saved; None when the time [s] is over before."""
        self._done.wait(timeout)
        return self.saved

    def answer(self, path: str, question: Any = None) -> tuple[HTTPStatus, str, bytes]:
        """Status, type and content for a path below the secret one; `question` of a POST."""
        if question is None:
            if path == "":
                page = files("friction_estimation.camera.annotation").joinpath("page.html")
                return HTTPStatus.OK, "text/html; charset=utf-8", page.read_bytes()
            if path == "film.json":
                return _json(self._film())
            if path.startswith("still/") and path[6:].isdecimal():
                index = int(path[6:])
                if index < len(self.picking.stills):
                    return HTTPStatus.OK, "image/jpeg", _jpeg(self.picking.stills[index], 95)
        elif path == "read":
            return _json(self._read(question))
        elif path == "save":
            return _json(self._keep(question))
        return HTTPStatus.NOT_FOUND, "text/plain", b"not here"

    def opened_as(self, path: str) -> str | None:
        """What a request's path asks for below the secret; None where the secret is wrong."""
        _, given, *rest = path.split("?")[0].split("/", 2)
        return "/".join(rest) if secrets.compare_digest(given, self._secret) else None

    def _film(self) -> dict[str, Any]:
        sheet = self.picking.sheet
        return {
            "name": self.picking.name,
            "size": self.picking.size,
            "stills": len(self.picking.stills),
            "sheet": {"length": sheet.length, "width": sheet.width},
            "places": keypoints_of(sheet),
            "marks": dict(self.picking.marks),
            "lens": self.picking.known.get("camera_matrix") is not None,
            "px_per_m": VIEW_PX_PER_M,
        }

    def _read(self, question: Any) -> dict[str, Any]:
        try:
            marks, still = _marks(question), int(question.get("still", 0))
            reading = self.picking.read(marks, paint=bool(question.get("paint")))
        except CurlingError as error:
            return {"problem": _plain(error)}
        camera = reading.camera
        still = still if 0 <= still < len(self.picking.stills) else 0
        view = _jpeg(self.picking.from_above(camera, still), 88)
        return {
            "problem": None,
            "misfit_px": reading.misfit_px,
            "paint_px": reading.paint_px,
            "lines": self.picking.painted(camera),
            "view": "data:image/jpeg;base64," + base64.b64encode(view).decode(),
            "focal_px": camera.lens.focal_px,
            "position": camera.position.tolist(),
        }

    def _keep(self, question: Any) -> dict[str, Any]:
        try:
            scene = self.picking.read(_marks(question)).scene
            self._save(scene)
        except CurlingError as error:
            return {"problem": _plain(error)}
        self.saved = scene
        self._done.set()
        return {"problem": None}


def _plain(error: CurlingError) -> str:
    return error.problem if isinstance(error, InputError) else str(error)


def _marks(question: Any) -> dict[str, tuple[float, float]]:
    try:
        marks = {str(k): (float(u), float(v)) for k, (u, v) in question["marks"].items()}
    except (TypeError, KeyError, ValueError, AttributeError) as error:
        raise InputError("expected marks as {place: [u, v]}") from error
    if not all(np.isfinite(px).all() for px in marks.values()):
        raise InputError("expected finite pixels")
    return marks


def _json(document: Any) -> tuple[HTTPStatus, str, bytes]:
    return HTTPStatus.OK, "application/json", json.dumps(document).encode()


def _jpeg(image: NDArray[np.uint8], quality: int) -> bytes:
    return cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, quality])[1].tobytes()


def _handler(pages: AnnotationServer) -> type[BaseHTTPRequestHandler]:
    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            self._reply(None)

        def do_POST(self) -> None:
            length = self.headers.get("Content-Length", "")
            if not length.isdecimal() or int(length) > LARGEST_QUESTION:
                self.send_error(HTTPStatus.REQUEST_ENTITY_TOO_LARGE)
                return
            try:
                question = json.loads(self.rfile.read(int(length)))
            except ValueError:
                question = {}
            self._reply(question)

        def _reply(self, question: Any) -> None:
            path = pages.opened_as(self.path)
            if path is None:
                self.send_error(HTTPStatus.NOT_FOUND)
                return
            status, kind, content = pages.answer(path, question)
            self.send_response(status)
            self.send_header("Content-Type", kind)
            self.send_header("Content-Length", str(len(content)))
            self.send_header("Cache-Control", "no-store")
            self.end_headers()
            self.wfile.write(content)

        def log_message(self, format: str, *args: Any) -> None:
            """Say nothing: stderr is for the person at the terminal."""

    return Handler
