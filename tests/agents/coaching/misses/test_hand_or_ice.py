"""Causes of misses, compared with clubs whose truth is known (`scripts/simulated_club.py`)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import simulated_club as club
from simulated_ice import random_ice, seen_rests

from agents.coaching import CAUSES, Place, hand_or_ice, read_release, rests
from curling_env.errors import TrackTooShortError
from curling_env.ice import ActiveEffect
from curling_env.physics import slide
from curling_env.throw import Throw
from friction_estimation.tracks import ThrowNote

ATHLETES = (club.Athlete(name="Ada"), club.Athlete(name="Bo", bias=(0.03, 0.004, 0.0), spin=1.7))


COLUMNS = ("t", "xy", "theta", "swept", "sigma_xy", "sigma_theta")


@pytest.fixture(scope="module")
def evening_causes():
    """Return an evening, its estimated ice, and the function's result."""
    rng = np.random.default_rng(5)
    evening = club.evening(rng, athletes=ATHLETES, throws=5)
    ice = evening.ice.as_ice(rng, sigma=0.002, curl_sigma=0.01)
    found = hand_or_ice(evening.tracks, ice, evening.notes, believed=evening.believed.as_ice())
    return evening, ice, found


def test_the_club_slides_as_the_engine_does():
    """Two integrations of one ice that share no code agree to millimetres."""
    ice = random_ice(np.random.default_rng(1))
    throws = np.array([[2.2, 0.02, 1.3, 0.1], [2.0, -0.01, -1.5, 0.0], [2.3, 0.0, 0.8, -0.1]])
    assert rests(ice.as_ice(), throws, Place()) == pytest.approx(seen_rests(ice, throws), abs=0.01)


def test_parts_add_up_and_shares_to_one(evening_causes):
    _, _, found = evening_causes
    assert len(found.throws) == 10
    for one in found.throws:
        total = sum(np.array([p.right.value, p.past.value]) for p in one.parts.values())
        assert total == pytest.approx(one.miss, abs=1e-9)
        assert sum(p.share.value for p in one.parts.values()) == pytest.approx(1.0)
        assert one.miss == pytest.approx(one.rest - one.target)
    assert sum(share.value for share in found.pattern.shares.values()) == pytest.approx(1.0)


def test_causes_are_the_true_ones_within_their_intervals(evening_causes):
    evening, _, found = evening_causes
    inside, near = [], []
    for one in found.throws:
        off = []
        for cause, part in one.parts.items():
            truth = evening.parts[cause][one.throw]
            inside += [
                low - 0.005 <= value <= high + 0.005
                for value, (low, high) in zip(truth, part.interval(), strict=True)
            ]
            off.append(np.hypot(part.right.value - truth[0], part.past.value - truth[1]))
        near.append(max(off) < 0.15 * one.distance)
    assert np.mean(inside) >= 0.9
    assert np.mean(near) >= 0.9


def test_systematic_errors_of_an_athlete_are_the_pattern(evening_causes):
    _, _, found = evening_causes
    patterns = {pattern.athlete: pattern for pattern in found.athletes}
    right, past = patterns["Bo"].mean["weight"]
    assert past.value == pytest.approx(0.03 * 27, abs=0.6)  # 3 cm/s too much on each throw
    assert past.value > patterns["Ada"].mean["weight"][1].value
    assert abs(right.value) < 0.2


def test_without_the_believed_ice_it_warns_and_blames_no_ice(evening_causes):
    evening, ice, _ = evening_causes
    found = hand_or_ice(evening.tracks, ice, evening.notes)
    assert not found.believed
    assert "was not given" in found.remarks[0]
    for one in found.throws:
        assert one.parts["ice"].size < 2e-3
        assert one.parts["ice"].past.sigma < 2e-3
        assert one.parts["weight"].past.sigma > 0.02  # what the ice is not known to


def test_a_broom_at_a_wrong_place_is_ice_that_was_read_wrong(evening_causes):
    evening, ice, _ = evening_causes
    one = evening.tracks[0]
    # The broom stands where the stone was sent, so that the line is no error of the hand.
    _, angle, _, x = evening.thrown[0]
    broom = x - 28.346 * np.tan(angle)
    notes = {0: ThrowNote(called=f"draw 1.5,{evening.rests[0, 1]:.2f} broom {broom:.3f}")}
    (cause,) = hand_or_ice([one], ice, notes).throws
    assert cause.main == "ice"
    assert cause.parts["line"].size < 0.1
    assert cause.parts["ice"].right.value == pytest.approx(evening.rests[0, 0] - 1.5, abs=0.25)


