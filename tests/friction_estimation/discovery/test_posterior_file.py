"""The posterior's file as ArviZ and xarray read it."""

from __future__ import annotations

import json
import warnings
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.special import logsumexp

from friction_estimation.discovery import (
    base_model,
    candidates,
    draw_posterior,
    fit_with_noise,
    left_out_scores,
    mixture,
    open_session,
    write_posterior,
)
from friction_estimation.discovery.evidence.posterior import throw_constants
from friction_estimation.discovery.posterior_file import _drawn

from .conftest import effect

with warnings.catch_warnings():
    warnings.simplefilter("ignore")  # ArviZ announces its next version
    arviz = pytest.importorskip("arviz", reason="make setup installs it")

ORIGIN = {"version": "0.2.0", "command": "curling discover tracks.csv", "inputs": []}


@pytest.fixture
def fitted(make_session):
    session = open_session(make_session([effect("curl", strength=0.006)], scatter=0.01))
    model = base_model(None, session)
    curl = next(t for t in candidates(session, model.terms) if t.label == "curl")
    return fit_with_noise(model.with_terms(curl), session)


def test_arviz_reads_it(fitted, tmp_path):
    drawn = draw_posterior(fitted, np.random.default_rng(0))
    write_posterior(drawn, fitted, tmp_path / "posterior.nc", provenance=ORIGIN)
    data = arviz.from_netcdf(tmp_path / "posterior.nc")
    assert {"posterior", "log_likelihood", "observed_data"} <= set(data.groups())
    posterior = data.posterior
    assert posterior["curl.strength"].dims == ("chain", "draw")
    assert float(posterior["curl.strength"].mean()) == pytest.approx(0.006, rel=0.02)
    assert posterior["ln_factor"].dims == ("chain", "draw", "throw")
    release = posterior["release"].sel(state="vy", throw=int(fitted.session.throws[3]))
    assert float(release.mean()) == pytest.approx(fitted.states[3, 3], abs=0.002)
    assert data.observed_data["x"].values == pytest.approx(fitted.session.xy[:, 0])
    assert json.loads(posterior.attrs["provenance"]) == ORIGIN
    summary = arviz.summary(data, var_names=["mu", "curl.strength", "spread"])
    assert (summary["r_hat"] < 1.02).all()


def test_arviz_leaves_throws_out_to_the_same_densities(fitted, tmp_path):
    """Its importance sampling shares nothing with our integrals but the draws' own likelihood."""
    drawn = draw_posterior(fitted, np.random.default_rng(0), draws=4000)
    write_posterior(drawn, fitted, tmp_path / "posterior.nc")
    theirs = arviz.loo(arviz.from_netcdf(tmp_path / "posterior.nc"), pointwise=True)
    found = mixture(fitted)
    at_each = [
        replace(fitted, linear=replace(fitted.linear, model=replace(fitted.model, spread=spread)))
        for spread in found.spreads.tolist()
    ]
    inverse = [0.5 * (left_out_scores(each) + throw_constants(each)) for each in at_each]
    with np.errstate(divide="ignore"):
        ours = -logsumexp(np.log(found.weights)[:, None] + inverse, axis=0)
    assert theirs.loo_i.values == pytest.approx(ours, abs=0.25)
    assert theirs.elpd_loo == pytest.approx(ours.sum(), abs=0.6)


def test_the_same_seed_gives_the_same_bytes(fitted, tmp_path):
    for name in ("a.nc", "b.nc"):
        drawn = draw_posterior(fitted, np.random.default_rng(3), draws=100)
        write_posterior(drawn, fitted, tmp_path / name, provenance=ORIGIN)
    assert (tmp_path / "a.nc").read_bytes() == (tmp_path / "b.nc").read_bytes()


def test_numbered_coefficients_are_one_variable(fitted, tmp_path):
    drawn = draw_posterior(fitted, np.random.default_rng(3), draws=100)
    names = [("", "ln_mu"), ("", "camera_0"), ("", "camera_1")]  # three as there were
    odd = replace(drawn, names=names)
    write_posterior(odd, fitted, tmp_path / "posterior.nc")
    posterior = arviz.from_netcdf(tmp_path / "posterior.nc").posterior
    assert posterior["camera_coefficients"].shape == (4, 25, 2)
    assert "camera_0" not in posterior


def test_draws_are_written_in_chains_by_their_names():
    """The friction of a session without a map is the mean of its ice, times the level."""
    n = 8
    shared = np.arange(3.0 * n).reshape(n, 3) / 100
    posterior: Any = SimpleNamespace(
        names=[("", "ln_mu"), ("", "ripple_0"), ("curl", "strength_2")],
        shared=shared, spreads=np.arange(n), ln_factors=np.ones((n, 2)),
        states=np.zeros((n, 2, 6)), mu=None,
    )  # fmt: skip
    mu = np.array([[0.008, 0.010]])
    ice = SimpleNamespace(friction=SimpleNamespace(mu=mu))
    fit: Any = SimpleNamespace(model=SimpleNamespace(ice=ice))
    drawn = _drawn(posterior, fit)
    chains = np.arange(n).reshape(4, 2)
    assert drawn["spread"][1].tolist() == chains.tolist()
    assert drawn["ln_mu"][1] == pytest.approx(shared[:, 0].reshape(4, 2))
    # A number of a family without a term counts its members; that of a term is its name.
    assert drawn["curl.strength_2"][1] == pytest.approx(shared[:, 2].reshape(4, 2))
    assert drawn["ripple_coefficients"][1] == pytest.approx(shared[:, 1].reshape(4, 2, 1))
    assert drawn["mu"][1] == pytest.approx(0.009 * np.exp(shared[:, 0]).reshape(4, 2))
    assert "mu_cells" not in drawn
    cells = np.random.default_rng(1).uniform(0.008, 0.01, (n, 2, 3))
    mapped: Any = SimpleNamespace(**{**vars(posterior), "mu": cells})
    drawn = _drawn(mapped, fit)
    assert drawn["mu"][1] == pytest.approx(cells.mean(axis=(1, 2)).reshape(4, 2))
    assert drawn["mu_cells"][1] == pytest.approx(cells.reshape(4, 2, 2, 3), rel=1e-6)
    assert drawn["release"][0] == ("chain", "draw", "throw", "state")
