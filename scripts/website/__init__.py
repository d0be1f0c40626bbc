"""The project's site: pages from docs/, others made from the code, and Sphinx.

`cd scripts && python -m website ../site` builds it; `--serve` shows it in the browser.
"""
