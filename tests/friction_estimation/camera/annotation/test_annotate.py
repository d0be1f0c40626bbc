"""Clicked keypoints: the camera they give, and the page on which they are clicked."""

from __future__ import annotations

import json
import urllib.error
import urllib.request
from contextlib import contextmanager
from dataclasses import replace

import cv2
import numpy as np
import pytest

from curling_env.errors import InputError, OutputError
from curling_env.sheet import PAPER_SHEET, WORLD_CURLING_SHEET
from friction_estimation import load_scene
from friction_estimation.camera import (
    CORNERS,
    Annotation,
    AnnotationServer,
    keypoints_of,
    save_scene,
)
from friction_estimation.camera.annotation import server as server_module
from friction_estimation.camera.annotation.thrower import thrower, thrower_px
from friction_estimation.synthetic import FilmRenderer, FilmSpec, named_camera, scene_of


@pytest.fixture(scope="module")
def seen(tmp_path_factory):
    """A picture of an empty sheet before the end camera, that camera, and its exact scene."""
    renderer = FilmRenderer(FilmSpec(camera="end", people=False, size=(1280, 720)))
    path = tmp_path_factory.mktemp("seen") / "end.png"
    cv2.imwrite(str(path), np.asarray(renderer.still, dtype=np.uint8))
    return path, renderer.camera, scene_of(renderer.camera)


def clicks_at(camera, names):
    keypoints = keypoints_of(PAPER_SHEET)
    points = np.array([[*keypoints[name], 0.0] for name in names])
    return {n: tuple(px) for n, px in zip(names, camera.project(points).tolist(), strict=True)}


READY = "still.complete && still.naturalWidth > 0 && film"


@contextmanager
def served(annotation, page, save=lambda made: None):
    """The page, served and ready; what it still asks for at the end is called off."""
    with AnnotationServer(annotation, save) as server:
        page.goto(server.url)
        page.wait_for_function(READY)
        yield server
        page.goto("about:blank")


@pytest.fixture
def annotation(seen):
    path, camera, _ = seen
    known = {"camera_matrix": camera.lens.matrix, "distortion": camera.lens.distortion}
    return Annotation.open(path, PAPER_SHEET, known)


def test_four_corners_become_corners_and_other_keypoints_points(annotation, seen):
    _, camera, scene = seen
    corners = annotation.scene(clicks_at(camera, CORNERS))
    assert corners.has_corners
    assert np.allclose(corners.points_px, scene.points_px, atol=1e-6)
    names = ["home_tee", "home_hog_left", "home_hog_right", "away_tee", "home_left"]
    others = annotation.scene(clicks_at(camera, names))
    assert not others.has_corners
    assert len(others.points_px) == 5


def test_lines_are_drawn_back_where_the_camera_sees_them(annotation, seen):
    _, camera, _ = seen
    found = annotation.solve(clicks_at(camera, CORNERS))
    assert found.misfit_px < 0.01
    drawn = np.concatenate([np.array(line) for line in annotation.lines_px(found.camera)])
    back = camera.on_plane(drawn)
    assert len(drawn) > 500
    border = np.abs(np.abs(back[:, 0]) - PAPER_SHEET.width / 2) < 0.01
    assert np.count_nonzero(border) > 100
    assert PAPER_SHEET.contains(back * 0.999).all()


def test_from_above_the_houses_lie_where_they_belong(annotation, seen):
    _, camera, _ = seen
    view = annotation.top_view(annotation.solve(clicks_at(camera, CORNERS)).camera).astype(int)
    rows, columns = view.shape[:2]
    assert columns > 9 * rows
    # The twelve-foot ring is blue: at the home tee, half way between its radii.
    column = round((PAPER_SHEET.length / 2 - 17.3735) * columns / PAPER_SHEET.length)
    row = round(rows / 2 + 1.5 * rows / PAPER_SHEET.width)
    blue, _, red = view[row, column]
    assert blue > red + 40


def test_the_paint_shows_how_far_clicks_are_off(annotation, seen):
    _, camera, _ = seen
    clicks = clicks_at(camera, CORNERS)
    off = {name: (u + 3, v - 2) for name, (u, v) in clicks.items()}
    exact, wrong = annotation.solve(clicks, paint=True), annotation.solve(off, paint=True)
    assert exact.paint_px is not None
    assert exact.paint_px < 0.5
    assert exact.misfit_px < 0.5
    assert wrong.misfit_px == pytest.approx(np.hypot(3, 2), abs=0.7)


