# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Report the audited episodes of a dataset, worst first: on the screen, as HTML page, and as JSON.
"""

import re
from collections.abc import Sequence
from html import escape
from typing import Any, NamedTuple

from rich.text import Text

from .....page import document
from .....printing import Json, Output, attributes, heading, plain, table
from .....robot.measures import Level
from .....typography import counted
from .....version import __version__
from ...datasets.arms import TAKEN
from ..findings import Finding, seconds
from ..report.summary import STYLES
from ..report.tables import TableColumn, table_of
from .episode_audit import EpisodeRow

# Largest number of episodes printed on the screen; also the largest number of kinds of findings.
MAX_SHOWN = 20
# Largest number of episodes listed on the HTML page.
MAX_ON_PAGE = 10_000
NUMBER = re.compile(r'[-+]?\d[\d.,]*(?:e[-+]?\d+)?')


class Kind(NamedTuple):
    """
    A kind of findings, whose texts differ only in numbers. `episodes` is the number of episodes
    with a finding of this kind, and `example` is the text of the first finding.
    """

    level: Level
    episodes: int
    example: str
    code: str


class DatasetReport(NamedTuple):
    """
    The findings on a dataset.

    Attributes
    ----------
    name, robot
        Names of the dataset and of the arm.
    rows
        Episodes, worst first.
    kinds
        Findings of level WARN and ERROR, the worst and most frequent first.
    """

    name: str
    robot: str
    rows: tuple[EpisodeRow, ...]
    kinds: tuple[Kind, ...]

    @property
    def failed(self) -> bool:
        """Return whether at least one episode of the dataset fails."""
        return any(row.failed for row in self.rows)

    @property
    def taken(self) -> list[str]:
        """
        Return the assumptions about which columns hold joint positions, each as a sentence. An
        assumption is made if no option names the columns.
        """
        texts = dict.fromkeys(text for row in self.rows for _, text, _ in row.findings)
        return [text for text in texts if TAKEN in text]

    def in_words(self) -> str:
        """Return the name and the size of the dataset as text."""
        episodes = counted(len({row.name for row in self.rows}), 'episode')
        frames = sum(row.rows for row in self.rows)
        time = sum(row.seconds for row in self.rows)
        return f'{self.name}: {episodes}, {frames:,} frames over {seconds(time)}, {self.robot}'

    def levels(self) -> str:
        """Return how many episodes are OK, WARN and ERROR, as text."""
        levels = [row.level for row in self.rows]
        return ', '.join(
            f'{level.name} {levels.count(level)}'
            for level in (Level.ERROR, Level.WARN, Level.OK)
            if level in levels
        )


def report_of(name: str, robot: str, rows: Sequence[EpisodeRow]) -> DatasetReport:
    """Return the report of a dataset, computed from the rows of its episodes."""
    kinds: dict[tuple[Level, str], list[Finding]] = {}
    for row in rows:
        findings = {NUMBER.sub('#', finding.text): finding for finding in row.findings}
        if row.error:
            key = NUMBER.sub('#', row.error.split(': ', 1)[-1])
            findings[key] = Finding(Level.ERROR, row.error, row.code)
        for key, finding in findings.items():
            if finding.level > Level.OK:
                kinds.setdefault((finding.level, key), []).append(finding)
    ordered = sorted(kinds.items(), key=lambda item: (-item[0][0], -len(item[1])))
    return DatasetReport(
        name,
        robot,
        tuple(sorted(rows, key=_badness)),
        tuple(Kind(level, len(kind), kind[0].text, kind[0].code) for (level, _), kind in ordered),
    )


def _badness(row: EpisodeRow) -> tuple[Any, ...]:
    levels = [finding.level for finding in row.findings]
    return -row.level, not row.error, [-levels.count(level) for level in (Level.ERROR, Level.WARN)]


def print_report(report: DatasetReport) -> None:
    """Print the frequent findings, and the worst episodes that are not OK."""
    out = Output()
    out.print(heading(report.in_words()))
    out.print(Text(report.levels()))
    for text in report.taken:
        out.print(plain(text))
    for kind in report.kinds[:MAX_SHOWN]:
        of = f'{kind.episodes} of {len(report.rows)}: '
        style = STYLES[kind.level]
        out.print(Text.assemble((f'{kind.level.name}  ', style), of, plain(kind.example)))
    if len(report.kinds) > MAX_SHOWN:
        out.print(Text(f'and {len(report.kinds) - MAX_SHOWN:,} more kinds of findings'))
    worst = [row for row in report.rows if row.level > Level.OK]
    if not worst:
        return
    arms = any(row.arm for row in worst)
    rows = table('episode', *(['arm'] if arms else []), 'frames', 'level', 'worst')
    for row in worst[:MAX_SHOWN]:
        arm = [row.arm] if arms else []
        text = plain(row.error or row.findings[0].text)
        rows.add_row(plain(row.name), *arm, f'{row.rows:,}', row.level.name, text)
    out.print(Text(''), rows)
    if len(worst) > MAX_SHOWN:
        out.print(Text(f'and {len(worst) - MAX_SHOWN:,} more'))


def page_of_dataset(report: DatasetReport, date: str) -> str:
    """Return the page as HTML: frequent findings, and all episodes with their findings."""
    title = f'Audit of {report.name.rstrip("/").rpartition("/")[2]}'
    kinds = (
        TableColumn('level', lambda kind: _tag(kind.level.name)),
        TableColumn('episodes', lambda kind: f'{kind.episodes:,}', True),
        TableColumn('for instance', lambda kind: escape(kind.example)),
    )
    columns = (
        TableColumn('episode', lambda row: escape(row.name)),
        TableColumn('arm', lambda row: escape(row.arm)),
        TableColumn('frames', lambda row: f'{row.rows:,}', True),
        TableColumn('lasts', lambda row: seconds(row.seconds), True),
        TableColumn('level', lambda row: _tag(row.level.name)),
        TableColumn('findings', _findings),
    )
    more = len(report.rows) - MAX_ON_PAGE
    body = [
        f'<h1>{escape(title)}</h1>\n<p class="soft">{escape(report.in_words())}. '
        f'{escape(date)}.</p>\n<p>{escape(report.levels())}</p>\n',
        *([f'<h2>Found</h2>\n{table_of(kinds, report.kinds)}'] if report.kinds else []),
        f'<h2>Episodes, worst first</h2>\n{table_of(columns, report.rows[:MAX_ON_PAGE])}',
        f'<p>and {more:,} more</p>\n' if more > 0 else '',
        f'<p class="soft">kinematics_service {__version__}.</p>\n',
    ]
    return document(title, body)


def _tag(level: str) -> str:
    return f'<span class="tag {level}">{level}</span>'


def _findings(row: EpisodeRow) -> str:
    if row.error:
        return escape(row.error)
    first, *others = (escape(finding.text) for finding in row.findings)
    if not others:
        return first
    items = ''.join(f'<li>{text}</li>' for text in others)
    return f'<details><summary>{first}</summary><ul>{items}</ul></details>'


def document_of_dataset(report: DatasetReport) -> dict[str, Json]:
    """Return the report as a dictionary for JSON."""
    return {
        'dataset': report.name,
        'robot': report.robot,
        'found': [
            {'level': kind.level.name, **attributes(kind, 'episodes', 'code', 'example')}
            for kind in report.kinds
        ],
        'episodes': [
            {
                **attributes(row, 'name', 'arm'),
                'frames': row.rows,
                'seconds': row.seconds,
                'level': row.level.name,
                **attributes(row, 'failed', 'error', 'code'),
                'findings': [
                    {'level': finding.level.name, 'code': finding.code, 'text': finding.text}
                    for finding in row.findings
                ],
            }
            for row in report.rows
        ],
    }
