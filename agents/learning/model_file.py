"""Trained models as files of arrays and one JSON document, which cannot run code.

stable-baselines3's own zip files contain pickled Python objects, which run code when they are
loaded. Here a model is a NumPy archive: every weight is an array, and one further array has a JSON
document with the structure. Loading reads numbers and text only, whatever the file's origin.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from curling_env.errors import InputError, placed
from curling_env.infrastructure.files.reading import parse_json, read_arrays
from curling_env.infrastructure.files.schema import FileFormat
from curling_env.infrastructure.files.storage import write_arrays

MODEL_FORMAT = FileFormat(name="curling-agent/1", what="a model")
_ARRAY = "$array"
_DOCUMENT = "document"


def write_model(path: str | Path, document: Mapping[str, Any]) -> None:
    """Write a nested document of dicts, lists, numbers, text, None, arrays and tensors.

    Keys of dicts may be text or whole numbers, because an optimiser numbers its parameters.

    Raises
    ------
    TypeError : the document contains anything else
    OutputError : the file cannot be written
    """
    arrays: dict[str, NDArray[Any]] = {}
    layout = json.dumps({"format": MODEL_FORMAT.name, "content": _take_apart(document, arrays)})
    arrays[_DOCUMENT] = np.frombuffer(layout.encode(), dtype=np.uint8)
    write_arrays(path, arrays)


def read_model(path: str | Path) -> dict[str, Any]:
    """Read a document of `write_model`, with NumPy arrays.

    Raises
    ------
    InputError : the file does not exist, or is not a model of this project
    """
    arrays = read_arrays(path, what="a trained model of this project")
    if _DOCUMENT not in arrays:
        raise InputError("is not a trained model of this project", source=path)
    layout = parse_json(arrays[_DOCUMENT].tobytes(), source=path, where="its document")
    with placed(source=path):
        layout = MODEL_FORMAT.accept(layout)
    try:
        content = _put_together(layout["content"], arrays)
    except (KeyError, TypeError, ValueError) as error:
        raise InputError("is not a trained model of this project", source=path) from error
    if not isinstance(content, dict):
        raise InputError("is not a trained model of this project", source=path)
    return content


def check_finite(value: Any, source: str | Path) -> None:
    """Refuse weights that are not all finite, as in a damaged file.

    Parameters
    ----------
    value : part of a document of `read_model`
    source : its file

    Raises
    ------
    InputError : a number is not finite
    """
    if isinstance(value, Mapping):
        value = list(value.values())
    if isinstance(value, list | tuple):
        for item in value:
            check_finite(item, source)
    elif isinstance(value, np.ndarray) and value.dtype.kind == "f" and not np.isfinite(value).all():
        raise InputError("contains a weight that is not finite", source=source)


def _take_apart(value: Any, arrays: dict[str, NDArray[Any]]) -> Any:
    if isinstance(value, Mapping):
        return {
            "$dict": [
                [key if isinstance(key, str | int) else str(key), _take_apart(item, arrays)]
                for key, item in value.items()
            ]
        }
    if isinstance(value, list | tuple):
        return [_take_apart(item, arrays) for item in value]
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if hasattr(value, "detach"):  # a tensor
        value = value.detach().cpu().numpy()
    if isinstance(value, np.ndarray | np.generic):
        array = np.asarray(value)
        if array.dtype == object:
            raise TypeError("an array of Python objects cannot be saved")
        name = f"a{len(arrays)}"
        arrays[name] = array
        return {_ARRAY: name}
    raise TypeError(f"cannot be saved in a model: {type(value).__name__}")


def _put_together(value: Any, archive: Any) -> Any:
    if isinstance(value, list):
        return [_put_together(item, archive) for item in value]
    if isinstance(value, dict):
        if _ARRAY in value:
            return archive[str(value[_ARRAY])]
        return {key: _put_together(item, archive) for key, item in value["$dict"]}
    return value
