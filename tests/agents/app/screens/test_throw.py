"""The screen Plan as a browser asks it."""

from __future__ import annotations

from dataclasses import replace

import pytest

from curling_env.ice import load_ice, save_ice
from curling_env.sheet import TEE_Y

DRAW = {"speed": 2.1, "angle": 0.035, "spin": -1.5}
TARGET = {"x": 0.0, "y": TEE_Y}


def test_the_ices_of_the_sessions_can_be_chosen(visitor, club):
    ice = load_ice("standard")
    first = club.add_session("Tuesday <i>", "2026-11-17", "sheet 1", None)
    second = club.add_session("Friday", "2026-11-20", "sheet 1", None)
    save_ice(ice, club.ice_of(first))
    slow = replace(ice, friction=replace(ice.friction, mu=1.2 * ice.friction.mu))
    save_ice(slow, club.ice_of(second))
    text = visitor.get(f"throw/{first.id}").text
    assert text.index("Tuesday &lt;i&gt;") < text.index('<option value="2">')
    rests = [
        visitor.send("throw/run", {"ice": str(key), "throw": DRAW}).document["rest"]["y"]
        for key in (first.id, second.id, "standard")
    ]
    assert rests[0] == rests[2]
    assert rests[1] < rests[0] - 2


def test_every_way_of_asking_answers(visitor):
    stones = [{"x": 0.3, "y": 17.0, "team": "away"}]
    asked = {
        "run": {"throw": DRAW},
        "plan": {"target": TARGET, "skill": "elite"},
        "calls": {"position": {"stones": stones, "delivered": 14, "hammer": "home"}},
        "game": {"seed": 2, "ends": 1},
        "advice": {"position": {"stones": stones, "delivered": 13, "hammer": "home"}},
    }
    for name, wish in asked.items():
        answer = visitor.send(f"throw/{name}", {"ice": "standard", **wish})
        assert answer.status == 200, (name, answer.text)
        assert isinstance(answer.document, dict)


@pytest.mark.parametrize(
    ("name", "wish", "problem"),
    [
        ("run", {"ice": "../../etc/passwd", "throw": DRAW}, "unknown ice"),
        ("run", {"ice": "77", "throw": DRAW}, "unknown ice"),
        ("run", {"ice": "standard"}, "the request: missing throw"),
        ("plan", {"ice": "standard", "target": TARGET, "skill": "wizard"}, "unknown athlete"),
        ("plan", {"ice": "standard", "target": {"x": 9, "y": 17}}, "off the ice"),
        ("calls", {"ice": "standard", "position": {"delivered": 99}}, "position.delivered"),
    ],
)
def test_what_is_wrong_is_one_sentence(visitor, name, wish, problem):
    answer = visitor.send(f"throw/{name}", wish)
    assert answer.status == 422
    assert problem in answer.document["problem"]
    assert "\n" not in answer.document["problem"]


def test_without_the_token_nothing_is_answered(visitor):
    answer = visitor.ask("POST", "throw/run", b"{}", {"content-type": "application/json"})
    assert answer.status == 403


def test_a_left_hander_has_other_handles(visitor, club):
    with club.database.writing() as connection:
        connection.execute("insert into athlete (name, hand) values ('Lefty', 'left')")
    assert '<option value="athlete:1" data-hand="left">Lefty</option>' in visitor.get("throw").text
    asked = {"ice": "standard", "target": TARGET, "skill": "athlete:1"}
    answer = visitor.send("throw/plan", asked)
    assert answer.status == 422
    assert "too few throws of Lefty" in answer.document["problem"]


def test_a_target_is_kept_and_called_by_its_name(visitor, club):
    kept = {"name": "pocket", "place": {"x": 0.6, "y": 16.97}}
    (result,) = visitor.send("throw/targets", kept).document["targets"]
    assert (result["name"], result["x"], result["y"]) == ("pocket", 0.6, 16.97)
    assert '"pocket"' in visitor.get("throw").text
    assert visitor.send("throw/targets", kept | {"name": "button"}).status == 422
    answer = visitor.send(f"throw/targets/{result['id']}/forget", {})
    assert answer.document["targets"] == []
