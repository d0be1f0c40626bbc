"""The paper's experiment, and its own numbers."""

from __future__ import annotations

import numpy as np
import pytest
from paper.tables import (
    MEASURED_BY_PAPER,
    NOISE,
    THEORETICAL,
    as_text,
    draw_figure,
    pitch,
    repeat_table,
    save_table,
)

from curling_env.sheet import HOG_LINE_Y


@pytest.mark.parametrize(("pitches", "mean"), [(1, 0.631), (5, 0.349)])
def test_the_papers_rows_give_the_papers_means(pitches, mean):
    errors = 100 * np.abs(MEASURED_BY_PAPER[pitches] - THEORETICAL) / THEORETICAL
    assert np.nanmean(errors) == pytest.approx(mean, abs=5e-4)


def test_a_pitch_is_seen_from_hog_line_to_hog_line(rng):
    track = pitch(0.0019, rng)
    assert track.xy[0, 1] == pytest.approx(-HOG_LINE_Y, abs=5 * NOISE)
    assert track.xy[-1, 1] == pytest.approx(HOG_LINE_Y, abs=5 * NOISE)
    assert len(track) == pytest.approx(30 * 15.0, rel=0.02)


def test_the_repeated_table_beats_the_papers_way_and_the_paper(rng, tmp_path):
    table = repeat_table(1, rng)
    joint = table.error_percent(table.joint).mean()
    assert joint < 0.3
    assert joint < 0.5 * table.error_percent(table.averaged).mean()
    assert joint < np.nanmean(table.error_percent(table.paper))
    text = as_text(table)
    assert "0.631 %" in text
    assert text.count("\n") == 14
    save_table(table, tmp_path / "table3.csv")
    draw_figure(table, tmp_path / "figure9.png")
    assert len((tmp_path / "table3.csv").read_text().splitlines()) == 11
    assert (tmp_path / "figure9.png").stat().st_size > 10_000
