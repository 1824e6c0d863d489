# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Run a calibration for a command: read recordings, and calibrate."""

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ....errors import CalibrationError
from ....kernel import Floats
from ....kinematics.uncertainty.parameters import parameters_of
from ....printing import attributes
from ....rigid_motion import inverses
from ....robot.robot import Robot
from ...checking.errors import PoseLimit
from ...recordings.readers.source import Selection
from ..calibration import calibrate
from ..camera import ON_TOOL, Camera
from ..checking import Measured, refuse_loops
from ..chosen_parameters import ChosenParameters, asks_for_gears
from ..reading import MeasuredRecording, TouchRecording, read_measured
from ..result import Calibration
from ..zeros import JointZero

# If a joint is faster than this, rad/s or m/s, the arm moved while poses were measured, and the
# calibration fits a lag.
MOVING = 0.05
Recordings = Sequence[MeasuredRecording]


class CalibratedPoses(NamedTuple):
    """
    A calibration, its measured poses, and the files that it was computed from.

    Attributes
    ----------
    found
        The calibration.
    files, remarks
        Names of the files with measured poses, and remarks on reading them.
    q, poses : shapes (N, n) and (N, 4, 4)
        Joint positions and poses of the first set of measured poses. Some of these poses are
        written to the section `known_poses` of the calibrated robot file.
    zeros
        Identified zeros of the joints; empty unless the command is `calibrate-zeros`.
    """

    found: Calibration
    files: Sequence[str]
    remarks: Sequence[str]
    q: Floats
    poses: Floats
    zeros: Sequence[JointZero] = ()


class CalibrationRun(NamedTuple):
    """
    The settings with which one arm is calibrated from recordings, touches or received poses.

    Attributes
    ----------
    fit, fix, own
        Words that select parameters. `fit`: parameters to fit. `fix`: parameters not to fit.
        `own`: `base` or `tool`, if the base or tool is fitted for each recording separately. The
        words are arguments of `calibrate`.
    limit
        Prior standard deviations of the lengths (m) and angles (rad) in the table. None: those in
        the robot file.
    noise
        The noise of the instrument, m and rad; None: unknown.
    check
        Whether the frame check and the search for mistakes run.
    camera
        The place of the camera, if the poses are those of a board in its images.
    tell
        Called with the name of each phase of the work.
    """

    arm: Robot
    fit: tuple[str, ...]
    fix: tuple[str, ...]
    own: tuple[str, ...]
    limit: PoseLimit | None
    noise: tuple[float, float] | None
    check: bool
    camera: Camera | None = None
    tell: Callable[[str], None] = lambda phase: None

    def check_names(self) -> None:
        """
        Raise an error for wrong settings. The function is called before poses are measured, so
        that the user does not first measure poses and then learn that the settings are wrong.

        Raises
        ------
        CalibrationError
            The arm has closed loops, a word names no parameter, or no parameter is fitted.
        """
        refuse_loops(self.arm.description)
        q = np.zeros((1, self.arm.dof))
        given = Measured.of(q, np.eye(4)[None], False, np.zeros(1, dtype=np.int64), q)
        table = parameters_of(self.arm, asks_for_gears(self.fit)).table
        ChosenParameters(self.arm, given, self.own, table).fitted(self.fit, self.fix)

    def read(self, files: Sequence[Path], reading: Selection, gap: float | None) -> Recordings:
        """
        Read the measured poses of files, and return them. `gap` (s) is the largest time between
        the joint states before and after a pose; None: three times the usual time between joint
        states.
        """
        given = [read_measured(file, reading, gap, self.camera == ON_TOOL) for file in files]
        if len({recording.positions for recording in given}) > 1:
            message = 'FILE: some have poses, others positions alone; give files of one kind'
            raise CalibrationError(message, code='conflict')
        return given

    def of_recordings(self, given: Recordings, **conditions: Any) -> CalibratedPoses:
        """
        Return the calibration from the poses of recordings.

        The poses of each recording are one set: `own` selects whether base and tool are fitted for
        each set separately. `conditions` are the arguments `sessions` and `loads` of `calibrate`.
        """
        on_tool = self.camera == ON_TOOL
        result = self.calibrated(
            np.concatenate([recording.q for recording in given]),
            poses=np.concatenate([recording.measured for recording in given]),
            sets=np.repeat(np.arange(len(given)), [len(recording.q) for recording in given]),
            qdot=np.concatenate([recording.rates for recording in given]),
            read='' if on_tool else given[0].kind,
            **conditions,
        )
        poses = inverses(given[0].poses) if on_tool else given[0].poses
        return CalibratedPoses(result, *origin_of(given), given[0].q, poses)

    def calibrated(self, q: Floats, qdot: Floats | None = None, **rows: Any) -> Calibration:
        """
        Run the calibration with these settings, and return it. The arguments in `rows` are passed
        to the library's `calibrate`, for example `poses` and `sets`.
        """
        moves = qdot is not None and np.max(np.abs(qdot)) > MOVING
        # Tolerances that the robot file has for single numbers override the prior standard
        # deviations in `limit`.
        limit, named = self.limit, dict(self.arm.description.tolerances.named)
        table = [entry for entry in parameters_of(self.arm).table if entry.name not in named]
        sizes = {entry.name: limit[entry.angle] for entry in table} if limit else {}
        rows['tolerances'] = {name: size for name, size in sizes.items() if math.isfinite(size)}
        rows |= attributes(self, 'fit', 'fix', 'own', 'noise', 'check', 'camera')
        return calibrate(self.arm, q, qdot=qdot if moves else None, progress=self.tell, **rows)


def origin_of(given: Sequence[MeasuredRecording | TouchRecording]) -> tuple[list[str], list[str]]:
    """Return the names of all files with measurements, and all remarks on reading the files."""
    files = [recording.file for recording in given]
    return files, [remark for recording in given for remark in recording.remarks]
