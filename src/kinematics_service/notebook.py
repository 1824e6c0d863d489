"""Results show themselves in a notebook, by views of apps: None where the app was removed."""

from .app_modules import app_module


def as_html(result: object) -> str | None:
    """Return a result as a notebook shows it; it is the result's `_repr_html_`."""
    pictures = app_module('html')
    return pictures.html_of(result) if pictures else None


def as_latex(result: object) -> str | None:
    """Return a result as formulas; it is the result's `_repr_latex_`."""
    formulas = app_module('latex')
    return formulas.latex_of(result) if formulas else None
