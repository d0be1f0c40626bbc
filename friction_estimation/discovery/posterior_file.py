"""The posterior of a fit as a file that ArviZ and xarray read: InferenceData in netCDF (HDF5)."""

from __future__ import annotations

import importlib
import importlib.util
from collections.abc import Mapping, Sequence
from functools import partial
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from curling_env.infrastructure.files.storage import format_json
from curling_env.infrastructure.files.writing import atomic_path
from friction_estimation.discovery.evidence.posterior import Posterior, draw_posterior
from friction_estimation.discovery.model.fit import SessionFit

CHAINS = 4
"""Number of chains into which the independent draws are divided, for diagnostics."""
STATES = ("x", "y", "vx", "vy", "theta", "omega")
LIBRARY = "h5netcdf"
"""Library that writes the file, of the extra `science`."""

Variables = dict[str, tuple[tuple[str, ...], Any]]
"""Dimensions and values by name."""


def can_write_posterior() -> bool:
    """Return whether the extra `science`, which writes the file, is installed."""
    return importlib.util.find_spec(LIBRARY) is not None


def write_posterior_of(
    fitted: SessionFit, path: str | Path, *, seed: int, provenance: Mapping[str, Any]
) -> bool:
    """Draw from the posterior of a fit and write the draws, if the extra `science` is installed.

    Parameters
    ----------
    fitted, path, provenance : see `write_posterior`
    seed : seed of the draws

    Returns
    -------
    True if the file was written

    Raises
    ------
    OutputError : the file cannot be written
    """
    if not can_write_posterior():
        return False
    drawn = draw_posterior(fitted, np.random.default_rng(seed))
    write_posterior(drawn, fitted, path, provenance=provenance)
    return True


def write_posterior(
    posterior: Posterior,
    fitted: SessionFit,
    path: str | Path,
    *,
    provenance: Mapping[str, Any] | None = None,
) -> None:
    """Write draws and data, complete or not at all.

    Groups: ``posterior`` (chain, draw, …), ``log_likelihood`` of each throw, ``observed_data``, and
    ``constant_data`` with what belongs to the rows.

    Parameters
    ----------
    posterior : draws; their number is a multiple of `CHAINS`
    fitted : the fit that they were drawn from
    path : file to write
    provenance : where the fit comes from

    Raises
    ------
    ModuleNotFoundError : the extra `science` is not installed
    OutputError : the file cannot be written
    """
    library: Any = importlib.import_module(LIBRARY)
    session = fitted.session
    rows = np.arange(len(session.times))
    data = {"row": rows}
    throws = {"throw": session.throws}
    draws = {"chain": np.arange(CHAINS), "draw": np.arange(len(posterior.shared) // CHAINS)}
    attributes: dict[str, Any] = {"inference_library": "curling-sheet"}
    if provenance:
        attributes["inference_library_version"] = provenance["version"]
        attributes["provenance"] = format_json(provenance)
    # In memory first: on a full disk, HDF5 ends the process when it cannot close its file.
    content = BytesIO()
    with library.File(content, "w") as file:
        file.attrs.update(attributes)
        write = partial(_write, file, attributes)
        drawn = {**draws, **throws, "state": np.array(STATES)}
        write("posterior", drawn, _drawn(posterior, fitted))
        density = _chained(posterior.log_likelihood)
        write(
            "log_likelihood", {**draws, **throws}, {"rows": (("chain", "draw", "throw"), density)}
        )
        measured = {"x": session.xy[:, 0], "y": session.xy[:, 1], "theta": session.theta}
        write("observed_data", data, {name: (("row",), v) for name, v in measured.items()})
        known = {"throw": session.throws[session.owner], "t": session.times, "swept": session.swept}
        write("constant_data", data, {name: (("row",), v) for name, v in known.items()})
    with atomic_path(path) as draft:
        draft.write_bytes(content.getbuffer())


def _drawn(posterior: Posterior, fitted: SessionFit) -> Variables:
    """Return the variables of the group ``posterior``."""
    draw = ("chain", "draw")
    variables: Variables = {
        "spread": (draw, _chained(posterior.spreads)),
        "ln_factor": ((*draw, "throw"), _chained(posterior.ln_factors)),
        "release": ((*draw, "throw", "state"), _chained(posterior.states)),
    }
    families: dict[str, list[int]] = {}
    for k, (label, parameter) in enumerate(posterior.names):
        family, _, number = parameter.rpartition("_")
        if not label and number.isdecimal():
            families.setdefault(family, []).append(k)
        else:
            name = f"{label}.{parameter}" if label else parameter
            variables[name] = (draw, _chained(posterior.shared[:, k]))
    for family, places in families.items():
        dimensions = (*draw, f"{family}_coefficient")
        variables[f"{family}_coefficients"] = (dimensions, _chained(posterior.shared[:, places]))
    level = posterior.shared[:, posterior.names.index(("", "ln_mu"))]
    mean = float(fitted.model.ice.friction.mu.mean())
    if posterior.mu is None:
        variables["mu"] = (draw, _chained(mean * np.exp(level)))
    else:
        variables["mu"] = (draw, _chained(posterior.mu.mean(axis=(1, 2))))
        cells = posterior.mu.astype(np.float32)  # a millionth of μ; the map is most of the file
        variables["mu_cells"] = ((*draw, "cell_row", "cell_column"), _chained(cells))
    return variables


def _chained(values: np.ndarray) -> np.ndarray:
    """Draws (n, …) as (chain, draw, …)."""
    return values.reshape(CHAINS, -1, *values.shape[1:])


def _write(
    file: Any,
    attributes: Mapping[str, Any],
    name: str,
    coordinates: Mapping[str, Sequence[Any] | np.ndarray],
    variables: Variables,
) -> None:
    """Write one group: its dimensions, their coordinates, and the variables."""
    group = file.create_group(name)
    group.attrs.update(attributes)
    for dimension, places in coordinates.items():
        group.dimensions[dimension] = len(places)
        values = np.asarray(places)
        if values.dtype.kind == "U":
            values = values.astype(object)
            text = importlib.import_module("h5py").string_dtype()
            group.create_variable(dimension, (dimension,), dtype=text, data=values)
        else:
            group.create_variable(dimension, (dimension,), data=values)
    for key, (dimensions, values) in variables.items():
        for dimension, size in zip(dimensions, values.shape, strict=True):
            if dimension not in group.dimensions:
                group.dimensions[dimension] = size
        group.create_variable(key, dimensions, data=values, compression="gzip")
