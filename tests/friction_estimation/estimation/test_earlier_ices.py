"""An ice of another day as prior, and throws added to an ice estimated before."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from curling_env.errors import InputError
from curling_env.ice import ActiveEffect, Ice, load_ice, save_ice
from curling_env.sheet import PAPER_SHEET
from curling_env.trajectory import write_tracks
from friction_estimation import estimate_ice
from friction_estimation.estimation import Choices, evidence_path, load_evidence, save_evidence


def error(friction, truth, cells):
    return float(np.sqrt(np.mean((friction.mu / truth - 1)[cells] ** 2)))


@pytest.fixture(scope="module")
def session(sliding) -> SimpleNamespace:
    """Twelve throws on a random ice, and the estimate of its friction."""
    rng = np.random.default_rng(5)
    field = sliding.random_field(rng, mu=0.0095, spread=0.06, length=3.0)
    tracks = sliding.measured_throws(field, sliding.varied_starts(rng, 12), rng)
    return SimpleNamespace(
        field=field,
        truth=field(*np.meshgrid(PAPER_SHEET.x_centres, PAPER_SHEET.y_centres)),
        tracks=tracks,
        found=estimate_ice(tracks, effects="none"),
    )


def test_yesterdays_pattern_serves_today(sliding, session):
    """Ice pebbled again, 6 % heavier, with its pattern kept to 1.5 %, and seen by three throws."""
    rng = np.random.default_rng(9)
    change = sliding.random_field(rng, mu=1.06, spread=0.015, length=3.0)

    def today(x, y):
        return session.field(x, y) * change(x, y)

    truth = today(*np.meshgrid(PAPER_SHEET.x_centres, PAPER_SHEET.y_centres))
    tracks = sliding.measured_throws(today, sliding.varied_starts(rng, 3), rng)
    alone = estimate_ice(tracks, effects="none").ice.friction
    friction = estimate_ice(tracks, effects="none", prior=session.found.ice).ice.friction
    before = session.found.ice.friction
    assert error(friction, truth, before.observed) < 0.7 * error(alone, truth, before.observed)
    normed = ((friction.mu - truth) / friction.sigma)[before.observed]
    assert (np.abs(normed) < 1.96).mean() > 0.85
    only_before = before.observed & ~friction.observed
    grown = (friction.sigma / friction.mu) / (before.sigma / before.mu)
    assert np.median(grown[only_before]) > 1.0


def test_a_prior_stands_for_the_ice_to_start_from(session):
    ice = session.found.ice
    with pytest.raises(InputError, match="expected one of a prior map"):
        estimate_ice(session.tracks[:2], prior=ice, uniform=True)
    with pytest.raises(InputError, match="expected one of a prior map"):
        estimate_ice(session.tracks[:2], prior=ice, start=ice)


def test_what_is_kept_comes_back_and_belongs_to_its_ice(session, tmp_path):
    path = tmp_path / "ice.json"
    ice = session.found.ice
    save_ice(ice, path)
    with pytest.raises(InputError, match="needs the evidence"):
        load_evidence(ice, path)
    law = ActiveEffect(name="curl", parameters={"strength": 0.004})
    choices = Choices(effects="none", start=Ice.uniform(0.008, effects=(law,)), prior=ice)
    save_evidence(session.tracks[:3], choices, ice, path)
    back = load_evidence(load_ice(path), path)
    assert len(back.tracks) == 3
    assert np.array_equal(back.tracks[1].xy, session.tracks[1].xy)
    assert back.choices.effects == "none"
    assert back.choices.start.effects == (law,)
    assert np.array_equal(back.choices.prior.friction.mu, ice.friction.mu)
    with pytest.raises(InputError, match="another ice"):
        load_evidence(Ice.uniform(0.009), path)
    evidence_path(path).write_bytes(b"PK not an archive")
    with pytest.raises(InputError, match="cannot be read"):
        load_evidence(ice, path)


def test_evidence_without_throws_is_refused(session, tmp_path):
    """Earlier versions kept normal equations, to which effects cannot be added."""
    path = tmp_path / "ice.json"
    np.savez(evidence_path(path), mu=session.found.ice.friction.mu, information=np.eye(3))
    with pytest.raises(InputError, match="estimate the ice again"):
        load_evidence(session.found.ice, path)


def test_evidence_of_earlier_releases_is_read(session, tmp_path):
    """They wrote throw, stone and clock once for each throw, and the number of its rows."""
    path, ice, tracks = tmp_path / "ice.json", session.found.ice, session.tracks[:3]
    save_evidence(tracks, Choices(), ice, path)
    with np.load(evidence_path(path)) as arrays:
        columns = dict(arrays)
    each = {name: [getattr(k, name) for k in tracks] for name in ("throw", "stone", "clock")}
    np.savez(evidence_path(path), **{**columns, **each, "rows": [len(k) for k in tracks]})
    assert load_evidence(ice, path).tracks == list(tracks)
    np.savez(evidence_path(path), **{**columns, **each, "rows": [len(tracks[0])]})
    with pytest.raises(InputError, match="is incomplete"):
        load_evidence(ice, path)


def test_command_updates_and_starts_from_yesterday(curling, session, tmp_path):
    early, late = tmp_path / "early.csv", tmp_path / "late.csv"
    write_tracks(early, session.tracks[:2])
    write_tracks(late, session.tracks[10:])
    ice, later = tmp_path / "ice.json", tmp_path / "later.json"
    assert curling("estimate", early, "-o", ice, "--uniform").status == 0
    result = curling("estimate", late, "--update", ice, "-o", later)
    assert result.status == 0, result.err
    assert result.json()["throws_before"] == 2
    together = estimate_ice([*session.tracks[:2], *session.tracks[10:]], uniform=True)
    # An update is the estimate from all throws: tracks in a file are rounded to 10 µm.
    assert result.json()["mu"] == pytest.approx(together.mu, rel=1e-5)
    twice = curling("estimate", late, "--update", later, "-o", tmp_path / "twice.json")
    assert twice.status == 0, twice.err
    assert "counts once" in twice.err
    assert twice.json()["mu"] == pytest.approx(together.mu, rel=1e-5)
    again = curling(
        "estimate", late, "--prior", ice, "--effects", "none", "-o", tmp_path / "t.json"
    )
    assert again.status == 0, again.err
    assert evidence_path(tmp_path / "t.json").exists()
    both = curling("estimate", late, "--prior", ice, "--update", ice, "-o", ice)
    assert "one of --start" in both.complaint
    other = curling("estimate", late, "--update", later, "--effects", "none", "-o", ice)
    assert "another --effects" in other.complaint
    save_ice(Ice.uniform(0.009), tmp_path / "bare.json")
    bare = curling("estimate", late, "--update", tmp_path / "bare.json", "-o", ice)
    assert "needs the evidence" in bare.complaint
    paper = curling("estimate", late, "--prior", ice, "--method", "paper", "-o", later)
    assert "paper's method" in paper.complaint
