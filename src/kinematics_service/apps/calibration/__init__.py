"""
From the nominal table to one very robot: `calibrate`, its variants, and the node's second source.

Measured poses (`reading.py`, `boards/`, or live: `collecting.py`) are checked (`checking.py`), the
corrections of the table are fitted (`fitting.py`), and accepted or not (`acceptance.py`).
`output/` writes the new robot file, a page and plots. `second_source_watch.py` compares poses that
arrive while the node runs.
"""
