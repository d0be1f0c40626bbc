"""Which pictures of a stone are learnt from, where somebody is near it."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from curling_env.errors import InputError, NoThrowError
from friction_estimation.tracking import pipeline


class Stone:
    """A stone whose pictures leave a share unexplained; None: it is nowhere wholly in the image."""

    def __init__(self, left, by_look=None):
        self.left, self.by_look = left, by_look
        self.model, self.background = None, SimpleNamespace(noise=0.0, grain=0.0)
        self.path, self.pictures = SimpleNamespace(measured=False), ()

    def crops(self, camera):
        return [] if self.left is None else [self.left]


@pytest.fixture
def learn(monkeypatch):
    """Learns a stone; gives the shares of those whose looks were learnt, and of the chosen one."""
    tried = []

    def learn_appearance(crops, model, noise):
        tried.append(crops[0])
        return SimpleNamespace(has_handle=False)

    monkeypatch.setattr(pipeline, "learn_appearance", learn_appearance)
    monkeypatch.setattr(pipeline, "those_explained", lambda crops, look: crops)
    monkeypatch.setattr(pipeline, "unexplained_share", lambda crops, look, grain: crops[0])
    monkeypatch.setattr(pipeline, "find_scene_context", lambda *_: None)
    film = SimpleNamespace(path="film.mp4", sample=[], sample_until=None)
    scene = SimpleNamespace(sheet=None)

    def learnt(stone):
        tried.clear()
        chosen = pipeline._learn(film, scene, None, stone).stone.left  # pyright: ignore[reportArgumentType, reportAttributeAccessIssue, reportPrivateUsage]
        return list(tried), chosen

    return learnt


def test_a_stone_that_is_shown_well_is_learnt_as_it_was_found(learn):
    assert learn(Stone(0.06, by_look=Stone(0.02))) == ([0.06], 0.06)


def test_where_a_broom_is_in_its_pictures_the_clearest_are_learnt_from(learn):
    assert learn(Stone(0.27, by_look=Stone(0.06))) == ([0.27, 0.06], 0.06)
    assert learn(Stone(None, by_look=Stone(0.06))) == ([0.06], 0.06)


@pytest.mark.parametrize("by_look", [Stone(0.3), Stone(None)])
def test_clearest_pictures_that_show_less_count_for_nothing(learn, by_look):
    assert learn(Stone(0.15, by_look=by_look))[1] == 0.15


def test_what_no_picture_shows_as_a_stone_is_refused(learn):
    with pytest.raises(NoThrowError, match="does not look like a stone"):
        learn(Stone(0.27, by_look=Stone(0.3)))
    with pytest.raises(InputError, match="nowhere wholly in the image"):
        learn(Stone(None, by_look=Stone(None)))
