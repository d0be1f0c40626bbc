"""The numbers of an estimate's page, from hand-made estimates."""

from __future__ import annotations

import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from curling_env.ice import ActiveEffect, Ice
from curling_env.trajectory import Trajectory
from curling_env.units import Units
from friction_estimation.discovery.model.noise import CoordinateNoise
from friction_estimation.reports import estimate_page as module
from friction_estimation.reports import headline
from friction_estimation.reports.draw_weight import DrawWeight, draw_facts
from friction_estimation.tracks.free_slide import FreeSlide

MU = 0.009
EVEN = Ice.uniform(MU)
SHAPE = EVEN.friction.mu.shape


def estimate(mu: float = MU, *, cells=None, observed=None, effects=(), **other):
    friction = replace(
        EVEN.friction,
        mu=np.full(SHAPE, MU) if cells is None else cells,
        observed=np.ones(SHAPE, dtype=bool) if observed is None else observed,
    )
    given = {
        "ice": replace(EVEN, friction=friction, effects=tuple(effects)),
        "mu": mu,
        "sigma": 0.0001,
        "interval": (0.0088, 0.0093),
        "uniform": False,
        "throws": 3,
        "resolution": None,
        "noise": None,
        "camera_bias": None,
        "remarks": [],
        "skipped": (),
    }
    return SimpleNamespace(**given | other)


def cells_of(page: str) -> list[list[str]]:
    rows = re.findall(r"<tr>(.*?)</tr>", page)
    return [re.findall(r"<t[hd][^>]*>(.*?)</t[hd]>", row) for row in rows]


@pytest.mark.parametrize(
    ("mu", "words"),
    [
        (0.00399, "keener than any curling ice"),
        (0.004, "keen"),
        (0.00749, "keen"),
        (0.0075, "of usual speed"),
        (0.0095, "of usual speed"),
        (0.00951, "heavy"),
        (0.03, "heavy"),
        (0.0301, "heavier than any curling ice"),
    ],
)
def test_limits_of_the_words_for_a_level(mu, words):
    assert module._speed_in_words(mu) == words


def test_a_headline_spans_all_but_four_per_cent_of_the_crossed_cells():
    cells = MU * np.linspace(0.9, 1.1, np.prod(SHAPE)).reshape(SHAPE)
    assert headline(estimate(cells=cells)) == (
        "This ice is of usual speed: μ = 0.00900, and −9.6 % to +9.6 % of that in 96 % of the "
        "cells that stones crossed."
    )
    seen = np.zeros(SHAPE, dtype=bool)
    seen[:2] = True
    few = np.where(seen, 1.05 * MU, 5 * MU)
    assert "and +5.0 % to +5.0 % of that" in headline(estimate(cells=few, observed=seen))
    for none in (estimate(uniform=True), estimate(observed=np.zeros(SHAPE, dtype=bool))):
        assert headline(none) == "This ice is of usual speed: μ = 0.00900."


def test_a_friction_that_may_be_keen_or_heavy_is_called_hardly_known():
    assert headline(estimate(interval=(0.0061, 0.0133))) == (
        "The friction of this ice is hardly known: μ is 0.0061 to 0.0133 with 95 % probability; "
        "more throws, or longer ones, would narrow that."
    )
    assert "μ is 0.0000 to" in headline(estimate(interval=(-0.001, 0.0133)))
    for other in ((0.0076, 0.0133), (0.0061, 0.0094), (np.nan, np.nan)):
        assert headline(estimate(interval=other)).startswith("This ice is of usual speed: ")


def test_a_measured_power_of_the_speed_is_in_the_headline():
    power = ActiveEffect(
        name="speed_dependent_friction", parameters={"exponent": 0.34}, sigma={"exponent": 0.051}
    )
    words = headline(estimate(effects=[power], uniform=True))
    assert words.endswith(
        "μ = 0.00900 ± 0.00010 at 1 m/s, and friction goes with the speed as v^(−0.34 ± 0.05)."
    )
    for assumed in (replace(power, believed=("exponent",)), replace(power, sigma={})):
        assert headline(estimate(effects=[assumed], uniform=True)).endswith("= 0.00900.")


