"""Parts of the site: links, docstrings, assets, and pages from the code."""

from __future__ import annotations

import json
import re

import pytest
from website import commands, effects, equations, notebooks
from website.__main__ import remote_assets
from website.docstrings import field_list
from website.pages import relinked, with_whole_cells

from curling_env.physics import catalogue


@pytest.mark.parametrize(
    ("name", "below", "link", "there"),
    [
        ("versioning.md", "docs/", "../CHANGELOG.md", "changelog.md"),
        ("environments/end.md", "docs/", "../../CHANGELOG.md#added", "../changelog.md#added"),
        ("environments/curling-end.md", "docs/", "../rules.md", "../rules.md"),
        ("contributing.md", "", "docs/decisions/README.md", "decisions/README.md"),
        ("contributing.md", "", "ARCHITECTURE.md", "architecture.md"),
        ("changelog.md", "", "https://keepachangelog.com/docs/x", "https://keepachangelog.com/docs/x"),
        ("changelog.md", "", "#unreleased", "#unreleased"),
    ],
)  # fmt: skip
def test_links_lead_to_the_documents_on_the_site(name, below, link, there):
    assert relinked(f"see [it]({link}).", name, below=below) == f"see [it]({there})."


def test_dates_and_percentages_in_tables_are_not_broken():
    text = "| 1 | 20 % | 2026-11-21 |\nMade on 2026-11-21, 20 % of it.\n```text\n| 5 % |\n```\n"
    found = with_whole_cells(text)
    assert found.startswith(
        '| 1 | 20\N{NO-BREAK SPACE}% | <span class="date">2026-11-21</span> |\n'
    )
    assert found.split("\n")[1:] == text.split("\n")[1:]


def test_a_docstring_becomes_fields():
    fields = field_list(
        [
            "Find *it* in `a_place`.",
            "",
            "Parameters",
            "----------",
            "x, y : place [m],",
            "    sheet frame",
            "**more : of the kind a_b",
            "",
            "Returns",
            "-------",
            "(n, 2) [m]",
            "",
            "Raises",
            "------",
            "InputError : nothing there",
        ]
    )
    assert [line for line in fields if line] == [
        r"Find \*it\* in `a_place`.",
        r":param x,\ y: place [m], sheet frame",
        r":param \*\*more: of the kind a\_b",
        ":returns: (n, 2) [m]",
        ":raises InputError: nothing there",
    ]


def test_assets_from_other_hosts_are_found(tmp_path):
    page = '<a href="https://example.org">there</a><script src="_static/a.js"></script>'
    (tmp_path / "good.html").write_text(page)
    assert list(remote_assets(tmp_path)) == []
    (tmp_path / "bad.html").write_text('<script async src="//cdn.example.org/x.js"></script>')
    (tmp_path / "bad.css").write_text("@import 'https://fonts.example.org/a.css';")
    (tmp_path / "worse.html").write_text('<link href="https://a.org/b.css" rel="stylesheet">')
    found = [where.split(":")[0] for where in remote_assets(tmp_path)]
    assert found == ["bad.css", "bad.html", "worse.html"]


def test_the_help_of_a_command_is_its_page():
    text = commands.help_of("throws")
    assert text.startswith("Usage: curling throws")
    assert "--units" in text


def test_every_effect_has_a_page_with_every_parameter():
    pages = effects.pages()
    for name, card in catalogue().items():
        for parameter in card.parameters:
            assert f"| `{parameter.name}` |" in pages[f"effects/{name}.md"]
        assert f"({name}.md)" in pages["effects/index.md"]


@pytest.mark.parametrize("card", catalogue().values(), ids=lambda card: card.name)
def test_every_effect_has_its_equation_drawn_with_a_symbol_for_each_parameter(card):
    text = effects.page(card)
    if not card.parameters:
        assert "$$" not in text
        return
    assert f"$$\n{card.equation}\n$$" in text
    assert "<svg" in equations.drawn(card.equation, block=True)
    symbols = [parameter.symbol for parameter in card.parameters]
    assert len(set(symbols)) == len(symbols)
    for parameter in card.parameters:
        letter = parameter.symbol.split("_")[0]
        assert re.search(rf"(?<![a-zA-Z\\]){re.escape(letter)}(?![a-zA-Z])", card.equation)
        assert f"| ${parameter.symbol}$ | `{parameter.name}` |" in text


def test_an_equation_is_divided_at_wide_spaces_where_that_breaks_nothing():
    assert equations.parts(r"a = b, \qquad c = \frac{d}{e}") == ["a = b,", r"c = \frac{d}{e}"]
    whole = r"\begin{pmatrix} a \qquad b \end{pmatrix}"
    assert equations.parts(whole) == [whole]


def test_a_notebook_is_a_page_of_its_text_and_code(tmp_path):
    cell = {"metadata": {}, "source": ["# Title\n", "\n", "Words."]}
    code = {"metadata": {}, "source": ["x = 1\n", "x + 1"], "outputs": [], "execution_count": None}
    cells = [cell | {"cell_type": "markdown"}, code | {"cell_type": "code"}]
    about = {"metadata": {"language_info": {"name": "python"}}, "nbformat": 4, "nbformat_minor": 4}
    (tmp_path / "notebooks").mkdir()
    (tmp_path / "notebooks" / "1-a.ipynb").write_text(json.dumps({"cells": cells, **about}))
    ((name, text),) = notebooks.pages(tmp_path).items()
    assert name == "notebooks/1-a.md"
    assert text.startswith("# Title\n\n{download}`The notebook <1-a.ipynb>`\n\nWords.")
    assert text.endswith("```python\nx = 1\nx + 1\n```\n")
