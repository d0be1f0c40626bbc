"""The paper's experiment, and its own numbers."""

from __future__ import annotations

import pytest
from measures.pitches import NOISE, errors_of_table, pitch

from curling_env.sheet import HOG_LINE_Y


def test_a_pitch_is_seen_from_hog_line_to_hog_line(rng):
    track = pitch(0.0019, rng)
    assert track.xy[0, 1] == pytest.approx(-HOG_LINE_Y, abs=5 * NOISE)
    assert track.xy[-1, 1] == pytest.approx(HOG_LINE_Y, abs=5 * NOISE)
    assert len(track) == pytest.approx(30 * 15.0, rel=0.02)


def test_the_repeated_table_beats_the_papers_way_and_the_paper(rng):
    joint, averaged = errors_of_table(1, rng)
    assert joint.mean() < 0.3
    assert joint.mean() < 0.5 * averaged.mean()
    assert joint.mean() < 0.631