def test_facts_are_in_per_cent_and_millimetres():
    bias = SimpleNamespace(found=True, size=0.0047, words="camera bias")
    found = estimate(
        interval=(0.0054, 0.0126),
        resolution=1.5,
        noise=CoordinateNoise(white=0.003, slow=0.004),
        camera_bias=bias,
    )
    facts = module._facts(found, Units.METRES)
    assert facts[0] == ("0.00900", "friction μ, known to ± 40 %")
    assert facts[1:-4] == draw_facts(found.ice, MU)
    assert facts[-4:] == [
        ("3", "throws measured"),
        ("1.50 m", "finest resolved detail"),
        ("5.0 mm", "noise of a measured position"),
        ("4.7 mm", "bias of the camera, corrected"),
    ]
    lost = estimate(sigma=np.nan, camera_bias=SimpleNamespace(found=False))
    facts = module._facts(lost, Units.FEET)
    assert facts[0][1] == "friction μ, its error is unknown (lost to rounding)"
    assert facts[-1] == ("3", "throws measured")


def test_remarks_list_what_was_not_found_and_who_was_excluded():
    bias = SimpleNamespace(found=False, words="no camera bias found")
    page = module._remarks(
        estimate(camera_bias=bias, remarks=["<R>."], skipped=("throw 1", "throw <2>"))
    )
    assert "No camera bias found." in page
    assert "&lt;R&gt;." in page
    assert re.findall(r"<li>(.*?)</li>", page) == ["throw 1", "throw &lt;2&gt;"]
    found = SimpleNamespace(found=True, words="camera bias of 4 mm")
    assert module._remarks(estimate(camera_bias=found)) == ""


def test_effects_are_listed_with_what_was_measured_and_what_assumed():
    curl = ActiveEffect(
        name="curl",
        parameters={"strength": 0.00654321, "speed_exponent": 0.2},
        sigma={"strength": 0.000234, "speed_exponent": 0.05},
        believed=("speed_exponent",),
    )
    zero = ActiveEffect(name="slope", parameters={"x": 1e-9}, sigma={"x": 0.001})
    head, first, second, third = cells_of(module._effects(estimate(effects=[curl, zero])))
    assert head[2:4] == ["value", "standard error"]
    assert first[1:] == ["strength", "0.006543 m/s²", "0.00023", "measured"]
    assert first[0] == module.catalogue()["curl"].title
    assert second == ["", "speed exponent", "0.2", "0.05", "assumed"]
    assert third[2].split()[0] == "0"
    known = replace(curl, sigma={}, believed=())
    assert "unchanged" in module._effects(estimate(effects=[known]))


def test_both_methods_stand_side_by_side():
    cells = MU * np.where(np.arange(np.prod(SHAPE)) % 2, 1.03, 0.97).reshape(SHAPE)
    even = estimate()
    plain = estimate(0.0091, cells=cells, interval=(0.0085, 0.0097))
    _, first, second = cells_of(module._beside(even, plain))
    assert first[1:] == ["0.00900", "0.00880 to 0.00930", "0.0 %"]
    spread = 0.03 * MU / 0.0091
    assert second[1:] == ["0.00910", "0.00850 to 0.00970", f"{100 * spread:.1f} %"]
    page = module._beside(estimate(uniform=True), plain)
    assert [row[3] for row in cells_of(page)[1:]] == ["", ""]
    assert "noise of its" in module._beside(even, plain)
    assert "noise of its" not in page


def test_each_throw_has_its_own_friction_and_what_is_left_over():
    each = [
        {"throw": 3, "speed": 2.128, "seconds": 21.26, "rests": True, "wild_rows": 2}
        | {"mu_factor": 1.0123, "rms_m": 0.00416},
        {"throw": 4, "seconds": 5.0, "rests": False, "wild_rows": 0},
        {"throw": 5, "seconds": 5.0, "rests": False, "wild_rows": 0, "mu_factor": 0.99999},
        {"throw": 6, "seconds": 5.0, "rests": False, "wild_rows": 0, "mu_factor": 0.98},
    ]
    rows = cells_of(module._throws(SimpleNamespace(summary=lambda: {"each": each})))[1:]
    assert rows[0] == ["3", "2.13", "21.3", "yes", "+1.23", "4.2", "2"]
    assert rows[1] == ["4", "", "5.0", "no", "", "", "0"]
    assert [row[4] for row in rows[2:]] == ["+0.00", "-2.00"]


