"""
Pictures of an arm: files (`plot`), a live web page (`view`), results in a notebook.

A pose or a path becomes plain data (the core's `node/drawing/` for the arm itself), then lines
and colours: of matplotlib in `plots/`, of the page in `view/`, of HTML in `notebook.py`.
"""
