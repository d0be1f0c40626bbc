"""Pieces of a page as HTML."""

from __future__ import annotations

import base64

from friction_estimation.reports.html import facts, fold, picture, table, write_page


def test_cells_of_a_table_are_marked_by_their_columns():
    head, rows = ["a", "b", "c"], [["1", "2", "3"]]
    assert table(head, rows, {2}, kept={0, 2}) == (
        "<table><tr><th class=k>a</th><th>b</th><th class=n>c</th></tr>"
        "<tr><td class=k>1</td><td>2</td><td class=n>3</td></tr></table>"
    )
    assert table(["a"], [["1"], ["2"]], kind="throws") == (
        "<table class=throws><tr><th>a</th></tr>"
        "<tr><td data-name='a'>1</td></tr><tr><td data-name='a'>2</td></tr></table>"
    )


def test_plain_text_is_escaped_and_empty_parts_are_dropped():
    assert facts([("<1>", "a & b")]) == (
        "<div class=facts><div><b>&lt;1&gt;</b>a &amp; b</div></div>"
    )
    assert fold("<t>", ["", "<p>x</p>", ""]) == (
        "<details><summary>&lt;t&gt;</summary><p>x</p></details>"
    )
    assert fold("t", ["", ""]) == ""


def test_a_picture_is_within_the_page():
    data = base64.b64encode(b"content").decode()
    assert picture(b"content", "it's", kind="jpeg", caption="<c>") == (
        f"<figure><img alt='it&#x27;s' src='data:image/jpeg;base64,{data}'>"
        "<figcaption>&lt;c&gt;</figcaption></figure>"
    )
    assert "figcaption" not in picture(b"content", "it")


def test_a_page_ends_with_its_origin(tmp_path):
    path = tmp_path / "page.html"
    files = [{"file": "a&b.csv", "sha256": "12ab"}, {"file": "c.csv", "sha256": None}]
    origin = {"version": "1.2", "command": "curling <x>", "seed": 4, "inputs": files}
    write_page(path, "A <page>", ["one", "two"], reload=2.5, provenance=origin)
    page = path.read_text()
    assert "<title>A &lt;page&gt;</title><meta http-equiv=refresh content=2.5>" in page
    assert "<main><section>one</section><section>two</section><footer class=faint>" in page
    assert (
        "curling-sheet 1.2: <code>curling &lt;x&gt;</code><br>a&amp;b.csv: SHA-256 "
        "<code>12ab</code><br>c.csv: SHA-256 <code>unknown</code></footer>" in page
    )
    del origin["command"]
    write_page(path, "A page", ["one"], provenance=origin)
    page = path.read_text()
    assert "curling-sheet 1.2, seed 4<br>" in page
    assert "http-equiv=refresh" not in page
    write_page(path, "A page", ["one"])
    assert "footer class" not in path.read_text()