def test_rows_are_before_used_wild_unlike_between_or_after():
    t = np.arange(12.0)
    track = Trajectory(t=t, xy=np.column_stack([t, 2 * t]), throw=8, clock=50.0)
    rows = np.array([2, 3, 5, 6, 7, 8, 9])
    part = FreeSlide(track=track, rows=rows, stretch=(1, 11), rests=False, wild=1, noise=0.001)

    def uses(fitted):
        """Of a fit to rows of these times, which count from the first row of the slide."""
        residuals = np.arange(len(fitted)) / 100
        found = SimpleNamespace(
            tracks=[track],
            slides=(part,),
            travel_residuals=[([], []), (np.array(fitted), residuals)],
            place=lambda _: 1,
            fit=SimpleNamespace(session=SimpleNamespace(clocks=np.array([0.0, 52.0]))),
        )
        table = module.row_table(found)
        assert table["throw"].tolist() == [8] * 12
        assert table["t"].tolist() == table["x"].tolist() == t.tolist()
        assert table["y"].tolist() == (2 * t).tolist()
        used = table["use"] == "used"
        assert table["left_m"][used] == pytest.approx(residuals)
        assert np.isnan(table["left_m"][~used]).all()
        return "".join(use[0] + use[-1] for use in table["use"])

    start, end = "bebe", "arar"
    assert uses([0.0, 1, 3, 4, 5, 6, 7]) == start + "ududwdudududud" + "ud" + end
    # One row that is not like the others: the fitted ones still are neighbours.
    assert uses([0.0, 1, 3, 4, 6, 7]) == start + "ududwdududueudud" + end
    assert uses([0.0, 3, 5, 7]) == start + "udbnwdudbnudbnud" + end
    assert uses([0.0]) == start + "uduewdueueueueue" + end


@pytest.mark.parametrize("fit", [None, SimpleNamespace()])
def test_a_slide_that_is_not_in_the_fit_uses_all_its_rows(fit):
    t = np.arange(6.0)
    track = Trajectory(t=t, xy=np.column_stack([t, t]))
    part = FreeSlide(
        track=track, rows=np.array([1, 2, 4]), stretch=(0, 6), rests=False, wild=1, noise=0.0
    )
    found = SimpleNamespace(
        tracks=[track], slides=(part,), travel_residuals=[], place=lambda _: None, fit=fit
    )
    table = module.row_table(found)
    assert table["use"].tolist() == ["before", "used", "used", "wild", "used", "after"]
    assert np.isnan(table["left_m"]).all()


def test_sections_follow_what_there_is(monkeypatch):
    for name in ("effects", "beside", "throws", "remarks"):
        monkeypatch.setattr(module, f"_{name}", lambda *_, name=name: f"[{name}]")
    monkeypatch.setattr(module, "_picture_section", lambda folder, name: f"<h2>{name}</h2>")
    monkeypatch.setattr(module, "picture", lambda content, alt, *, kind, caption: f"[{caption}]")
    drag = ActiveEffect(name="air_drag", parameters={})
    pictures = ["map.png", "motion.png"]
    stills = [module.Still(film="<a>.mp4", t=2.04, jpeg=b"")]

    def titles(found, *given):
        page = list(module._sections(found, *given, Units.METRES))
        return [re.findall("<h[12]>(.*?)</h", section)[0] for section in page], "".join(page)

    names, page = titles(
        estimate(effects=[drag]), estimate(), None, pictures, stills, "<h2>The throws</h2>"
    )
    assert names[1:] == [
        *("map.png", "The throws", "Other effects on the stones", "Film and track", "motion.png"),
        *("Comparison with the paper's method", "Fit of each throw"),
    ]
    assert "[<a>.mp4, 2.0 s]" in page
    names, _ = titles(estimate(uniform=True), None, None, pictures, [], "")
    assert names[1:] == ["motion.png", "Fit of each throw"]


@pytest.mark.parametrize("mu", [0.0, -0.0005])
def test_a_level_that_is_not_above_zero_has_no_per_cent(mu):
    """The paper's method may find one; the cells are above zero all the same."""
    lost = estimate(mu, interval=(-0.0011, 0.0012))
    assert headline(lost) == f"This ice is keener than any curling ice: μ = {mu:.5f}."
    assert module._facts(lost, Units.METRES)[0][1] == "friction μ, 95 %: -0.00110 to 0.00120"
    assert cells_of(module._beside(estimate(), lost))[2][3] == ""


# --- the draw -------------------------------------------------------------------------------------


def test_facts_of_a_draw_are_its_numbers():
    curl = ActiveEffect(name="curl", parameters={"strength": 0.0065, "speed_exponent": 0.2})
    ice = Ice.uniform(0.02, effects=(curl,))
    draw = DrawWeight(ice, MU)
    further, longer = draw.worth_of_a_per_cent
    assert [value for value, _ in draw_facts(ice, MU)] == [
        f"{draw.hog_to_hog:.1f} s",
        f"{draw.seconds:.1f} s",
        f"{draw.speed:.2f} m/s",
        f"{draw.curl:.2f} m",
        f"{100 * further:.0f} cm",
        f"{longer:.2f} s",
    ]
    assert draw_facts(ice, 0.0) == []
    assert draw_facts(ice, 0.9) == []
