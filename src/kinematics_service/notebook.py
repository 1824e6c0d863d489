# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Show results of the library in a notebook: as HTML by the app `pictures`, as LaTeX by `formulas`.

Both apps may be missing. Then the notebook shows results as plain text.
"""

from .app_modules import app_module


def as_html(result: object) -> str | None:
    """
    Return a result as HTML, for its method `_repr_html_`; None if the app `pictures` was removed.
    """
    pictures = app_module('html')
    return pictures.html_of(result) if pictures else None


def as_latex(result: object) -> str | None:
    """
    Return a result as LaTeX, for its method `_repr_latex_`; None if the app `formulas` was
    removed.
    """
    formulas = app_module('latex')
    return formulas.latex_of(result) if formulas else None
