"""Site of the project: pages from docs/, others made from the code, and Sphinx (`make docs`)."""
