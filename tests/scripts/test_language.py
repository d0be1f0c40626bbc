"""The check of the wording, and that of commit subjects."""

import tomllib

import language
import pytest

RULES = tomllib.loads((language.ROOT / "scripts/language.toml").read_text("utf-8"))["rules"]


@pytest.fixture
def repository(tmp_path, monkeypatch):
    """A folder whose files count as tracked."""
    monkeypatch.setattr(
        language, "tracked", lambda root: sorted(file.name for file in root.iterdir())
    )
    return tmp_path


@pytest.mark.parametrize(
    ("rule", "text"),
    [
        ("docstring opening", '"""Whether a stone rests."""'),
        ("docstring opening", 'SIZE = 1\n"""What is shown."""'),
        ("told", "what_is_told = 1"),
        ("said", "# it is then said"),
        ("said", "said: list[str] = []"),
        ("so many", "# no more than so many frames"),
        ("so many", "# what every so manyth shows"),
        ("somebody", 'print("Nobody has thrown")'),
        ("left out", "# such frames are left out"),
        ("headless who", "# Who walks is not followed"),
        ("long help", f'option(help="{"long " * 30}")'),
        ("long help", f'option(None, "{"long " * 30}")'),
        ("anew", "begins_anew = 1"),
    ],
)
def test_each_pattern_is_found_where_it_is(repository, rule, text):
    (repository / "module.py").write_text(f"x = 1\n{text}\n", encoding="utf-8")
    places = language.broken(RULES, repository)[rule]
    assert [place.file for place in places] == ["module.py"]
    assert "x = 1" not in places[0].text


@pytest.mark.parametrize(
    "text",
    [
        '"""Whatever is given, as text."""',
        "# as far as the hog line, so that it rests",
        "# the fold is unfolded",
        "# Who is it?",
        'option(help="Short.")',
    ],
)
def test_plain_sentences_pass(repository, text):
    (repository / "module.py").write_text(text, encoding="utf-8")
    assert not any(language.broken(RULES, repository).values())


def test_listed_exceptions_pass():
    place = language.Place(file="a/calls.py", line=1, text='"take-out": "takeout"')
    rule = {"allowed": [{"file": "a/", "text": "take-out"}]}
    assert language.is_allowed(place, rule)
    assert not language.is_allowed(language.Place(file="b.py", line=1, text=place.text), rule)


def test_the_glossary_gives_the_words_that_it_replaces():
    glossary = "| Term | Meaning | Not |\n|---|---|---|\n| stone | disc | `rock`, `big rock` |\n"
    assert language.replaced_words(glossary) == {"rock": "stone", "big rock": "stone"}
    terms = (language.ROOT / "docs/glossary.md").read_text("utf-8")
    words = language.replaced_words(terms)
    assert len(terms.splitlines()) > 60
    assert words["likeliest"] == "most likely"


def test_a_violation_fails_with_its_place_and_the_plain_form(capsys, monkeypatch):
    found = {rule["name"]: [] for rule in RULES}
    monkeypatch.setattr(language, "broken", lambda rules: found)
    assert language.main([]) == 0
    found["anew"] = [language.Place(file="a.py", line=1, text="# anew")]
    assert language.main([]) == 1
    assert "a.py:1: # anew\n  anew; write instead: again" in capsys.readouterr().out


@pytest.mark.parametrize("subject", ["Add a glossary", "Feed the clock", "Bring the page to front"])
def test_imperative_subjects_pass(subject):
    assert not language.subject_faults(f"{subject}\n\nWhy.")


@pytest.mark.parametrize(
    "subject",
    ["", "Added a glossary", "What is shown", "Fixing it", "add a page", "Add " + 70 * "x"],
)
def test_other_subjects_are_refused(tmp_path, capsys, subject):
    message = tmp_path / "message"
    message.write_text(subject, encoding="utf-8")
    assert language.main(["--commit-message", str(message)]) == 1
    assert "expected" in capsys.readouterr().err
