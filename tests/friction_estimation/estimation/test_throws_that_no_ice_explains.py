"""Throws with readings that no stone can have: a clear refusal that names the throw."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from curling_env import Throw, simulate
from curling_env.errors import FitError
from friction_estimation import estimate_ice
from friction_estimation.discovery.model.fit import singular_fit_refused


@pytest.mark.parametrize("damaged", [1, 2])
def test_headings_that_no_friction_explains_name_their_throw(damaged: int) -> None:
    throws = [Throw(speed=2.0 + 0.2 * k, spin=1.5 * (-1) ** k) for k in range(4)]
    tracks = [replace(track, throw=k) for k, track in enumerate(simulate("club", throws))]
    tracks[damaged] = replace(tracks[damaged], theta=40.0 * tracks[damaged].t)
    with pytest.raises(FitError, match=rf"throw {damaged} fits worst, by .* m and .* rad"):
        estimate_ice(tracks)


def test_singular_equations_are_a_refusal() -> None:
    message = "positions, times or headings make the equations singular"
    with pytest.raises(FitError, match=message), singular_fit_refused():
        np.linalg.inv(np.zeros((2, 2)))
