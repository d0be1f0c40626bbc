"""Configuration of Sphinx for the site; `python -m website` gathers its pages."""

from __future__ import annotations

import importlib.metadata
import sys
from pathlib import Path

from pygments.lexers.special import TextLexer
from sphinx.application import Sphinx

sys.path.insert(0, str(Path(__file__).parents[1]))  # the package `website`

project = "curling-sheet"
author = "The curling-sheet authors"
release = version = importlib.metadata.version("curling-sheet")
extensions = ["myst_parser", "sphinx.ext.autodoc", "website.docstrings", "website.equations"]

myst_enable_extensions = ["dollarmath", "colon_fence"]
myst_heading_anchors = 4
default_role = "code"
highlight_language = "text"
nitpick_ignore_regex = [("py:.*", r".*")]  # types of other packages have no pages here

autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_typehints_format = "short"
autodoc_preserve_defaults = True
python_maximum_signature_line_length = 88

html_theme = "furo"
html_title = f"curling-sheet {release}"
html_math_renderer = "drawn"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_sphinx = False
html_show_copyright = False


def setup(app: Sphinx) -> None:
    app.add_lexer("csv", TextLexer)
