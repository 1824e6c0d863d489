# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Write an HTML page that needs no other files. The page fits light and dark screens, print, and any
width.

The file page.css has the style of the page. The colours are those of Okabe and Ito (2008), which
people with any colour vision can distinguish; the dark page has lighter colours.
"""

from collections.abc import Iterable, Sequence
from html import escape
from importlib import resources


def document(title: str, body: Iterable[str], style: str = '', script: str = '') -> str:
    """
    Return a whole HTML page as text.

    Parameters
    ----------
    title
        Title of the page, plain text.
    body
        Pieces of HTML in their order.
    style, script
        CSS and JavaScript of this page; the function adds the style of page.css.
    """
    shared = resource('kinematics_service', 'page.css')
    parts = [
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f'<title>{escape(title)}</title>\n<style>\n{shared}{style}</style>\n</head>\n<body>\n',
        *body,
        f'<script>\n{script}</script>\n' if script else '',
        '</body>\n</html>\n',
    ]
    return ''.join(parts)


def resource(package: str, name: str) -> str:
    """Return the text of a file (a style or a script) in the folder of a package."""
    return resources.files(package).joinpath(name).read_text(encoding='utf-8')


def facts(rows: Iterable[tuple[str, str]]) -> str:
    """Return an HTML list of names and values, given as pieces of HTML."""
    cells = ''.join(f'<dt>{name}</dt><dd>{value}</dd>' for name, value in rows)
    return f'<dl class="origin">{cells}</dl>\n'


def table(headers: Sequence[str], rows: Iterable[Sequence[str]], numbers: Sequence[int]) -> str:
    """
    Return an HTML table, given heads and cells as HTML; the columns `numbers` are aligned right.
    """
    styles = '', ' class="n"'

    def cells(tag: str, row: Sequence[str]) -> str:
        return ''.join(
            f'<{tag}{styles[k in numbers]}>{cell}</{tag}>' for k, cell in enumerate(row)
        )

    body = ''.join(f'<tr>{cells("td", row)}</tr>\n' for row in rows)
    head = f'<thead><tr>{cells("th", headers)}</tr></thead>\n' if any(headers) else ''
    return f'<div class="wide"><table>{head}<tbody>{body}</tbody></table></div>\n'