def test_a_camera_is_questioned_where_the_picture_contradicts_it(tmp_path):
    renderer = FilmRenderer(FilmSpec(camera="gantry", people=False, size=(960, 540)))
    path, camera = tmp_path / "gantry.png", renderer.camera
    cv2.imwrite(str(path), np.asarray(renderer.still, dtype=np.uint8))
    clicks = clicks_at(camera, CORNERS)
    right = Annotation.open(path, PAPER_SHEET).solve(clicks, paint=True)
    assert (right.problems, right.better) == ((), None)
    # Ice of the wrong size: the rings lie elsewhere, and say which size it is.
    wrong = Annotation.open(path, WORLD_CURLING_SHEET).solve(clicks, paint=True)
    assert wrong.better == PAPER_SHEET
    # A corner that the paint corrects is named all the same.
    u, v = clicks["home_left"]
    off = Annotation.open(path, PAPER_SHEET).solve({**clicks, "home_left": (u + 19, v)}, paint=True)
    assert any("home left" in one for one in (*off.problems, *off.disagreeing))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda m: {k: m[k] for k in list(m)[:3]}, "click 1 more"),
        (lambda m: {**m, "moon": (1, 1)}, "unknown keypoint 'moon'; expected one of "),
        (lambda m: {**m, "home_left": m["home_right"], "home_right": m["home_left"]}, "cross"),
        (lambda m: {**m, "home_left": (-40.0, 700.0)}, "outside the image"),
    ],
)
def test_clicks_that_mean_nothing_are_refused(annotation, seen, change, words):
    with pytest.raises(InputError, match=words):
        annotation.solve(change(clicks_at(seen[1], CORNERS)))


def test_clicking_continues_from_a_scene(seen, tmp_path):
    path, camera, scene = seen
    save_scene(
        replace(scene, stone_height=0.12, fps=25.0, paint_depth=0.006), tmp_path / "scene.json"
    )
    again = Annotation.from_scene(path, load_scene(tmp_path / "scene.json"))
    assert set(again.clicks) == set(CORNERS)
    kept = again.scene(again.clicks)
    assert np.allclose(kept.points_px, scene.points_px)
    assert (kept.stone_height, kept.fps, kept.paint_depth) == (0.12, 25.0, 0.006)
    assert kept.camera_matrix is not None
    assert np.allclose(kept.camera_matrix, camera.lens.matrix)


def test_clicking_does_not_continue_from_a_point_without_a_name(seen):
    path, _, scene = seen
    moved = replace(scene, sheet_points=scene.sheet_points + np.array([0.1, 0.0]))
    with pytest.raises(InputError, match="expected a corner or a crossing of lines"):
        Annotation.from_scene(path, moved)


def test_only_requests_with_the_secret_are_answered(annotation):
    with AnnotationServer(annotation, lambda scene: None) as server:
        root = server.url.rsplit("/", 2)[0]
        for wrong in (root + "/", root + "/guess/film.json", root + "/guess/save"):
            with pytest.raises(urllib.error.HTTPError) as refused:
                urllib.request.urlopen(wrong, timeout=120)
            assert refused.value.code == 404
        with urllib.request.urlopen(server.url + "film.json", timeout=120) as answer:
            assert json.loads(answer.read())["size"] == [1280, 720]
        with pytest.raises(OutputError, match="cannot be used"):
            AnnotationServer(annotation, lambda scene: None, port=int(root.rsplit(":", 1)[1]))


def test_the_page_makes_a_scene(annotation, seen, page, tmp_path):
    _, camera, scene = seen
    output = tmp_path / "scene.json"

    def click(name):
        u, v = clicks_at(camera, [name])[name]
        x, y = page.evaluate(
            """([u, v]) => { const box = picture.getBoundingClientRect(), [x, y] = toScreen([u, v]);
               return [box.left + x * box.width / picture.width,
                       box.top + y * box.height / picture.height]; }""",
            [u, v],
        )
        page.mouse.click(x, y)

    with served(annotation, page, lambda made: save_scene(made, output)) as server:
        assert page.is_disabled("#save")
        assert "the thrower's end" in page.inner_text("#task")
        for name in CORNERS[:3]:
            assert name.replace("_", " ") in page.inner_text("#task")
            click(name)
        page.wait_for_function("document.querySelector('#state').textContent.includes('1 more')")
        assert page.is_disabled("#save")
        click(CORNERS[3])
        page.wait_for_selector("#save:enabled")
        assert page.evaluate("lines.length") > 10
        assert page.evaluate("view !== null")
        # The selected click moves by a quarter of a pixel, and can be removed and made again.
        before = page.evaluate("clicks.away_left.slice()")
        page.press("#picture", "ArrowRight")
        assert page.evaluate("clicks.away_left[0]") == pytest.approx(before[0] + 0.25)
        page.press("#picture", "ArrowLeft")
        page.press("#picture", "Delete")
        page.wait_for_selector("#save:disabled")
        click("away_left")
        page.wait_for_selector("#save:enabled")
        page.click("#save")
        assert server.wait(10) is not None
        page.wait_for_function("document.querySelector('#state').textContent.startsWith('Saved')")
    made = load_scene(output)
    assert made.has_corners
    # A click hits a pixel of the screen, which here is about one of the picture.
    assert np.abs(made.points_px - scene.points_px).max() < 1.0


