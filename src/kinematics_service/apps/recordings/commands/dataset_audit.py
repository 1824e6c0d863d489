# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Audit a dataset for the command `audit`, and write one table and one page for all episodes."""

from functools import partial
from pathlib import Path

import typer

from ....cli.options import refuse_unwritable
from ....output_file import write_documents
from ....printing import json_text
from ..audit.dataset import dataset_report
from ..audit.dataset.dataset_run import rows_of_dataset
from ..audit.dataset.episode_audit import EpisodeWork


def audit_dataset(
    path: Path,
    date: str,
    work: EpisodeWork,
    html: Path | None,
    json: Path | None,
    jobs: int,
    workers: str | None,
) -> None:
    """Audit a dataset, print and write the findings, and exit with code 1 if it fails."""
    for name, file in (('--html', html), ('--json', json)):
        if file is not None and str(file) != '-':
            refuse_unwritable(name, file)
    rows = rows_of_dataset(path, work, jobs, workers)
    report = dataset_report.report_of(str(path), work.reading.robot.name, rows)
    page = dataset_report.page_of_dataset(report, date) if html else ''
    document = json_text(dataset_report.document_of_dataset(report)) if json else ''
    write_documents(html, page, json, document, partial(dataset_report.print_report, report))
    if report.failed:
        raise typer.Exit(1)
