"""What a page that is written or served here may do: nothing but what stands in it.

A content security policy stops whatever a stranger's file may have brought into a page. Scripts run
only if they are those of the page itself, which are named by their SHA-256; nothing is loaded from
anywhere, and nothing can be sent.
"""

from __future__ import annotations

import base64
import hashlib
import re

_SCRIPT = re.compile(r"<script>(.*?)</script>", re.DOTALL)


def policy_of(page: str) -> str:
    """The policy of a page as the element that belongs into its head.

    Parameters
    ----------
    page : the HTML with its own scripts (``<script>`` without attributes), before anything that
        comes from files is put into it
    """
    return f'<meta http-equiv="Content-Security-Policy" content="{directives_of(page)}">'


def directives_of(page: str, *, connect: bool = False) -> str:
    """The policy of a page as the header ``Content-Security-Policy`` has it.

    Parameters
    ----------
    connect : whether its scripts may talk to the server that it came from
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
