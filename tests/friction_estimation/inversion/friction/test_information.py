"""An ice of another day as prior, and throws added to an ice estimated before."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from curling_env.errors import InputError
from curling_env.ice import Ice, load_ice, save_ice
from curling_env.sheet import PAPER_SHEET
from curling_env.trajectory import write_tracks
from friction_estimation.inversion import estimate_friction
from friction_estimation.inversion.friction.information import (
    information_path,
    load_information,
    save_information,
)


def error(friction, truth, cells):
    return float(np.sqrt(np.mean((friction.mu / truth - 1)[cells] ** 2)))


@pytest.fixture(scope="module")
def session(sliding) -> SimpleNamespace:
    """Twelve throws on a random ice; ten are fitted first, two come later."""
    rng = np.random.default_rng(5)
    field = sliding.random_field(rng, mu=0.0095, spread=0.06, length=3.0)
    tracks = sliding.measured_throws(field, sliding.varied_starts(rng, 12), rng)
    return SimpleNamespace(
        field=field,
        truth=field(*np.meshgrid(PAPER_SHEET.x_centres, PAPER_SHEET.y_centres)),
        tracks=tracks,
        first=estimate_friction(tracks[:10]),
        joint=estimate_friction(tracks),
    )


def test_an_update_is_the_joint_fit(session):
    first = session.first
    updated = estimate_friction(session.tracks[10:], start=first.ice, update=first.information)
    one, other = updated.ice.friction, session.joint.ice.friction
    assert np.array_equal(one.observed, other.observed)
    seen = one.observed
    # Noise and linearisation of the first ten were not looked at again: a fraction of sigma.
    apart = (np.abs(one.mu - other.mu) / other.sigma)[seen]
    assert np.sqrt((apart**2).mean()) < 0.1
    assert np.median(np.abs(np.log(one.sigma / other.sigma))[seen]) < 0.1
    assert abs(updated.mu / session.joint.mu - 1) < 2e-4
    assert updated.summary()["throws_before"] == 10
    assert error(one, session.truth, seen) < error(first.ice.friction, session.truth, seen)


def test_only_the_new_throws_are_looked_at(session):
    updated = estimate_friction(
        session.tracks[10:], start=session.first.ice, update=session.first.information
    )
    assert len(updated.throws) == len(updated.slides) == 2
    assert [throw.inputs.order for throw in updated.throws] == [10, 11]
    assert updated.information.throws == 12


def test_one_number_is_updated_as_well(session):
    joint = estimate_friction(session.tracks, uniform=True)
    first = estimate_friction(session.tracks[:10], uniform=True)
    updated = estimate_friction(
        session.tracks[10:], start=first.ice, update=first.information, uniform=True
    )
    assert abs(updated.mu - joint.mu) < 0.3 * joint.sigma
    assert updated.sigma == pytest.approx(joint.sigma, rel=0.2)


def test_yesterdays_pattern_serves_today(sliding, session):
    """The ice is pebbled anew: 6 % heavier, its pattern kept but for 1.5 %. Three throws see it."""
    rng = np.random.default_rng(9)
    change = sliding.random_field(rng, mu=1.06, spread=0.015, length=3.0)

    def today(x, y):
        return session.field(x, y) * change(x, y)

    truth = today(*np.meshgrid(PAPER_SHEET.x_centres, PAPER_SHEET.y_centres))
    tracks = sliding.measured_throws(today, sliding.varied_starts(rng, 3), rng)
    alone = estimate_friction(tracks).ice.friction
    found = estimate_friction(tracks, start=session.joint.ice, prior=session.joint.ice.friction)
    friction = found.ice.friction
    yesterday = session.joint.ice.friction.observed
    assert error(friction, truth, yesterday) < 0.7 * error(alone, truth, yesterday)
    normed = ((friction.mu - truth) / friction.sigma)[yesterday]
    assert (np.abs(normed) < 1.96).mean() > 0.85
    only_before = yesterday & ~friction.observed
    grown = (
        friction.sigma
        / friction.mu
        / (session.joint.ice.friction.sigma / session.joint.ice.friction.mu)
    )
    assert np.median(grown[only_before]) > 1.0


def test_what_is_kept_comes_back_and_belongs_to_its_ice(session, tmp_path):
    path = tmp_path / "ice.json"
    save_ice(session.first.ice, path)
    with pytest.raises(InputError, match="needs the evidence"):
        load_information(session.first.ice, path)
    save_information(session.first.information, information_path(path))
    back = load_information(load_ice(path), path)
    assert np.array_equal(back.matrix, session.first.information.matrix)
    assert back.hyperparameters == session.first.hyperparameters
    assert back.noise == session.first.information.noise
    with pytest.raises(InputError, match="another ice"):
        load_information(session.joint.ice, path)
    information_path(path).write_bytes(b"PK not an archive")
    with pytest.raises(InputError, match="cannot be read"):
        load_information(session.first.ice, path)


def test_what_does_not_go_together_is_refused(session):
    first, new = session.first, session.tracks[10:]
    with pytest.raises(InputError, match="stays so"):
        estimate_friction(new, start=first.ice, update=first.information, uniform=True)
    with pytest.raises(InputError, match="not both"):
        estimate_friction(new, start=first.ice, update=first.information, prior=first.ice.friction)
    with pytest.raises(InputError, match="one number"):
        estimate_friction(new, prior=first.ice.friction, uniform=True)
    with pytest.raises(InputError, match="paper's method"):
        estimate_friction(new, prior=first.ice.friction, method="paper")


def test_command_updates_and_starts_from_yesterday(curling, session, tmp_path):
    early, late = tmp_path / "early.csv", tmp_path / "late.csv"
    write_tracks(early, session.tracks[:2])
    write_tracks(late, session.tracks[10:])
    ice = tmp_path / "ice.json"
    assert curling("estimate", early, "-o", ice, "--uniform").status == 0
    result = curling("estimate", late, "--update", ice, "-o", tmp_path / "later.json")
    assert result.status == 0, result.err
    assert result.json()["throws_before"] == 2
    again = curling("estimate", late, "--prior", ice, "-o", tmp_path / "today.json")
    assert again.status == 0, again.err
    assert (tmp_path / "today.evidence.npz").exists()
    both = curling("estimate", late, "--prior", ice, "--update", ice, "-o", ice)
    assert "one of --start" in both.complaint
    save_ice(Ice.uniform(0.009), tmp_path / "bare.json")
    bare = curling("estimate", late, "--update", tmp_path / "bare.json", "-o", ice)
    assert "needs the evidence" in bare.complaint
