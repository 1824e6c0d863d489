"""
Kinematics of any arm given by its Denavit-Hartenberg table: a library and a ROS 2 node.

The library needs no ROS: `load_robot`, `forward_kinematics`, `jacobian`, `twist`, `singularity`.
Each name is imported when it is first used, so that the command line answers `--help`, and hears
Ctrl-C, before the kernel is loaded.
"""

import signal
import sys

# As a command this file comes before `__main__`: Ctrl-C ends it without a traceback from here on.
_program = sys.argv[0] if sys.argv else ''
_is_command = (_program == '-m' and __name__ in sys.orig_argv) or _program.endswith(f'/{__name__}')
if _is_command and signal.getsignal(signal.SIGINT) is signal.default_int_handler:
    signal.signal(signal.SIGINT, signal.SIG_DFL)

from importlib import import_module  # noqa: E402
from typing import TYPE_CHECKING, Any  # noqa: E402

if TYPE_CHECKING:
    from .diagnosis.calibration.calibration import Calibration as Calibration
    from .diagnosis.calibration.calibration import calibrate as calibrate
    from .diagnosis.calibration.pose_covariance import pose_covariance as pose_covariance
    from .diagnosis.calibration.pose_covariance import twist_covariance as twist_covariance
    from .diagnosis.calibration.proposal import ProposedPoses as ProposedPoses
    from .diagnosis.calibration.proposal import propose_poses as propose_poses
    from .diagnosis.frame_check.diagnosis import FrameDiagnosis as FrameDiagnosis
    from .diagnosis.frame_check.diagnosis import diagnose_frames as diagnose_frames
    from .errors import JointVectorError as JointVectorError
    from .errors import KinematicsError as KinematicsError
    from .errors import LoopError as LoopError
    from .errors import PlanError as PlanError
    from .errors import PointError as PointError
    from .errors import RobotFileError as RobotFileError
    from .errors import RobotNotFoundError as RobotNotFoundError
    from .errors import TargetError as TargetError
    from .errors import TwistError as TwistError
    from .formats.urdf.importer import UrdfImport as UrdfImport
    from .formats.urdf.importer import import_urdf as import_urdf
    from .formats.urdf.writer import urdf_text as urdf_text
    from .kinematics.acceleration import acceleration as acceleration
    from .kinematics.acceleration import jacobian_rate as jacobian_rate
    from .kinematics.analytic import AnalyticJacobian as AnalyticJacobian
    from .kinematics.analytic import analytic_jacobian as analytic_jacobian
    from .kinematics.closure import LoopClosure as LoopClosure
    from .kinematics.forward import forward_kinematics as forward_kinematics
    from .kinematics.forward import jacobian as jacobian
    from .kinematics.forward import link_frames as link_frames
    from .kinematics.forward import twist as twist
    from .kinematics.forward import twist_at as twist_at
    from .kinematics.inverse.result import IkFamily as IkFamily
    from .kinematics.inverse.result import IkResult as IkResult
    from .kinematics.inverse.result import IkSolution as IkSolution
    from .kinematics.inverse.servo import ServoSettings as ServoSettings
    from .kinematics.inverse.servo import ServoStep as ServoStep
    from .kinematics.inverse.servo import joint_velocity as joint_velocity
    from .kinematics.inverse.solve import inverse_kinematics as inverse_kinematics
    from .kinematics.plans.check import check_plan as check_plan
    from .kinematics.plans.verdicts import PlanCheck as PlanCheck
    from .kinematics.singularity import Singularity as Singularity
    from .kinematics.singularity import singularity as singularity
    from .kinematics.statics import WrenchEstimate as WrenchEstimate
    from .kinematics.statics import joint_torques as joint_torques
    from .kinematics.statics import wrench_from_torques as wrench_from_torques
    from .kinematics.tool_state import ToolState as ToolState
    from .kinematics.tool_state import evaluate as evaluate
    from .robot.bundled import bundled_robots as bundled_robots
    from .robot.measures import Level as Level
    from .robot.points import Point as Point
    from .robot.robot import Robot as Robot
    from .robot.robot import load_robot as load_robot
    from .robot.robot import robot_from_text as robot_from_text
    from .symbolic.closed_arm import ClosedDerivation as ClosedDerivation
    from .symbolic.closed_arm import derive_closed as derive_closed
    from .symbolic.derivation import Derivation as Derivation
    from .symbolic.derivation import derive as derive
    from .version import __version__ as __version__

_HOME = {
    'bundled_robots': 'robot.bundled',
    'JointVectorError': 'errors',
    'KinematicsError': 'errors',
    'LoopError': 'errors',
    'PointError': 'errors',
    'RobotFileError': 'errors',
    'RobotNotFoundError': 'errors',
    'Calibration': 'diagnosis.calibration.calibration',
    'calibrate': 'diagnosis.calibration.calibration',
    'pose_covariance': 'diagnosis.calibration.pose_covariance',
    'twist_covariance': 'diagnosis.calibration.pose_covariance',
    'ProposedPoses': 'diagnosis.calibration.proposal',
    'propose_poses': 'diagnosis.calibration.proposal',
    'FrameDiagnosis': 'diagnosis.frame_check.diagnosis',
    'diagnose_frames': 'diagnosis.frame_check.diagnosis',
    'TargetError': 'errors',
    'IkFamily': 'kinematics.inverse.result',
    'IkResult': 'kinematics.inverse.result',
    'IkSolution': 'kinematics.inverse.result',
    'ServoSettings': 'kinematics.inverse.servo',
    'ServoStep': 'kinematics.inverse.servo',
    'TwistError': 'errors',
    'joint_velocity': 'kinematics.inverse.servo',
    'inverse_kinematics': 'kinematics.inverse.solve',
    'LoopClosure': 'kinematics.closure',
    'forward_kinematics': 'kinematics.forward',
    'jacobian': 'kinematics.forward',
    'link_frames': 'kinematics.forward',
    'twist': 'kinematics.forward',
    'twist_at': 'kinematics.forward',
    'acceleration': 'kinematics.acceleration',
    'jacobian_rate': 'kinematics.acceleration',
    'analytic_jacobian': 'kinematics.analytic',
    'AnalyticJacobian': 'kinematics.analytic',
    'joint_torques': 'kinematics.statics',
    'wrench_from_torques': 'kinematics.statics',
    'WrenchEstimate': 'kinematics.statics',
    'Level': 'robot.measures',
    'Point': 'robot.points',
    'Robot': 'robot.robot',
    'load_robot': 'robot.robot',
    'robot_from_text': 'robot.robot',
    'Singularity': 'kinematics.singularity',
    'singularity': 'kinematics.singularity',
    'PlanCheck': 'kinematics.plans.verdicts',
    'PlanError': 'errors',
    'check_plan': 'kinematics.plans.check',
    'ClosedDerivation': 'symbolic.closed_arm',
    'derive_closed': 'symbolic.closed_arm',
    'Derivation': 'symbolic.derivation',
    'derive': 'symbolic.derivation',
    'ToolState': 'kinematics.tool_state',
    'evaluate': 'kinematics.tool_state',
    'UrdfImport': 'formats.urdf.importer',
    'import_urdf': 'formats.urdf.importer',
    'urdf_text': 'formats.urdf.writer',
    '__version__': 'version',
}

__all__ = list(_HOME)


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f'module {__name__!r} has no attribute {name!r}')
    value = getattr(import_module(f'.{_HOME[name]}', __name__), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOME})
