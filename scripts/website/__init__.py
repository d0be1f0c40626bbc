"""The project's site: pages from docs/, others made from the code, and Sphinx (`make docs`)."""
