"""The kernel: the computations for every message, compiled when the package is installed."""

from . import compiled
from .compiled import is_compiled as is_compiled
from .compiled import notice as notice
from .compiled import use_compiled

use_compiled()

from .clearance.clearance import Clearance as Clearance
from .clearance.clearance import clearances as clearances
from .evaluation import evaluate as evaluate
from .evaluation import evaluate_one as evaluate_one
from .evaluation import quaternions as quaternions
from .forward.angles import shortest_angle as shortest_angle
from .forward.angles import sine_and_cosine as sine_and_cosine
from .forward.chain import Chain as Chain
from .forward.chain import ChainTable as ChainTable
from .forward.chain import Closure as Closure
from .forward.chain import Loop as Loop
from .forward.chain import LoopGroup as LoopGroup
from .forward.chain import groups_from as groups_from
from .forward.chain import section_width as section_width
from .forward.pose_errors import PoseErrors as PoseErrors
from .forward.pose_errors import PoseErrorTable as PoseErrorTable
from .forward.pose_errors import covariances as covariances
from .inverse.closed_forms import ClosedForm as ClosedForm
from .inverse.closed_forms import inverse_candidates as inverse_candidates
from .inverse.dependence import free_motions as free_motions
from .inverse.dependence import pivots as pivots
from .inverse.joints import Joints as Joints
from .inverse.joints import representatives as representatives
from .inverse.posture import postures as postures
from .inverse.refinement import Refinement as Refinement
from .inverse.refinement import refine as refine
from .inverse.residuals import Residual as Residual
from .inverse.residuals import linearise as linearise
from .inverse.residuals import parts_of_error as parts_of_error
from .inverse.searching import first_solution as first_solution
from .inverse.servo_step import Servo as Servo
from .inverse.servo_step import ServoOutput as ServoOutput
from .inverse.servoing import servo as servo
from .inverse.solutions import Solutions as Solutions
from .inverse.solutions import distinct as distinct
from .inverse.solving import closed_solutions as closed_solutions
from .inverse.solving import closed_solutions_of_each as closed_solutions_of_each
from .inverse.solving import eliminated_solutions as eliminated_solutions
from .inverse.targets import off_rotation as off_rotation
from .inverse.targets import take_target as take_target
from .joint_memory import JointMemory as JointMemory
from .joint_memory import OurJoints as OurJoints
from .joint_memory import forget as forget
from .judging import evaluate_and_measure_one as evaluate_and_measure_one
from .judging import find_nearest as find_nearest
from .judging import measure as measure
from .judging import measure_one as measure_one
from .layout.arrays import Bytes as Bytes
from .layout.arrays import Floats as Floats
from .layout.arrays import Integers as Integers
from .layout.places import *  # noqa: F403
from .loops.closing import assemble as assemble
from .loops.closing import close_at as close_at
from .measures.factors import Tape as Tape
from .measures.factors import evaluate_factors as evaluate_factors
from .measures.singular_values import decompose as decompose
from .measures.singular_values import determinant_of as determinant_of
from .measures.symmetric import eigenvectors as eigenvectors
from .measures.task_rows import TaskRows as TaskRows
from .messages import IncomingForm as IncomingForm
from .messages import observe_bytes as observe_bytes
from .observing import observe as observe
from .outgoing import OutgoingMessages as OutgoingMessages
from .outgoing import OutgoingTable as OutgoingTable
from .outgoing import fill_messages as fill_messages
from .self_motion.curve_path import CurvePath as CurvePath
from .self_motion.curve_path import nearest_place as nearest_place
from .self_motion.curve_path import write_places as write_places
from .self_motion.curve_pieces import cut as cut
from .self_motion.curve_point import CurvePoint as CurvePoint
from .self_motion.curve_point import write_derivative as write_derivative
from .self_motion.tracing import passes as passes
from .self_motion.tracing import trace as trace
from .singular_search.arm import Arm as Arm
from .singular_search.nearest_search import NearestSearch as NearestSearch
from .six_joints.six_joints import SixJoints as SixJoints
from .six_joints.six_joints import complex_solutions as complex_solutions
from .six_joints.six_joints import followed_solutions as followed_solutions
from .stopping import end_in_time as end_in_time

compiled.name_as_exported(globals())
if not is_compiled():
    globals().update(compiled.without_warnings(globals()))
