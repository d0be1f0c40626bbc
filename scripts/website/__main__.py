"""Build the site, offline and without a warning, or serve what was built.

cd scripts
python -m website ../site
python -m website ../site --serve
"""

from __future__ import annotations

import argparse
import contextlib
import functools
import http.server
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
KEPT = ROOT / "runs/website"


def main() -> int:
    options = argparse.ArgumentParser(prog="website", description="Build the site, or serve it.")
    options.add_argument("folder", type=Path, help="where the site goes")
    options.add_argument("--serve", action="store_true", help="show what was built")
    options.add_argument("--port", type=int, default=8000)
    given = options.parse_args()
    return serve(given.folder, given.port) if given.serve else build(given.folder)


def build(folder: Path, kept: Path = KEPT) -> int:
    """Gather the pages and let Sphinx make the site of them; every warning is an error.

    Parameters
    ----------
    folder : folder of the site
    kept : folder of the gathered pages, and of what Sphinx keeps for the next time
    """
    from sphinx.cmd.build import build_main

    from website.assets import remote_assets
    from website.pages import gather

    sources = kept / "pages"
    gather(ROOT, sources)
    words = ["-b", "html", "-W", "--keep-going", "-n", "-q", "-j", "auto"]
    words += ["-d", str(kept / "doctrees"), "-c", str(Path(__file__).parent)]
    status = build_main([*words, str(sources), str(folder)])
    for where in remote_assets(folder):
        print(f"loads something from elsewhere: {where}", file=sys.stderr)
        status = 1
    if status == 0:
        print(f"{folder.resolve()}/index.html")
    return status


def serve(folder: Path, port: int) -> int:
    """Serve a built site to this machine only, until interrupted."""
    handler = functools.partial(http.server.SimpleHTTPRequestHandler, directory=str(folder))
    with http.server.ThreadingHTTPServer(("127.0.0.1", port), handler) as server:
        print(f"http://127.0.0.1:{port}/ (ends with Ctrl+C)")
        with contextlib.suppress(KeyboardInterrupt):
            server.serve_forever()
    return 0


if __name__ == "__main__":
    sys.exit(main())
