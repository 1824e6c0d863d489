"""Represent results in a notebook by modules of apps; None if the app was removed."""

from .app_modules import app_module


def as_html(result: object) -> str | None:
    """Return a result as HTML; it is the result's `_repr_html_`."""
    pictures = app_module('html')
    return pictures.html_of(result) if pictures else None


def as_latex(result: object) -> str | None:
    """Return a result as formulas; it is the result's `_repr_latex_`."""
    formulas = app_module('latex')
    return formulas.latex_of(result) if formulas else None
