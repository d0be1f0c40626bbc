"""Content security policy of pages that are written or served here.

The policy stops anything that a file from a stranger may have brought into a page. Only the page's
own scripts run, named by their SHA-256; nothing is loaded from anywhere, and nothing can be sent.
"""

from __future__ import annotations

import base64
import hashlib
import re

_SCRIPT = re.compile(r"<script>(.*?)</script>", re.DOTALL)


def policy_of(page: str) -> str:
    """Return the policy of a page as an element for its head.

    Parameters
    ----------
    page : the HTML with its own scripts (``<script>`` without attributes), before any content from
        files is inserted
    """
    return f'<meta http-equiv="Content-Security-Policy" content="{directives_of(page)}">'


def directives_of(page: str, *, connect: bool = False) -> str:
    """Return the policy of a page as the header ``Content-Security-Policy``.

    Parameters
    ----------
    connect : allow its scripts to contact the server of the page
    """
    digests = (hashlib.sha256(script.encode()).digest() for script in _SCRIPT.findall(page))
    scripts = " ".join(f"'sha256-{base64.b64encode(digest).decode()}'" for digest in digests)
    none = "'none'"
    own = "'self' " if connect else ""
    return "; ".join(
        [
            "default-src 'none'",
            f"script-src {scripts or none}",
            "style-src 'unsafe-inline'",
            f"img-src {own}data:",
            f"connect-src {own.strip() or none}",
            "base-uri 'none'",
            "form-action 'none'",
        ]
    )
