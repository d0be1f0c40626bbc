"""Known lengths and times decide whether the scale and the frame rate of tracks are right."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from curling_env.errors import InputError
from curling_env.ice import Ice
from friction_estimation import discover
from friction_estimation.discovery import (
    calibrate,
    calibrations_of,
    corrected,
    document,
    read_reference,
)

from ..conftest import effect


def test_scale_and_frame_rate_are_named_only_by_references(make_session):
    tracks = [replace(track, xy=1.03 * track.xy, t=1.2 * track.t) for track in make_session(fps=8)]
    blind = document(discover(tracks))
    assert blind["effects"] == []
    assert blind["undecidable"]["names"] == ["scale_error", "frame_rate_error"]

    length = calibrate("scale_error", [read_reference("22.6,21.945", "scale_error")])
    clock = calibrate("frame_rate_error", [read_reference("24,20", "frame_rate_error")])
    found = discover(tracks, references=[length, clock])
    report = document(found)
    assert [e["name"] for e in report["effects"]] == ["scale_error", "frame_rate_error"]
    assert report["undecidable"]["names"] == []
    assert abs(report["effects"][1]["parameters"]["factor"]["value"] - 1.2) < 0.02
    assert abs(report["baseline"]["mu"] / 0.009 - 1) < 0.02
    # On its own output the tracks are corrected again, and nothing more is found.
    ice = found.improved_ice()
    assert {c.name for c in calibrations_of(ice)} == {"scale_error", "frame_rate_error"}
    again = document(discover(tracks, ice))
    assert again["effects"] == []
    assert abs(again["baseline"]["mu"] / 0.009 - 1) < 0.02


def test_a_reference_that_agrees_names_nothing(make_session):
    right = calibrate("scale_error", [read_reference("21.95,21.945", "scale_error")])
    assert not right.clearly_off
    report = document(discover(make_session(fps=8), references=[right]))
    assert report["effects"] == []
    assert report["undecidable"]["names"] == ["frame_rate_error"]


@pytest.mark.parametrize(
    "text", ["21.9", "a,b", "21.9,-3", "1,2,3,4", "21.9,nan", "2,21.945"], ids=repr
)
def test_a_reference_that_cannot_be_is_refused(text):
    with pytest.raises(InputError, match="--known-length"):
        read_reference(text, "scale_error")


def test_references_that_contradict_one_another():
    both = [read_reference(text, "frame_rate_error") for text in ("20,20", "24,20")]
    with pytest.raises(InputError, match="contradict"):
        calibrate("frame_rate_error", both)


def test_corrected_tracks_have_true_lengths_and_times(make_session):
    (track, *_) = make_session([effect("slope", x=1e-4, y=0.0)], throws=2)
    wrong = replace(track, xy=0.97 * track.xy, t=0.9 * track.t)
    known = [
        calibrate("scale_error", [read_reference("0.97,1,0.001", "scale_error")]),
        calibrate("frame_rate_error", [read_reference("9,10,0.01", "frame_rate_error")]),
    ]
    (right,) = corrected([wrong], known)
    assert np.allclose(right.xy, track.xy)
    assert np.allclose(right.t, track.t)


def test_references_count_by_their_precision():
    """The weighted mean of two factors: 1.02 to 1 %, and 1.05 to 2 %."""
    first, second = (read_reference(text, "scale_error") for text in ("20.4,20,0.2", "10.5,10,0.2"))
    found = calibrate("scale_error", [first, second])
    assert found.factor == pytest.approx((1.02 / 0.01**2 + 1.05 / 0.02**2) / (1e4 + 2500.0))
    assert found.stderr == pytest.approx(1.0 / np.sqrt(1e4 + 2500.0))
    assert found.references == (first, second)
    ice = Ice.uniform(0.009, effects=(found.as_effect(), effect("frame_rate_error", factor=1.1)))
    scale, rate = calibrations_of(ice)
    assert (scale.name, scale.factor, scale.stderr) == ("scale_error", found.factor, found.stderr)
    assert scale.references == ()
    assert (rate.factor, rate.stderr) == (1.1, 0.0)
    assert calibrations_of(None) == ()


@pytest.mark.parametrize(("apart", "contradict"), [(7.9, False), (8.1, True)])
def test_references_contradict_beyond_four_standard_errors(apart, contradict):
    """Of each, from the mean of both, which lies in the middle."""
    texts = ("20,20,0.2", f"{20 + 0.2 * apart},20,0.2")
    both = [read_reference(text, "scale_error") for text in texts]
    if contradict:
        with pytest.raises(
            InputError, match=r"is a factor of 1\.\d{3}, all together give 1\.\d{3}"
        ):
            calibrate("scale_error", both)
    else:
        assert calibrate("scale_error", both).factor == pytest.approx(1.0 + 0.005 * apart)


@pytest.mark.parametrize(("text", "fits"), [("10.1,20", True), ("9.9,20", False),
                                            ("39.9,20", True), ("40.1,20", False)])  # fmt: skip
def test_a_measured_value_lies_within_a_factor_of_two_of_the_true_one(text, fits):
    if fits:
        read = read_reference(text, "scale_error")
        assert f"{read.measured:g},{read.true:g}" == text
        assert read_reference(text + ",0.7", "scale_error").error == 0.7
    else:
        with pytest.raises(InputError, match="within a factor of two"):
            read_reference(text, "scale_error")