def test_marks_with_a_problem_are_not_confirmed_in_green(annotation, seen, page):
    clicks = clicks_at(seen[1], CORNERS)
    problems = ["The home left is 25 px from where the paint puts it: move it onto the paint."]
    found = {}

    def answer(route):
        """The camera of the clicks, and a check against the paint that takes no time."""
        if json.loads(route.request.post_data)["paint"]:
            paint = {"paint_px": 0.9, "disagreeing": [], "better": None, "problems": problems}
            route.fulfill(json=found | paint)
        else:
            reply = route.fetch()
            found.update(reply.json())
            route.fulfill(response=reply)

    with served(annotation, page):
        page.route("**/solve", answer)
        page.evaluate("clicks => { Object.values(clicks).forEach(addClick); }", clicks)
        page.wait_for_selector("#state.error")
        assert page.inner_text("#state") == problems.pop()
        page.evaluate("() => solve(true)")
        page.wait_for_selector("#state.good, #state.warning")
        assert "Every ring and line in view is where it should be" in page.inner_text("#state")


def test_a_keypoint_is_selected_on_the_small_sheet(annotation, seen, page):
    with served(annotation, page):
        page.click("circle[data-keypoint=home_tee]")
        assert "home tee" in page.inner_text("#task")
        page.focus("circle[data-keypoint=away_hog_left]")
        page.keyboard.press("Enter")
        assert "away hog left" in page.inner_text("#task")


def test_save_and_state_are_in_sight_on_a_small_laptop(annotation, page):
    page.set_viewport_size({"width": 1366, "height": 768})
    with served(annotation, page):
        for part in ("#save", "#state", "#task", "#picture", "#keypoints", "#above"):
            box = page.locator(part).bounding_box()
            assert box["y"] >= 0
            assert box["y"] + box["height"] <= 768, part
        assert page.locator("#picture").bounding_box()["height"] > 400


def test_other_places_are_proposed_where_corners_are_hidden(annotation, seen, page):
    _, camera, _ = seen
    with served(annotation, page):
        asked = []
        for _ in range(2):  # boards hide both corners of the far end
            page.evaluate("selected = CORNERS.slice(2).find(name => !away.has(name))")
            page.click("#hidden")
        for _ in range(4):
            name = page.evaluate("selected")
            asked.append(name)
            page.evaluate("px => addClick(px)", list(clicks_at(camera, [name])[name]))
        assert asked[:2] == ["home_left", "home_right"]
        assert all(name.startswith("away_") for name in asked[2:])
        assert not set(asked[2:]) & set(CORNERS)
        page.wait_for_selector("#save:enabled")
        page.evaluate("draw()")
        assert page.locator("circle.hidden").count() == 2


def test_steps_can_be_taken_back_and_ends_swapped(annotation, seen, page):
    _, camera, _ = seen
    corners = ["home_left", "home_right", "away_right", "away_left"]
    with served(annotation, page):
        assert page.is_disabled("#undo")
        for name in corners:
            page.evaluate("px => addClick(px)", list(clicks_at(camera, [name])[name]))
        page.wait_for_selector("#save:enabled")
        thrower = page.evaluate("thrower[5][0]")
        before = page.evaluate("JSON.stringify(clicks)")
        page.focus("#picture")
        for _ in range(3):
            page.keyboard.press("ArrowRight")
        page.keyboard.press("Control+z")  # moves that follow each other are one step
        assert page.evaluate("JSON.stringify(clicks)") == before
        page.click("#swap")
        page.wait_for_function("thrower.length > 0")
        assert page.evaluate("clicks.away_right") == json.loads(before)["home_left"]
        assert np.hypot(*np.subtract(page.evaluate("thrower[5][0]"), thrower)) > 100
        page.click("#undo")
        page.click("#undo")
        assert page.evaluate("Object.keys(clicks)") == corners[:3]
        page.wait_for_function("document.querySelector('#state').textContent.includes('1 more')")