def test_reasons_for_excluded_throws(evening_causes):
    evening, ice, _ = evening_causes
    short = evening.tracks[0]
    cut = slice(0, len(short) // 2)
    never_rests = replace(
        short,
        throw=4,
        **{name: getattr(short, name)[cut] for name in COLUMNS},
    )
    tracks = [*evening.tracks[:4], never_rests]
    notes = {
        0: ThrowNote(called="draw button"),
        1: ThrowNote(called="what a throw"),
        3: ThrowNote(called="peel out"),
        4: ThrowNote(called="draw button"),
    }
    found = hand_or_ice(tracks, ice, notes)
    assert [one.throw for one in found.throws] == [0]
    assert found.left_out == {
        1: "its call cannot be read",
        2: "no call",
        3: "the call names no target",
        4: "its place of rest was not seen",
    }


def test_a_hit_is_judged_where_it_crosses_the_line_of_its_target(evening_causes):
    evening, ice, _ = evening_causes
    right, past = evening.rests[0]
    notes = {0: ThrowNote(called=f"hit {right + 0.3:.2f},{past - 1.0:.2f}")}
    (one,) = hand_or_ice([evening.tracks[0]], ice, notes).throws
    assert one.miss[1] == 0.0
    assert one.miss[0] == pytest.approx(-0.3, abs=0.15)
    assert one.errors.speed is None  # no weight was called
    assert one.parts["weight"].size < 1e-6
    assert abs(one.parts["line"].share.value) > 0.5


def test_a_release_is_read_within_its_errors_on_ice_of_another_friction(evening_causes):
    evening, ice, _ = evening_causes
    heavier = replace(ice, friction=replace(ice.friction, mu=1.015 * ice.friction.mu))
    off = []
    for k, track in enumerate(evening.tracks):
        released = read_release(track, heavier, order=k)
        off.append((released.throw - evening.thrown[k]) / np.sqrt(np.diag(released.covariance)))
    assert (np.abs(off) < 1.96).mean() >= 0.9
    assert np.abs(off).max() < 5


def test_a_release_that_was_not_seen(evening_causes):
    evening, ice, _ = evening_causes
    track = evening.tracks[0]
    late = slice(150, None)
    cut = replace(track, **{name: getattr(track, name)[late] for name in COLUMNS})
    with pytest.raises(TrackTooShortError, match="beyond the hog line were not seen"):
        read_release(cut, ice)


def test_every_cause_has_its_place_in_the_table(evening_causes):
    _, _, found = evening_causes
    document = found.as_dict()
    for row in document["throws"]:
        assert {f"{cause}_share_sigma" for cause in CAUSES if cause != "sweeping"} <= set(row)
        assert row["speed_error_sigma"] > 0


def test_marked_sweeping_is_a_separate_cause(evening_causes):
    """A stone was swept for six seconds on ice with the effect of sweeping."""
    _, ice, _ = evening_causes
    swept_ice = ice.with_effect(ActiveEffect(name="sweeping", parameters={"friction_factor": 0.9}))
    throw = Throw(speed=2.2, angle=0.0, spin=-1.3)
    swept, plain = (
        slide(swept_ice, throw.release(sweep=sweep), fps=30.0).trajectory
        for sweep in ((5.0, 11.0), (0.0, 0.0))
    )
    longer = float(swept.xy[-1, 1] - plain.xy[-1, 1])
    assert longer > 0.3
    past = plain.xy[-1, 1] - 17.3735
    notes = {0: ThrowNote(called=f"draw {plain.xy[-1, 0]:.3f},{past:.3f}")}
    (one,) = hand_or_ice([swept], swept_ice, notes, believed=swept_ice).throws
    assert one.main == "sweeping"
    assert one.parts["sweeping"].past.value == pytest.approx(longer, rel=0.1)
    assert one.parts["neither"].size < 0.1
