"""
Results show themselves in a notebook, by a view that belongs to a room above all of them.
"""

from collections.abc import Callable
from typing import Any

# By the kind of view, `html` or `latex`. The package itself, which knows the room, puts them here.
VIEWS: dict[str, Callable[[Any], str]] = {}


def as_html(result: object) -> str:
    """Return a result as a notebook shows it; it is the result's `_repr_html_`."""
    return VIEWS['html'](result)


def as_latex(result: object) -> str:
    """Return a result as formulas; it is the result's `_repr_latex_`."""
    return VIEWS['latex'](result)
