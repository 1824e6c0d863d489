"""The command `audit` of a dataset: one table and one page for all its episodes."""

import hashlib
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import NamedTuple

import typer

from ....cli.options import refuse_unwritable
from ....output_file import write_documents
from ....printing import json_text
from ....robot.bundled import find_robot_file
from ....version import __version__
from ..audit.dataset.dataset_report import (
    document_of_dataset,
    page_of_dataset,
    print_report,
    report_of,
)
from ..audit.dataset.dataset_run import Journal, rows_of_dataset
from ..audit.dataset.episode_audit import EpisodeWork


class DatasetOutputs(NamedTuple):
    """The files to write, each None where nobody asks; `json` may be -."""

    html: Path | None
    json: Path | None
    resume: Path | None


def audit_dataset(
    path: Path,
    robot: str,
    date: str,
    work: EpisodeWork,
    outputs: DatasetOutputs,
    jobs: int,
    workers: str | None,
) -> None:
    """Audit a dataset, print and write what is found, and exit with code 1 if it fails."""
    for name, file in zip(('--html', '--json', '--resume'), outputs):
        if file is not None and str(file) != '-':
            refuse_unwritable(name, file)
    journal = Journal(outputs.resume, _asked(path, robot, work)) if outputs.resume else None
    rows = rows_of_dataset(path, work, jobs, workers, journal)
    report = report_of(str(path), work.reading.robot.name, rows)
    page = page_of_dataset(report, date) if outputs.html else ''
    document = json_text(document_of_dataset(report)) if outputs.json else ''
    write_documents(outputs.html, page, outputs.json, document, partial(print_report, report))
    if report.failed:
        raise typer.Exit(1)


def _asked(path: Path, robot: str, work: EpisodeWork) -> str:
    # Everything on which what is found depends, the rows apart.
    arm = work.reading.robot
    sum_of_robot = hashlib.sha256(find_robot_file(robot).read_bytes()).hexdigest()
    scale, zero = (part.tolist() for part in work.reading.joint_format.units(arm))
    words = (
        path,
        robot,
        sum_of_robot,
        arm.tool_frame,
        arm.singularity.thresholds,
        replace(work, reading=work.reading._replace(robot=None)),  # type: ignore[arg-type]
        scale,
        zero,
        __version__,
    )
    return ' '.join(map(str, words))
