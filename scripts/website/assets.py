"""What a built page would load from elsewhere. The site is read without a network."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

_LOADED = re.compile(
    r"""<(?:script|img|iframe|source|video|audio)\b[^>]*\ssrc=["'](?:https?:)?//[^"']+"""
    r"""|<link\b(?=[^>]*rel=["'](?:stylesheet|preload|icon|preconnect))[^>]*href=["'](?:https?:)?//[^"']+""",
    re.IGNORECASE,
)
_IN_STYLES = re.compile(r"""(?:url\(|@import)\s*["']?(?:https?:)?//[^"')]+""", re.IGNORECASE)


def remote_assets(site: Path) -> Iterator[str]:
    """Each page or style that names a script, picture, font or style of another host."""
    for page in sorted(site.rglob("*.html")):
        for found in _LOADED.findall(page.read_text(encoding="utf-8")):
            yield f"{page.relative_to(site)}: {found}"
    for style in sorted(site.rglob("*.css")):
        for found in _IN_STYLES.findall(style.read_text(encoding="utf-8")):
            yield f"{style.relative_to(site)}: {found}"
