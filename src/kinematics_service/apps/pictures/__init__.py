"""
Pictures of an arm: files (`plot`), a live web page (`view`), results in a notebook.

A pose or a path first becomes plain data; the core's `node/drawing/` has the data of the arm. Then
`plots/` draws with matplotlib, `view/` with viser, and `notebook.py` writes HTML.
"""
