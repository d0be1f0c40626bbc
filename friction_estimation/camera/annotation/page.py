"""Responses to the page on which keypoints are clicked, independent of the server."""

# pyright: reportArgumentType=false, reportCallIssue=false

from __future__ import annotations

import base64
import json
from collections.abc import Callable
from dataclasses import replace
from http import HTTPStatus
from importlib.resources import files
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from curling_env.errors import CurlingError, InputError
from curling_env.infrastructure.page_policy import directives_of
from curling_env.sheet import Sheet
from curling_env.units import Units
from friction_estimation.camera.annotation.annotate import VIEW_PX_PER_M, Annotation, Clicks
from friction_estimation.camera.annotation.thrower import thrower, thrower_px
from friction_estimation.camera.annotation.verdict import SHEETS, size_in_words
from friction_estimation.camera.expected import expected_in_words
from friction_estimation.camera.markings import keypoints_of
from friction_estimation.camera.scene import Scene

MAX_PIXEL = 1e6
"""Maximum coordinate of a click [px]."""


class AnnotationPage:
    """Page for one film or picture, and its requests.

    Parameters
    ----------
    annotation : the film or picture, or a function that opens it: the page itself needs none
    save : called with the scene; a `CurlingError` that it raises is shown on the page
    units : what the page tells lengths in
    """

    def __init__(
        self,
        annotation: Annotation | Callable[[], Annotation],
        save: Callable[[Scene], None],
        *,
        units: Units = Units.METRES,
    ) -> None:
        self._open = (lambda: annotation) if isinstance(annotation, Annotation) else annotation
        self._save, self._units = save, units

    @property
    def annotation(self) -> Annotation:
        """The film or picture."""
        return self._open()

    @property
    def policy(self) -> str:
        """The content security policy that the page needs."""
        return directives_of(_page().decode(), connect=True)

    def answer(self, path: str, request: Any = None) -> tuple[HTTPStatus, str, bytes]:
        """Answer a request: status, content type and content.

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

    def _film(self) -> dict[str, Any]:
        sheet = self.annotation.sheet
        return {
            "name": self.annotation.name,
            "size": self.annotation.size,
            "stills": len(self.annotation.stills),
            "sheet": _size(sheet),
            "sheets": [
                {**_size(one), "words": size_in_words(one), "keypoints": keypoints_of(one)}
                for one in dict.fromkeys((sheet, *SHEETS))
            ],
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
            annotation = self._of_size(request)
            found = annotation.solve(clicks, paint=bool(request.get("paint")))
        except CurlingError as error:
            return {"problem": _plain(error)}
        camera = found.camera
        still = still if 0 <= still < len(annotation.stills) else 0
        view = _jpeg(annotation.top_view(camera, still), 88)
        return {
            "problem": None,
            "misfit_px": found.misfit_px,
            "paint_px": found.paint_px,
            "disagreeing": list(found.disagreeing),
            "problems": list(found.problems),
            "better": None if found.better is None else _size(found.better),
            "lines": annotation.lines_px(camera),
            "view": "data:image/jpeg;base64," + base64.b64encode(view).decode(),
            "focal_px": camera.lens.focal_px,
            "position": camera.position.tolist(),
            "height_range": found.height_range,
            "expected": expected_in_words(found.expected, self._units),
            "thrower": [shape.tolist() for shape in thrower_px(camera)],
        }

    def _of_size(self, request: Any) -> Annotation:
        """Return the film with the size of the ice in a request; with its own if there is no
        size.
        """
        wanted, sheet = request.get("sheet"), self.annotation.sheet
        if wanted is None or wanted == _size(sheet):
            return self.annotation
        found = next((one for one in SHEETS if _size(one) == wanted), None)
        if found is None:
            raise InputError("expected a size of the ice that is offered")
        return replace(self.annotation, sheet=found)

    def _save_scene(self, request: Any) -> dict[str, Any]:
        try:
            scene = self._of_size(request).solve(_clicks(request)).scene
            self._save(scene)
        except CurlingError as error:
            return {"problem": _plain(error)}
        return {"problem": None}


def _size(sheet: Sheet) -> dict[str, float]:
    return {"length": sheet.length, "width": sheet.width}


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


def _page() -> bytes:
    return files("friction_estimation.camera.annotation").joinpath("page.html").read_bytes()
