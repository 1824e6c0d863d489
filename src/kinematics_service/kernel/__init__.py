"""The kernel: the computations for every message, compiled when the package is installed."""

from . import compiled
from .compiled import is_compiled as is_compiled
from .compiled import notice as notice
from .compiled import prefer_source_where_needed

prefer_source_where_needed()

from .angles import shortest_angle as shortest_angle
from .angles import sine_and_cosine as sine_and_cosine
from .arm import Arm as Arm
from .arrays import Bytes as Bytes
from .arrays import Floats as Floats
from .arrays import Integers as Integers
from .chain import Chain as Chain
from .chain import ChainTable as ChainTable
from .clearance import Clearance as Clearance
from .clearance import clearances as clearances
from .closed_forms import ClosedForm as ClosedForm
from .closed_forms import inverse_candidates as inverse_candidates
from .dependence import free_motions as free_motions
from .dependence import pivots as pivots
from .evaluation import evaluate as evaluate
from .evaluation import evaluate_one as evaluate_one
from .evaluation import quaternions as quaternions
from .factors import Tape as Tape
from .factors import evaluate_factors as evaluate_factors
from .joint_memory import JointMemory as JointMemory
from .joint_memory import OurJoints as OurJoints
from .joint_memory import forget as forget
from .joints import Joints as Joints
from .joints import representatives as representatives
from .judging import evaluate_and_measure_one as evaluate_and_measure_one
from .judging import measure as measure
from .judging import measure_one as measure_one
from .messages import FormTable as FormTable
from .messages import IncomingForm as IncomingForm
from .messages import observe_bytes as observe_bytes
from .nearest_singular import NearestSearch as NearestSearch
from .observing import observe as observe
from .outgoing import OutgoingMessages as OutgoingMessages
from .outgoing import OutgoingTable as OutgoingTable
from .outgoing import fill_messages as fill_messages
from .places import *  # noqa: F403
from .posture import postures as postures
from .refinement import Refinement as Refinement
from .refinement import refine as refine
from .residuals import Residual as Residual
from .residuals import parts_of_error as parts_of_error
from .searching import first_solution as first_solution
from .servo_step import Servo as Servo
from .servo_step import ServoOutput as ServoOutput
from .servoing import servo as servo
from .singular_values import decompose as decompose
from .singular_values import determinant_of as determinant_of
from .six_joints import SixJoints as SixJoints
from .six_joints import complex_solutions as complex_solutions
from .six_joints import followed_solutions as followed_solutions
from .solutions import Solutions as Solutions
from .solutions import distinct as distinct
from .solving import closed_solutions as closed_solutions
from .solving import eliminated_solutions as eliminated_solutions
from .symmetric import eigenvectors as eigenvectors
from .targets import off_rotation as off_rotation
from .targets import take_target as take_target
from .task_rows import TaskRows as TaskRows

if not is_compiled():
    globals().update(compiled.without_warnings(globals()))
