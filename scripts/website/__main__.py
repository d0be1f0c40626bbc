"""Build the site, offline and without a warning: `cd scripts && python -m website ../site`."""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2]
KEPT = ROOT / "runs/website"


def main() -> int:
    options = argparse.ArgumentParser(prog="website", description=__doc__)
    options.add_argument("folder", type=Path, help="folder of the site")
    return build(options.parse_args().folder)


def build(folder: Path, kept: Path = KEPT) -> int:
    """Gather the pages and build the site with Sphinx; every warning is an error.

    Parameters
    ----------
    folder : folder of the site
    kept : folder of the gathered pages, and of Sphinx's cache
    """
    from sphinx.cmd.build import build_main

    from website.pages import gather

    sources = kept / "pages"
    gather(ROOT, sources)
    words = ["-b", "html", "-W", "--keep-going", "-n", "-q", "-j", "auto"]
    words += ["-d", str(kept / "doctrees"), "-c", str(Path(__file__).parent)]
    status = build_main([*words, str(sources), str(folder)])
    for where in remote_assets(folder):
        print(f"loads from another host: {where}", file=sys.stderr)
        status = 1
    if status == 0:
        print(f"{folder.resolve()}/index.html")
    return status


_LOADED = re.compile(
    r"""<(?:script|img|iframe|source|video|audio)\b[^>]*\ssrc=["'](?:https?:)?//[^"']+"""
    r"""|<link\b(?=[^>]*rel=["'](?:stylesheet|preload|icon|preconnect))[^>]*href=["'](?:https?:)?//[^"']+"""
    r"""|(?:url\(|@import)\s*["']?(?:https?:)?//[^"')]+""",
    re.IGNORECASE,
)


def remote_assets(site: Path) -> Iterator[str]:
    """Yield each page or style that loads a script, picture, font or style from another host."""
    for path in sorted({*site.rglob("*.html"), *site.rglob("*.css")}):
        for found in _LOADED.findall(path.read_text(encoding="utf-8")):
            yield f"{path.relative_to(site)}: {found}"


if __name__ == "__main__":
    sys.exit(main())
