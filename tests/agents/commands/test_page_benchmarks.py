"""Timing of the page's answers, each once and valid."""

from __future__ import annotations

from agents.commands import page_benchmarks


def test_every_answer_of_the_page_is_timed(monkeypatch):
    monkeypatch.setattr(page_benchmarks, "TIMES", 1)
    found = {measure.name: measure for measure in page_benchmarks.page_measures()}
    assert set(found) >= {"page_throw_path_ms", "page_planned_target_s", "page_best_call_s"}
    assert all(0 < measure.value < 1000 for measure in found.values())
