"""What throws told of an ice, kept so that later throws can be added without fitting them again.

Beside an ice file `ice.json` lies `ice.evidence.npz`: the normal equations of its throws in ln μ
of the cells they crossed and of each throw's own offset, release states projected out. σ per cell
alone would not do: neighbouring cells err together, and what one throw tells is an integral over
many. What is approximated: earlier throws stay linearised about the ice as it was then estimated,
with the noise and the wild rows that were found then.
"""

from __future__ import annotations

import zipfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from curling_env.errors import InputError
from curling_env.ice import Ice
from curling_env.storage import atomic_path
from curling_env.typing import Floats
from friction_estimation.inversion.noise import Noise
from friction_estimation.inversion.prior import Belief


@dataclass(frozen=True, kw_only=True)
class Knowledge:
    """Linear knowledge of ln μ from the throws so far.

    Parameters
    ----------
    reference : ln μ from which cells and `pull` are counted
    cells : (m,) flat indices of the cells that bent a path; empty for one number
    information : (m + throws, m + throws) Gram matrix of the sensitivities; for one number
        (throws, throws), diagonal, of each throw's own ln μ
    pull : (m + throws,) what of ln μ they ask for, in the same order
    observed : (rows, columns) cells that were crossed
    mu : (rows, columns) the estimate that came of it, by which its ice file is recognised
    noise : that was found
    belief : the prior's hyperparameters; None for one number
    ground, known : (cells,) ln μ about which the map was believed to vary, and its relative
        standard error, where an ice of another day was its prior; None otherwise
    shared : (m + throws, q) how q independent errors that all throws share pull; None where the
        tracks stated none
    """

    reference: float
    cells: NDArray[np.intp]
    information: Floats
    pull: Floats
    observed: NDArray[np.bool_]
    mu: Floats
    noise: Noise
    belief: Belief | None
    ground: Floats | None = None
    known: Floats | None = None
    shared: Floats | None = None

    @property
    def throws(self) -> int:
        """How many throws are in it."""
        return len(self.pull) - len(self.cells)

    @property
    def uniform(self) -> bool:
        """Whether it is of one number instead of a map."""
        return self.belief is None


def evidence_path(ice: str | Path) -> Path:
    """Where the knowledge behind an ice file is kept."""
    return Path(ice).with_suffix(".evidence.npz")


def save_knowledge(knowledge: Knowledge, path: Path) -> None:
    """Write it, complete or not at all."""
    noise, belief = knowledge.noise, knowledge.belief
    with atomic_path(path) as temporary:
        np.savez_compressed(
            temporary,
            reference=knowledge.reference,
            cells=knowledge.cells,
            information=knowledge.information,
            pull=knowledge.pull,
            observed=knowledge.observed,
            mu=knowledge.mu,
            noise=[noise.white, noise.slow, noise.time, noise.spacing],
            belief=(
                [] if belief is None
                else [belief.spread, belief.length, belief.scatter, belief.smoothness]
            ),
            ground=[] if knowledge.ground is None else knowledge.ground,
            known=[] if knowledge.known is None else knowledge.known,
            shared=[] if knowledge.shared is None else knowledge.shared,
        )  # fmt: skip


def load_knowledge(ice: Ice, source: str | Path) -> Knowledge:
    """The knowledge behind an ice file.

    Parameters
    ----------
    ice : as loaded from `source`
    source : the ice file

    Raises
    ------
    InputError : no such file, one that cannot be read, or one of another ice
    """
    path = evidence_path(source)
    if not path.exists():
        raise InputError(
            f"an update needs the evidence that `curling estimate` wrote beside the ice, {path}; "
            "--prior does with the ice alone",
            source=source,
        )
    try:
        with np.load(path, allow_pickle=False) as stored:
            white, slow, time, spacing = stored["noise"].tolist()
            prior = stored["belief"].tolist()
            found = Knowledge(
                reference=float(stored["reference"]),
                cells=stored["cells"].astype(np.intp),
                information=stored["information"],
                pull=stored["pull"],
                observed=stored["observed"].astype(np.bool_),
                mu=stored["mu"],
                noise=Noise(white=white, slow=slow, time=time, spacing=spacing),
                belief=Belief(**dict(zip(_BELIEF, prior, strict=True))) if prior else None,
                ground=stored["ground"] if stored["ground"].size else None,
                known=stored["known"] if stored["known"].size else None,
                shared=stored["shared"] if stored["shared"].size else None,
            )
    except (OSError, ValueError, KeyError, zipfile.BadZipFile) as error:
        raise InputError(f"cannot be read as the evidence of an ice: {error}",
                         source=path) from error  # fmt: skip
    size = len(found.pull)
    whole = found.information.shape == (size, size) and found.throws > 0
    if not (whole and np.isfinite(found.information).all() and np.isfinite(found.pull).all()):
        raise InputError("is not the whole evidence of an ice", source=path)
    if found.shared is not None and (found.shared.ndim != 2 or len(found.shared) != size):
        raise InputError("is not the whole evidence of an ice", source=path)
    same = found.mu.shape == ice.friction.mu.shape and found.observed.shape == found.mu.shape
    same = same and all(
        part is None or part.shape == (found.mu.size,) for part in (found.ground, found.known)
    )
    if not (same and np.allclose(found.mu, ice.friction.mu, rtol=1e-9)):
        raise InputError(f"belongs to another ice than {source}", source=path)
    return found


_BELIEF = ("spread", "length", "scatter", "smoothness")
