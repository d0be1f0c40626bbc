"""Information of the throws behind an ice, stored so that later throws can be added to it.

Beside an ice file `ice.json` lies `ice.evidence.npz`: the normal equations of its throws in ln μ
of the cells they crossed and in each throw's own offset, with the release states projected out.
One σ for each cell would not do, because neighbouring cells err together and a throw measures an
integral over many of them. One thing is approximate: earlier throws stay linearised about the ice
as it was estimated then, with the noise and the wild rows that were found then.
"""

from __future__ import annotations

import zipfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from curling_env.errors import InputError
from curling_env.ice import Ice
from curling_env.infrastructure.storage import atomic_path
from curling_env.typing import Flags, Floats, Indices
from friction_estimation.inversion.friction.posterior import Hyperparameters
from friction_estimation.inversion.noise import Noise

_HYPERPARAMETERS = ("spread", "length", "scatter", "smoothness")


@dataclass(frozen=True, kw_only=True)
class StoredInformation:
    """Information about ln μ from all throws so far, in the form of normal equations.

    Parameters
    ----------
    reference : ln μ from which cells and `vector` are counted
    cells : (m,) flat indices of the cells that changed a path; empty for one friction
    matrix : (m + throws, m + throws) normal matrix of cells and throws' offsets; for one friction
        (throws, throws), diagonal, of each throw's own ln μ
    vector : (m + throws,) right-hand side, in the same order
    observed : (rows, columns) cells that were crossed
    mu : (rows, columns) the estimate that followed, by which its ice file is recognised
    noise : noise that was found
    hyperparameters : hyperparameters of the prior; None for one friction
    prior_mean, prior_sd : (cells,) mean and standard deviation of ln μ that an ice of another day
        gave as the prior; None without one
    systematic : (m + throws, q) change of `vector` by q independent errors that all throws share;
        None where the tracks stated none
    """

    reference: float
    cells: Indices
    matrix: Floats
    vector: Floats
    observed: Flags
    mu: Floats
    noise: Noise
    hyperparameters: Hyperparameters | None
    prior_mean: Floats | None = None
    prior_sd: Floats | None = None
    systematic: Floats | None = None

    @property
    def throws(self) -> int:
        """Number of throws in it."""
        return len(self.vector) - len(self.cells)

    @property
    def uniform(self) -> bool:
        """Whether it describes one friction instead of a map."""
        return self.hyperparameters is None


def information_path(ice: str | Path) -> Path:
    """Where the information behind an ice file is kept."""
    return Path(ice).with_suffix(".evidence.npz")


def save_information(information: StoredInformation, path: Path) -> None:
    """Write the file, complete or not at all."""
    noise, hyper = information.noise, information.hyperparameters
    with atomic_path(path) as temporary:
        np.savez_compressed(
            temporary,
            reference=information.reference,
            cells=information.cells,
            information=information.matrix,
            pull=information.vector,
            observed=information.observed,
            mu=information.mu,
            noise=[noise.white, noise.slow, noise.time, noise.spacing],
            belief=[] if hyper is None else [getattr(hyper, name) for name in _HYPERPARAMETERS],
            ground=[] if information.prior_mean is None else information.prior_mean,
            known=[] if information.prior_sd is None else information.prior_sd,
            shared=[] if information.systematic is None else information.systematic,
        )


def load_information(ice: Ice, source: str | Path) -> StoredInformation:
    """The information behind an ice file.

    Parameters
    ----------
    ice : ice as loaded from `source`
    source : the ice file

    Raises
    ------
    InputError : the file is missing, cannot be read, or belongs to another ice
    """
    path = information_path(source)
    if not path.exists():
        raise InputError(
            f"an update needs the evidence that `curling estimate` wrote beside the ice, {path}; "
            "--prior needs only the ice",
            source=source,
        )
    try:
        with np.load(path, allow_pickle=False) as stored:
            white, slow, time, spacing = stored["noise"].tolist()
            prior = stored["belief"].tolist()
            hyper = dict(zip(_HYPERPARAMETERS, prior, strict=True)) if prior else None
            found = StoredInformation(
                reference=float(stored["reference"]),
                cells=stored["cells"].astype(np.intp),
                matrix=stored["information"],
                vector=stored["pull"],
                observed=stored["observed"].astype(np.bool_),
                mu=stored["mu"],
                noise=Noise(white=white, slow=slow, time=time, spacing=spacing),
                hyperparameters=None if hyper is None else Hyperparameters(**hyper),
                prior_mean=stored["ground"] if stored["ground"].size else None,
                prior_sd=stored["known"] if stored["known"].size else None,
                systematic=stored["shared"] if stored["shared"].size else None,
            )
    except (OSError, ValueError, KeyError, zipfile.BadZipFile) as error:
        problem = f"cannot be read as the evidence of an ice: {error}"
        raise InputError(problem, source=path) from error
    if not _is_whole(found):
        raise InputError("is not the whole evidence of an ice", source=path)
    if not _belongs_to(found, ice):
        raise InputError(f"belongs to another ice than {source}", source=path)
    return found


def _is_whole(found: StoredInformation) -> bool:
    size = len(found.vector)
    if found.matrix.shape != (size, size) or found.throws <= 0:
        return False
    if not (np.isfinite(found.matrix).all() and np.isfinite(found.vector).all()):
        return False
    return found.systematic is None or (
        found.systematic.ndim == 2 and len(found.systematic) == size
    )


def _belongs_to(found: StoredInformation, ice: Ice) -> bool:
    if not found.mu.shape == ice.friction.mu.shape == found.observed.shape:
        return False
    priors = (found.prior_mean, found.prior_sd)
    if any(part is not None and part.shape != (found.mu.size,) for part in priors):
        return False
    return np.allclose(found.mu, ice.friction.mu, rtol=1e-9)