def test_an_answer_to_clicks_that_have_changed_since_is_left_aside(annotation, seen, page):
    clicks = clicks_at(seen[1], CORNERS)
    held = []
    with served(annotation, page):
        page.route("**/solve", lambda route: held.append(route))
        with page.expect_request("**/solve"):
            page.evaluate("clicks => { Object.values(clicks).forEach(addClick); }", clicks)
        page.evaluate("() => { swapEnds(); clearTimeout(waiting); }")
        with page.expect_response("**/solve"):
            held.pop().continue_()
        page.evaluate("() => new Promise(done => setTimeout(done, 50))")
        assert page.is_disabled("#save")
        assert page.evaluate("thrower") == []
        page.unroute("**/solve")
        page.evaluate("() => solve()")
        assert page.is_enabled("#save")


def test_two_fingers_zoom_about_the_place_between_them(annotation, browser):
    context = browser.new_context(
        has_touch=True, viewport={"width": 820, "height": 1180}, bypass_csp=True
    )
    page = context.new_page()
    with served(annotation, page):
        box = page.locator("#picture").bounding_box()
        x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        fingers = context.new_cdp_session(page)

        def touch(kind, apart):
            points = [{"x": x - apart, "y": y, "id": 1}, {"x": x + apart, "y": y, "id": 2}]
            fingers.send(
                "Input.dispatchTouchEvent",
                {"type": kind, "touchPoints": points if kind != "touchEnd" else []},
            )

        middle = "toPixel(picture.width / 2, picture.height / 2)"
        before, at = page.evaluate("zoom"), page.evaluate(middle)
        touch("touchStart", 50)
        for apart in (70, 90, 100):
            touch("touchMove", apart)
        touch("touchEnd", 100)
        assert page.evaluate("zoom") / before == pytest.approx(2.0, rel=0.05)
        assert page.evaluate(middle) == pytest.approx(at, abs=2)
        assert page.evaluate("Object.keys(clicks).length") == 0
        page.touchscreen.tap(x, y)
        assert page.evaluate("Object.keys(clicks)") == ["home_left"]
    context.close()


def test_a_height_that_is_not_seen_from_above_is_shown_as_a_range(seen):
    """The truth is in it; where a slant view shows the height, the range is narrow."""
    for name, wide in (("gantry", True), ("end", False)):
        camera = named_camera(name, (1280, 720))
        blank = np.zeros((720, 1280, 3), dtype=np.uint8)
        annotation = Annotation(name=name, stills=[blank], sheet=PAPER_SHEET)
        low, high = annotation.solve(clicks_at(camera, CORNERS)).height_range
        assert low < camera.position[2] < high
        assert (high / low > 1.5) == wide
    path, camera, _ = seen
    painted = Annotation.open(path, PAPER_SHEET)
    low, high = painted.solve(clicks_at(camera, CORNERS), paint=True).height_range
    assert low < camera.position[2] < high < 1.1 * low


def test_the_thrower_stands_at_the_home_end(annotation, seen):
    _, camera, _ = seen
    assert all((shape[:, 1] < -11).all() for shape in thrower())
    shapes = thrower_px(camera)
    assert len(shapes) == len(thrower())
    back = camera.on_plane(np.concatenate(shapes))
    assert PAPER_SHEET.contains(back).all()


def test_a_shared_page_is_found_under_the_machines_own_address(annotation, monkeypatch):
    monkeypatch.setattr(server_module, "network_address", lambda: "127.0.0.2")
    with AnnotationServer(annotation, lambda made: None, share=True) as server:
        assert server.url.startswith("http://127.0.0.2:")
        with urllib.request.urlopen(server.url + "film.json", timeout=120) as answer:
            assert json.loads(answer.read())["size"] == [1280, 720]
        strange = urllib.request.Request(server.url + "film.json", headers={"Host": "evil.test"})
        with pytest.raises(urllib.error.HTTPError) as refused:
            urllib.request.urlopen(strange, timeout=120)
        assert refused.value.code == 403


def test_without_a_network_nothing_is_shared(annotation, monkeypatch):
    def unreachable(*_):
        raise OSError("unreachable")

    monkeypatch.setattr("socket.socket.connect", unreachable)
    with pytest.raises(OutputError, match="in no network"):
        AnnotationServer(annotation, lambda made: None, share=True)


def test_the_command_says_what_is_wrong(curling, tmp_path):
    assert "no such film" in curling("corners", tmp_path / "none.mp4").complaint
    (tmp_path / "bad.png").write_text("not a picture")
    assert "expected a picture" in curling("corners", tmp_path / "bad.png").complaint
    assert "44.5x4.5" in curling("corners", tmp_path / "bad.png", "--sheet", "wide").complaint
