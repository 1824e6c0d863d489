# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Run a calibration of a command, write its output files, and print its report."""

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from datetime import datetime
from enum import Enum
from functools import partial
from pathlib import Path
from typing import NamedTuple, Optional, TextIO

import typer

from ....cli.options import WrongUsage, flag, option
from ....errors import CalibrationError, ParameterNotFoundError
from ....output_file import write_documents, write_file
from ....printing import Output, heading, json_text, plain, table, working
from ....robot.bundled import find_robot, find_robot_file
from ....robot.file.reader import robot_file_text
from ..output.calibration_run import CalibratedPoses, CalibrationRun
from ..output.page import page_of
from ..report import cells_of, document_of, sentences_of
from ..robot_text import CalibrationOrigin, calibrated_text
from .calibration_options import check_inputs, check_output


class FramesChoice(str, Enum):
    """
    Values of --frames: which base and tool the written file has. `robot`: those of the robot file.
    `measured`: the base is the frame in which the poses were measured, and the tool is the frame
    whose poses were measured.
    """

    robot = 'robot'
    measured = 'measured'


class OutputOptions(NamedTuple):
    """Options for the output files."""

    output: Optional[Path] = option('Write the calibrated robot file.', 'FILE')
    json: Optional[Path] = option('Write everything as JSON; - prints it.', 'FILE')
    html: Optional[Path] = option('Write a page with pictures.', 'FILE')
    frames: FramesChoice = option(
        'Base and tool to write: of the robot file, or of the poses.',
        default=FramesChoice.robot,
    )
    anyway: bool = flag('--anyway', 'Write the robot file although the checks reject the result.')
    force: bool = flag('--force', 'Overwrite the output.')

    @property
    def stream(self) -> TextIO:
        """Return the stream for text: stderr if the JSON document goes to stdout, else stdout."""
        return sys.stderr if str(self.json) == '-' else sys.stdout

    def check(self, inputs: Sequence[Path]) -> None:
        """Refuse files that cannot be written, before the calibration runs."""
        check_inputs(inputs)
        for name in ('output', 'html', 'json'):
            file = getattr(self, name)
            if str(file) == '-' and name != 'json':
                raise WrongUsage(f'--{name}: give a file; only --json can be printed with -')
            if file is not None and str(file) != '-':
                check_output(f'--{name}', file, inputs, self.force or name != 'output')


@contextmanager
def named_errors(files: Sequence[Path]) -> Iterator[None]:
    """
    Convert errors about unknown parameters to `WrongUsage`. Put the names of the files before the
    text of other errors.
    """
    try:
        yield
    except ParameterNotFoundError as error:
        raise WrongUsage(f'--fit, --fix: {error}') from None
    except CalibrationError as error:
        if not files or any(str(file) in str(error) for file in files):
            raise
        raise CalibrationError(f'{", ".join(map(str, files))}: {error}', code=error.code) from None


def run_calibration(
    run: CalibrationRun,
    robot: str,
    files: Sequence[Path],
    outputs: OutputOptions,
    calibrated: Callable[[CalibrationRun], CalibratedPoses],
) -> CalibratedPoses:
    """Calibrate, write the outputs and the report, and exit with 1 if the result is refused."""
    with named_errors(files):
        with working('calibrating') as tell:
            tell('reading')
            data = calibrated(run._replace(tell=tell))
            is_written = data.found.accepted or outputs.anyway
            if outputs.output is not None and is_written:
                write_file(outputs.output, _robot_text(data, robot, outputs))
        write_report(data, robot, outputs)
    if not is_written:
        raise typer.Exit(1)
    if outputs.output is not None:
        following = f'python -m kinematics_service check {outputs.output}'
        print(f'wrote {outputs.output}; next: {following}', file=outputs.stream)
    return data


def _robot_text(data: CalibratedPoses, robot: str, outputs: OutputOptions) -> str:
    date = datetime.now().astimezone().date().isoformat()
    origin = CalibrationOrigin(', '.join(Path(file).name for file in data.files), date)
    nominal, frames = robot_file_text(*find_robot(robot)), outputs.frames
    return calibrated_text(
        data.found, nominal, data.q, data.poses, origin, frames.value, outputs.anyway
    )


def write_report(data: CalibratedPoses, robot: str, outputs: OutputOptions) -> None:
    """Write the page and the document of a calibration, and print its results."""
    date = datetime.now().astimezone().isoformat(' ', 'seconds')
    origin = data.files, str(find_robot_file(robot)), date, data.remarks
    page = page_of(data.found, *origin) if outputs.html else ''
    document = {**document_of(data.found, data.files), 'reading': data.remarks}
    if data.zeros:
        document['zeros'] = data.zeros
    report = partial(_print_report, data, outputs)
    write_documents(outputs.html, page, outputs.json, json_text(document), report)


def _print_report(data: CalibratedPoses, outputs: OutputOptions) -> None:
    result, out = data.found, Output()
    first, *others = sentences_of(result)
    sentences = [first, *data.remarks, *others]
    if not result.accepted:
        no_file = 'no robot file is written without --anyway'
        end = 'written anyway' if outputs.anyway else no_file
        out.print(plain(f'{sentences.pop(0)}; {end}.'), '')
    title = f'{result.robot.name}: {result.count} {result.kind} of {", ".join(data.files)}'
    out.print(heading(title), '')
    out.print(*(plain(f'  {sentence}.') for sentence in sentences), '')
    rows = table('  parameter', 'correction', 'deviation', '')
    for parameter in result.parameters:
        name, *cells = cells_of(parameter, result)
        rows.add_row(f'  {name}', *cells)
    out.print(rows)
