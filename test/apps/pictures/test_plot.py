# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Pictures: the numbers behind the curves, the words around them, the files they become."""

import dataclasses
import functools
import json
import math
import re
import subprocess
import sys
import xml.etree.ElementTree as ElementTree

import linkages
import numpy as np
import pytest
from arms import DISTINCT_BUNDLED, LOOPED, robot_of, without_known_poses
from folders import GOLDEN
from refusal import refused

import kinematics_service as ks
from kinematics_service import output_file
from kinematics_service.__main__ import main
from kinematics_service.apps.pictures.commands.plot import WORKSPACE_POINTS
from kinematics_service.robot.measures import MEASURES

pytest.importorskip('matplotlib', reason='needs matplotlib')

from kinematics_service.apps.pictures.plots import motion as plotted_motion
from kinematics_service.apps.pictures.plots import picture, ranges
from kinematics_service.apps.pictures.plots.arm import arm_picture
from kinematics_service.apps.pictures.plots.captions import nearness
from kinematics_service.apps.pictures.plots.critical import critical_points
from kinematics_service.apps.pictures.plots.distance_colours import ColourScale, draw_distances
from kinematics_service.apps.pictures.plots.distance_map import distance_map, joint_pair
from kinematics_service.apps.pictures.plots.family import family_picture
from kinematics_service.apps.pictures.plots.map_picture import map_picture
from kinematics_service.apps.pictures.plots.measures import measure_units, measures_picture
from kinematics_service.apps.pictures.plots.motion import PlottedMotion, motion_of
from kinematics_service.apps.pictures.plots.picture import drawn, save_picture
from kinematics_service.apps.pictures.plots.plane import plane_of
from kinematics_service.apps.pictures.plots.ranges import clear_pose, finite_ranges
from kinematics_service.apps.pictures.plots.set_styles import set_styles
from kinematics_service.apps.pictures.plots.skeleton import skeleton_of
from kinematics_service.apps.pictures.plots.solutions import (
    MAX_PANELS,
    poses_of,
    solutions_picture,
)
from kinematics_service.apps.pictures.plots.velocity import velocity_picture
from kinematics_service.apps.pictures.plots.workspace import section_rows, workspace
from kinematics_service.apps.pictures.plots.workspace_picture import workspace_picture
from kinematics_service.apps.recordings.readers.open_file import open_source
from kinematics_service.apps.recordings.readers.source import Selection
from kinematics_service.errors import PlotError

ROUND_OFF = 1e-12
# What a picture says of a pose without a singular pose near it.
BEYOND = 'none found within 1 rad (57 deg)'
# An arm is shown at this share of the largest area it can have, or more: views along an axis of
# the base are left out, where the labels of two axes fall together.
SEEN = 0.85
ODD = """\
robot: odd
convention: standard
joints:
  - {name: "arm-1/$j.2", type: revolute, variable: q1}
links:
  - {a: 1, alpha: 0, d: 0, theta: q1}
"""


@functools.cache
def shown_pose(name):
    """Return the pose at which the arm of a name is drawn, found once."""
    return clear_pose(robot_of(name))


def texts(figure):
    """Return everything a figure says, in one string."""
    from matplotlib.text import Text

    return '\n'.join(text.get_text() for text in figure.findobj(Text) if text.get_visible())


def box_of(axes, text):
    """Return where a text in space ends up on paper, in pixels."""
    from matplotlib.text import Text
    from mpl_toolkits.mplot3d.proj3d import proj_transform

    x, y, _ = proj_transform(*text.get_position_3d(), axes.get_proj())
    Text.set_position(text, (x, y))
    return Text.get_window_extent(text)


def curves(axes):
    """Return the curves of a panel by their labels: values over time."""
    return {line.get_label(): line.get_ydata() for line in axes.lines}


# The skeleton, by another road: the columns of J are the screws of the joints.


@pytest.mark.parametrize('name', DISTINCT_BUNDLED)
def test_joint_axes_are_those_of_the_jacobian(name):
    robot = robot_of(name)
    q = np.random.default_rng(3).uniform(*finite_ranges(robot).T)
    skeleton = skeleton_of(robot, q)
    assert {v for axis in skeleton.axes for v in axis.variables} == set(robot.variables)
    if len(skeleton.axes) != robot.dof or any(len(axis.variables) > 1 for axis in skeleton.axes):
        return  # coupled: a column is the sum of several screws
    tool, J = skeleton.tool[:3, 3], ks.jacobian(robot, q)
    for axis in skeleton.axes:
        column = J[:, robot.variables.index(axis.variables[0])]
        if axis.slides:
            screw = np.concatenate([axis.direction, np.zeros(3)])
        else:
            screw = np.concatenate([np.cross(axis.direction, tool - axis.point), axis.direction])
        sign = np.sign(screw @ column)  # theta: -q turns the other way
        assert sign * screw == pytest.approx(column, abs=ROUND_OFF)


@pytest.mark.slow
@pytest.mark.parametrize('name', DISTINCT_BUNDLED)
def test_the_drawn_arm_is_one_line_from_the_base_to_the_tool(name):
    robot = robot_of(name)
    q = shown_pose(name)
    segments = skeleton_of(robot, q).segments
    assert not np.any(segments[0].start)
    assert segments[-1].end == pytest.approx(ks.forward_kinematics(robot, q)[:3, 3], abs=1e-8)
    for one, next_one in zip(segments, segments[1:]):
        assert np.array_equal(one.end, next_one.start)
    corners = np.array([segments[0].start, *(segment.end for segment in segments)])
    for frame in ks.link_frames(robot, q):
        assert np.min(np.linalg.norm(corners - frame[:3, 3], axis=1)) < 1e-8


@pytest.mark.parametrize('name', ['scara_hsr065', 'puma560', 'six_joint_dh'])
def test_a_standard_row_is_drawn_along_its_axis_and_then_along_its_normal(name):
    robot = robot_of(name)
    q = np.random.default_rng(4).uniform(*finite_ranges(robot).T)
    corners = [s.end for s in skeleton_of(robot, q).segments]
    frames = ks.link_frames(robot, q)
    for frame, o in zip(frames, frames[1:, :3, 3]):
        along = (o - frame[:3, 3]) @ frame[:3, 2]
        if abs(along) > 1e-3:
            corner = frame[:3, 3] + along * frame[:3, 2]
            assert np.min(np.linalg.norm(corners - corner, axis=1)) < 1e-8


def test_the_slides_that_carry_a_platform_are_no_links():
    # Of the delta only its three loops are drawn, four links each.
    robot = robot_of('flexpicker')
    assert len(skeleton_of(robot, robot.chain.closure.assembled()).segments) == 12


@pytest.mark.slow
@pytest.mark.parametrize('name', LOOPED)
def test_the_drawn_machine_hangs_together_from_the_base_to_the_tool(name):
    robot = robot_of(name)
    q = robot.chain.closure.assembled()
    drawn, left = [np.zeros(3)], list(skeleton_of(robot, q).segments)
    while left:
        touching = [s for s in left if is_one_of(s.start, drawn) or is_one_of(s.end, drawn)]
        assert touching, 'a part that nothing holds'
        drawn += [end for segment in touching for end in (segment.start, segment.end)]
        left = [segment for segment in left if segment not in touching]
    assert is_one_of(ks.forward_kinematics(robot, q)[:3, 3], drawn)


def is_one_of(point, points):
    return np.min(np.linalg.norm(np.array(points) - point, axis=1)) < 1e-8


@pytest.mark.slow
@pytest.mark.parametrize('name', DISTINCT_BUNDLED)
def test_the_default_pose_is_inside_the_limits_and_not_singular(name):
    robot, q = robot_of(name), shown_pose(name)
    assert np.all((q >= robot.limits[:, 0]) & (q <= robot.limits[:, 1]))
    assert ks.singularity(robot, q).distance > 0.3


@pytest.mark.parametrize('name', ['craig_3r', 'scara_hsr065'])
def test_the_default_pose_is_the_best_of_all_and_the_same_each_time(name, monkeypatch):
    for size in (2, ranges.CANDIDATES):
        monkeypatch.setattr(ranges, 'BATCH_SIZE', size)
        assert np.array_equal(shown_pose(name), clear_pose.__wrapped__(robot_of(name)))


# Machines whose loops do not close everywhere.


@pytest.fixture(scope='module')
def short_rods():
    """A five-bar without limits whose rods are too short for a fifth of all positions."""
    text = re.sub(r', limits: \[.*?\]', '', without_known_poses('five_bar'))
    text = text.replace('distal: 0.4', 'distal: 0.3')
    return ks.robot_from_text(text.replace('psi1: -1.27, psi2: 1.27', 'psi1: -1.51, psi2: 1.51'))


@pytest.fixture(scope='module')
def dead_centres(short_rods):
    return critical_points(short_rods, plane_of(short_rods, 'xy'), 4)


@pytest.mark.slow
def test_a_map_shows_where_loops_do_not_close(short_rods):
    numbers = distance_map(short_rods, joint_pair(short_rods, None), clear_pose(short_rods), 6)
    x, y = np.meshgrid(numbers.horizontal, numbers.vertical)
    # The elbows, and whether both rods reach from one to the other.
    across = 0.3 + 0.25 * (np.cos(y) - np.cos(x))
    apart = np.hypot(across, 0.25 * (np.sin(y) - np.sin(x)))
    assert numbers.joints == (0, 1)
    assert np.array_equal(np.isnan(numbers.distance), apart > 0.6)
    for values in numbers.functions.values():
        assert np.array_equal(np.isnan(values), apart > 0.6)
    assert numbers.open_share == np.mean(apart > 0.6) > 0.1
    words = texts(drawn(map_picture(short_rods, numbers)))
    assert f'rods does not close: {100 * numbers.open_share:.3g}' in words
    excavator = robot_of('excavator')
    numbers = distance_map(excavator, (1, 2), excavator.chain.closure.assembled(), 3)
    assert numbers.open_share == 0.0
    assert 'does not close' not in texts(drawn(map_picture(excavator, numbers)))


def test_a_map_on_which_no_loop_closes_is_refused():
    stretched = robot_of('excavator')
    q = np.array(stretched.chain.closure.assembled())
    q[1] = 9.0
    with refused(PlotError, 'open-loop', 'boom_triangle', '--q'):
        distance_map(stretched, (2, 3), q, 3)


@pytest.mark.slow
@pytest.mark.parametrize('plane', ['xy', 'xz'])
def test_a_workspace_counts_where_loops_do_not_close(short_rods, dead_centres, plane):
    space = workspace(short_rods, plane_of(short_rods, plane), 60)
    assert 0.05 < space.open_poses / space.poses < 0.4
    assert np.isfinite(space.best).any()
    words = texts(drawn(workspace_picture(short_rods, space, dead_centres)))
    assert f'close at {space.open_poses:,} of' in words


@pytest.mark.slow
def test_singular_points_of_machines_with_loops_are_at_dead_centres(dead_centres):
    # A rod in line with its proximal link: the tip is as far from its motor as it gets.
    points = dead_centres.points
    far = np.linalg.norm(points, axis=1), np.linalg.norm(points - [0.3, 0], axis=1)
    ends = np.array([0.25 + 0.3, 0.3 - 0.25])
    away = np.min([np.abs(one[:, None] - ends).min(axis=1) for one in far], axis=0)
    assert len(away) > 3
    assert np.max(away) < 1e-6


# Pictures of poses.


@pytest.mark.slow
@pytest.mark.parametrize(
    'name', ['craig_3r', 'ur5e', 'planar_2r', 'scara_hsr065', 'offset_stanford_dh']
)
def test_labels_of_an_arm_do_not_cover_each_other(name):
    robot = robot_of(name)
    figure = drawn(arm_picture(robot, clear_pose(robot)))
    axes = figure.axes[0]
    boxes = [box_of(axes, text) for text in axes.texts]
    assert len(boxes) >= 4
    for k, box in enumerate(boxes):
        assert figure.bbox.fully_containsx(box.x0)
        assert figure.bbox.fully_containsx(box.x1)
        for other in boxes[:k]:
            across = min(box.x1, other.x1) - max(box.x0, other.x0)
            up = min(box.y1, other.y1) - max(box.y0, other.y0)
            assert min(across, up) < 2.0  # pixels


def test_an_arm_has_equal_scales_units_and_says_where_it_is():
    robot = robot_of('ur5e')
    q = [0, -1.57, 1.2, 0, 0.0, 0]
    figure = drawn(arm_picture(robot, np.array(q)))
    axes = figure.axes[0]
    lengths = [np.ptp(limits) for limits in (axes.get_xlim(), axes.get_ylim(), axes.get_zlim())]
    assert lengths == pytest.approx([lengths[0]] * 3)
    assert [axes.get_xlabel(), axes.get_ylabel(), axes.get_zlabel()] == ['x (m)', 'y (m)', 'z (m)']
    said = texts(figure).replace('\N{NO-BREAK SPACE}', ' ')
    assert 'ur5e: tool0 in base' in said
    assert 'q2 \N{MINUS SIGN}1.57' in said
    assert 'singular pose: wrist [ERROR]' in said
    assert 'lost translation' in said or ks.singularity(robot, q).lost_direction[:3].max() < 0.1


def test_a_drawn_arm_is_inside_of_its_axes():
    axes = drawn(arm_picture(robot_of('ur5e'), np.array([0, -1.57, 1.2, 0, 0.0, 0]))).axes[0]
    limits = np.array([axes.get_xlim(), axes.get_ylim(), axes.get_zlim()])
    # The ends of joint axes may be outside.
    lines = [line for line in axes.lines if line.get_label() != 'joint axis']
    points = np.concatenate([np.array(line.get_data_3d()) for line in lines], axis=1)
    outside = np.maximum(limits[:, 0] - points.T, points.T - limits[:, 1])
    assert np.max(outside) <= ROUND_OFF


def test_names_are_shown_letter_by_letter():
    robot = ks.robot_from_text(ODD.replace('q1', 'a_1'), 'odd')
    figure = drawn(arm_picture(robot, np.zeros(1)))
    figure.canvas.draw()
    assert 'a_1' in texts(figure)
    assert picture.words('$x_1$\x1b') == r'\$x_1\$?'


@pytest.mark.slow
def test_every_solution_has_a_panel_with_its_posture_and_feasibility():
    robot = robot_of('puma560')
    q = clear_pose(robot)
    target = ks.forward_kinematics(robot, q)
    result = ks.inverse_kinematics(robot, target, respect_limits=False)
    figure = drawn(solutions_picture(robot, target, result))
    assert len(figure.axes) == len(result) == 8
    said = texts(figure)
    for solution in result:
        assert str(solution.posture) in said
    beyond = [solution for solution in result if not solution.feasible]
    assert said.count('beyond the limits of') == len(beyond) > 0
    stars = [line for axes in figure.axes for line in axes.lines if line.get_gid() == 'target']
    for star in stars:
        assert np.ravel(star.get_data_3d()) == pytest.approx(target[:3, 3])
    assert '8 solutions; 2 ' in said


def area_on_paper(corners, paper):
    # Of the ellipse of inertia of points (k, 3), projected by a matrix (2, 3).
    flat = (corners - corners.mean(axis=0)) @ np.transpose(paper)
    return np.prod(np.linalg.svd(flat, compute_uv=False))


@pytest.mark.slow
@pytest.mark.parametrize('name', ['puma560', 'kuka_iiwa14'])
def test_every_panel_is_turned_to_its_arm(name):
    robot = robot_of(name)
    q = clear_pose(robot) + 0.07
    result = ks.inverse_kinematics(robot, ks.forward_kinematics(robot, q), respect_limits=False)
    poses = [pose.q for pose in poses_of(result)][:MAX_PANELS]
    figure = drawn(solutions_picture(robot, ks.forward_kinematics(robot, q), result))
    assert len(figure.axes) == len(poses)
    for axes, q in zip(figure.axes, poses):
        points = np.vstack(
            [s.start + np.linspace(0, 1, 40)[:, None] * (s.end - s.start)
             for s in skeleton_of(robot, q).segments]
        )  # fmt: skip
        areas = {}
        for azimuth in (axes.azim, *np.arange(0.0, 360.0, 6.0)):
            a, e = np.radians([azimuth, axes.elev])
            across = [-np.sin(a), np.cos(a), 0.0]
            up = [-np.sin(e) * np.cos(a), -np.sin(e) * np.sin(a), np.cos(e)]
            areas[azimuth] = area_on_paper(points, [across, up])
        assert areas[axes.azim] > SEEN * max(areas.values())
        assert axes.get_xlabel() == 'x (m)'


def test_axes_are_red_green_and_blue(monkeypatch):
    monkeypatch.setattr(plotted_motion, 'SAMPLES', 101)
    robot = robot_of('ur3e')
    figure = drawn(arm_picture(robot, clear_pose(robot)))
    motion = motion_of(robot, 'sine')
    linear, angular = drawn(velocity_picture(robot, motion)).axes[:2]
    frames = [line for line in figure.axes[0].lines if line.get_gid() == 'frame']
    for k in range(3):
        seen = [line.get_color() for line in frames[k::3]]
        seen += [axes.lines[k].get_color() for axes in (linear, angular)]
        assert len(set(seen)) == 1
        red_green_blue = [int(seen[0][i : i + 2], 16) for i in (1, 3, 5)]
        assert np.argmax(red_green_blue) == k


@pytest.mark.slow
def test_more_solutions_than_fit_are_counted():
    robot = robot_of('planar_2r')
    target = np.array([1.0, 0.5, 0.0])
    result = ks.inverse_kinematics(robot, target)
    many = dataclasses.replace(result, solutions=result.solutions * 10)
    figure = drawn(solutions_picture(robot, target, many))
    assert len(figure.axes) == MAX_PANELS
    assert f'{MAX_PANELS} of 20' in texts(figure)


def test_a_target_out_of_reach_shows_the_nearest_pose():
    robot = robot_of('planar_2r')
    target = np.array([9.0, 0.0, 0.0])
    result = ks.inverse_kinematics(robot, target)
    assert 'nearest pose: 7 m' in texts(drawn(solutions_picture(robot, target, result)))


# Curves over time.


def test_the_velocity_of_document_002_is_drawn():
    golden = json.loads((GOLDEN / 'traj_s002_tool_velocity.json').read_text())
    case = next(case for case in golden['cases'] if case['unit'] == 'm')
    text = ks.bundled_robots()['rrp_elementary'].read_text()
    lengths = ', '.join(f'{name}: {value}' for name, value in case['lengths'].items())
    text = re.sub(r'constants:.*', f'constants: {{{lengths}}}', text.partition('known_poses')[0])
    robot = ks.robot_from_text(re.sub(r', limits: \[0, \.inf\]', '', text))
    samples = sorted(case['samples'], key=lambda sample: sample['t'])
    times = np.array([sample['t'] for sample in samples])
    q, qdot = (np.array([sample[key] for sample in samples]) for key in ('q', 'qdot'))
    # The built-in path is the document's.
    from kinematics_service.apps.demo.motions.trajectory import sine_trajectory

    motion = sine_trajectory(robot).at(times)
    assert motion.q == pytest.approx(q, abs=ROUND_OFF)
    assert motion.qdot == pytest.approx(qdot, abs=ROUND_OFF)
    no_rows = np.array([], dtype=np.int64)
    figure = drawn(
        velocity_picture(robot, PlottedMotion(times, q, qdot, 'document 002', False, no_rows))
    )
    linear, angular, *joints = figure.axes
    v = np.array([sample['v'] for sample in samples])
    drawn_curves = curves(linear)
    for k, axis in enumerate('xyz'):
        there = np.isfinite(drawn_curves[f'v{axis}'])
        assert drawn_curves[f'v{axis}'][there] == pytest.approx(v[:, k], abs=ROUND_OFF)
    norm = drawn_curves['|v|']
    assert norm[np.isfinite(norm)] == pytest.approx(np.linalg.norm(v, axis=1), abs=ROUND_OFF)
    assert [axes.get_ylabel() for axes in figure.axes] == [
        'linear velocity (m/s)',
        'angular velocity (rad/s)',
        'joint velocity (rad/s)',
        'joint velocity (m/s)',
    ]
    assert joints[-1].get_xlabel() == 'time (s)'


@pytest.mark.slow
@pytest.mark.parametrize('name', ['craig_3r', 'panda'])
def test_measures_are_those_of_the_library(name, monkeypatch):
    monkeypatch.setattr(plotted_motion, 'SAMPLES', 101)
    robot = robot_of(name)
    motion = motion_of(robot, 'sine')
    near = ks.singularity(robot, motion.q)
    figure = drawn(measures_picture(robot, motion))
    names = [m for m in MEASURES if m != 'determinant' or near.determinant is not None]
    assert len(figure.axes) == len(names)
    by_label = {re.sub(r'\s+', ' ', axes.get_ylabel()): axes for axes in figure.axes}
    for label, values in (
        ('distance to singularity (rad)', near.distance),
        ('smallest singular value (m)', near.smallest_singular_value),
        ('condition number', near.condition_number),
    ):
        assert np.array_equal(by_label[label].lines[0].get_ydata(), values)
    thresholds = curves(by_label['distance to singularity (rad)'])
    assert list(thresholds['warn 0.1']) == [0.1, 0.1]
    assert list(thresholds['stop 0.03']) == [0.03, 0.03]


def test_intervals_near_singular_poses_are_shaded_and_named(monkeypatch):
    monkeypatch.setattr(plotted_motion, 'SAMPLES', 501)
    robot = robot_of('ur5e')
    motion = motion_of(robot, 'sine')
    figure = drawn(measures_picture(robot, motion))
    near = ks.singularity(robot, motion.q)
    error = motion.times[near.level == 2]
    spans = [p.get_extents().transformed(figure.axes[0].transData.inverted())
             for p in figure.axes[0].patches]  # fmt: skip
    assert any(abs(span.x0 - error[0]) < 1e-6 for span in spans)
    named = figure.axes[0].texts
    assert len(named) > 1
    for text in named:
        k = np.argmin(np.abs(motion.times - text.get_position()[0]))
        assert text.get_text() == near.factors.names[near.factors.estimates[k].argmin()]
    worst = near.factors.names[near.factors.estimates.min(axis=0).argmin()]
    assert worst in [text.get_text() for text in named]


@pytest.mark.slow
@pytest.mark.parametrize('name', DISTINCT_BUNDLED)
def test_units_of_determinant_and_manipulability(name):
    # By scaling: an arm twice as large has 2^k times the number where the unit is m^k.
    robot = robot_of(name)
    unit = measure_units(robot)['manipulability']
    if unit == 'mixed':
        # Five joints and six rows: the minors have units of their own.
        assert robot.dof < len(robot.singularity.task.rows)
        return
    power = {'': 0, 'm': 1}.get(unit) if unit in ('', 'm') else int(re.findall(r'-?\d+', unit)[0])
    J = ks.jacobian(robot, shown_pose(name))
    rows = [('x', 'y', 'z', 'rx', 'ry', 'rz').index(row) for row in robot.singularity.task.rows]
    slides = [kind == 'prismatic' for kind in robot.joint_types]
    larger = J.copy()
    larger[:3] *= 2.0
    larger[:, slides] /= 2.0

    def volume(J):
        return np.prod(np.linalg.svd(J[rows], compute_uv=False))

    assert volume(larger) == pytest.approx(2.0**power * volume(J), rel=1e-9)


@pytest.mark.slow
def test_a_recording_without_velocities_and_with_a_gap(tmp_path):
    robot = robot_of('planar_2r')
    file = tmp_path / 'r.csv'
    times = np.concatenate([np.arange(0, 1, 0.01), [0.99], np.arange(5, 6, 0.01)])
    q = np.column_stack([0.5 * times, np.remainder(3.0 + times + np.pi, 2 * np.pi) - np.pi])
    rows = '\n'.join(f'{t:.2f},{a!r},{b!r}' for t, (a, b) in zip(times, q.tolist()))
    file.write_text(f'stamp,position.q1,position.q2\n{rows}\n')
    motion = motion_of(robot, str(file))
    assert motion.differentiated
    assert len(motion.times) == len(times) - 1  # the repeated stamp
    assert motion.qdot == pytest.approx(np.tile([0.5, 1.0], (len(motion.times), 1)), abs=1e-6)
    assert list(motion.gaps) == [100]
    figure = drawn(velocity_picture(robot, motion))
    assert np.flatnonzero(np.isnan(figure.axes[0].lines[0].get_ydata())).tolist() == [100]
    assert 'differences of the positions' in texts(figure)


# Maps and workspaces.


@pytest.mark.slow
def test_a_recording_that_does_not_close_everywhere_is_drawn_where_it_does(tmp_path):
    robot = ks.robot_from_text(linkages.SHORT_FIVE_BAR)
    opening = np.sin(np.linspace(0.0, 2.0 * math.pi, 200))
    half = 0.15 + 0.25 * np.sin(opening)  # half the way between the elbows; a rod is 0.3
    file = tmp_path / 'opening.csv'
    rows = [f'{0.01 * k},{math.pi / 2 + x},{math.pi / 2 - x}' for k, x in enumerate(opening)]
    file.write_text('\n'.join(['stamp,position.q1,position.q2', *rows]))
    motion = motion_of(robot, str(file))
    closes = np.abs(half) < 0.3
    assert 20 < np.sum(~closes) < 180
    assert len(motion.times) == np.sum(closes)
    assert motion.described.startswith('opening.csv')
    assert f'{np.sum(~closes)} of its 200 positions' in motion.described
    figure = drawn(measures_picture(robot, motion))
    times, shown = figure.axes[0].lines[0].get_data()
    assert np.sum(np.isnan(shown)) == 1  # one line ends where the branch does, another begins
    inside = times[np.isnan(shown)][0]
    first, last = 0.01 * np.flatnonzero(~closes)[[0, -1]]
    assert first - 0.01 < inside < last + 0.01
    assert len(drawn(velocity_picture(robot, motion)).axes) >= 3
    file.write_text('\n'.join(['stamp,position.q1,position.q2', '0,3.1,0', '0.1,3.1,0.01']))
    with refused(PlotError, 'open-loop', 'opening.csv: ', 'short_five_bar', '0 of its 2'):
        motion_of(robot, str(file))


def test_a_map_is_the_distance_and_its_curves_are_singular_poses():
    robot = robot_of('craig_3r')
    numbers = distance_map(robot, joint_pair(robot, ['q2', 'q3']), np.zeros(3), 81)
    for i, k in ((0, 0), (17, 60), (80, 3)):
        q = [0.0, numbers.horizontal[k], numbers.vertical[i]]
        assert numbers.distance[i, k] == ks.singularity(robot, q).distance
    figure = drawn(map_picture(robot, numbers))
    said = texts(figure)
    for words in ('q2 (rad)', 'q3 (rad)', 'elbow = 0', 'shoulder = 0', 'warn: distance 0.1 rad'):
        assert words in said
    assert 'distance to singularity (rad)' in said
    sets = [c for c in figure.axes[0].collections if list(c.levels) == [0.0]]
    assert len(sets) == 2
    for curve in sets:
        points = np.vstack([path.vertices for path in curve.get_paths()])
        q = np.column_stack([np.zeros(len(points)), points])
        assert np.max(ks.singularity(robot, q).distance) < 0.01
        assert len(points) > 100


@pytest.mark.parametrize(('name', 'joint'), [('planar_2r', 'q2'), ('ur10e', 'q3')])
def test_a_set_on_the_border_of_a_map_is_drawn(name, joint):
    robot = robot_of(name)
    pair = joint_pair(robot, ['q1', 'q2'] if name == 'planar_2r' else ['q2', 'q3'])
    figure = drawn(map_picture(robot, distance_map(robot, pair, clear_pose(robot), 31)))
    heights = np.concatenate(
        [path.vertices[:, 1] for c in figure.axes[0].collections if list(c.levels) == [0.0]
         for path in c.get_paths()]
    )  # fmt: skip
    for border in (-math.pi, 0.0, math.pi):
        assert np.sum(np.abs(heights - border) < 1e-6) >= 31, f'{joint} = {border}'


def test_a_set_has_the_same_colour_for_every_arm():
    from matplotlib.lines import Line2D

    colours = {}
    for name in ('ur3e', 'anthropomorphic_3r', 'puma560'):
        robot = robot_of(name)
        q = clear_pose(robot)
        figure = drawn(map_picture(robot, distance_map(robot, (1, 2), q, 15)))
        for line in figure.legends[0].findobj(Line2D):
            if line.get_label().endswith('= 0'):
                colours.setdefault(line.get_label(), set()).add(line.get_color())
    assert {'elbow = 0', 'shoulder = 0'} <= set(colours)
    assert all(len(seen) == 1 for seen in colours.values())
    assert colours['elbow = 0'] != colours['shoulder = 0']


def test_factors_of_any_names_are_told_apart():
    names = tuple(f'factor{k}' for k in range(7))
    assert len({color for color, _ in set_styles(names).values()}) == 7
    assert len(set_styles(tuple(f'factor{k}' for k in range(30)))) == 30


def test_the_two_joints_that_matter():
    assert joint_pair(robot_of('craig_3r'), None) == (1, 2)
    assert 0 not in joint_pair(robot_of('puma560'), None)
    assert joint_pair(robot_of('ur5e'), ['elbow_joint', 'q2']) == (2, 1)


def test_a_map_on_which_everything_is_singular_says_so():
    robot = robot_of('ur5e')
    numbers = distance_map(robot, (1, 2), np.zeros(6), 20)
    assert numbers.everywhere == ('wrist',)
    figure = drawn(map_picture(robot, numbers))
    assert 'singular: wrist = 0' in texts(figure)


@pytest.mark.slow
def test_the_workspace_of_two_links_is_a_ring():
    text = ks.bundled_robots()['planar_2r'].read_text().partition('known_poses')[0]
    robot = ks.robot_from_text(re.sub(r'constants:.*', 'constants: {L1: 1.0, L2: 0.6}', text))
    plane = plane_of(robot)
    assert (plane.name, plane.origin[2]) == ('xy', 0.0)
    space = workspace(robot, plane, 12_000)
    rows, columns = np.nonzero(np.isfinite(space.best))
    centres = space.corner + space.size * (np.column_stack([columns, rows]) + 0.5)
    radius = np.hypot(*centres.T)
    assert radius.min() > 0.4 - space.size
    assert radius.max() < 1.6 + space.size
    area = len(rows) * space.size**2
    assert area == pytest.approx(math.pi * (1.6**2 - 0.4**2), rel=0.03)
    critical = critical_points(robot, plane, 10)
    rings = np.hypot(*critical.points.T)
    assert np.all((np.abs(rings - 1.6) < 1e-6) | (np.abs(rings - 0.4) < 1e-6))
    assert set(critical.names) == {'elbow'}
    figure = drawn(workspace_picture(robot, space, critical))
    assert 'x (m)' in texts(figure)
    assert 'position singular: elbow' in texts(figure)
    assert 'largest distance to singularity' in texts(figure)


@pytest.mark.slow
@pytest.mark.parametrize('name', ['planar_2r', 'scara_hsr065', 'puma560'])
def test_the_colours_of_a_workspace_are_those_of_its_distances(name):
    robot = robot_of(name)
    plane = plane_of(robot)
    space = workspace(robot, plane, 500)
    figure = drawn(workspace_picture(robot, space, critical_points(robot, plane, 10)))
    low, high = figure.axes[0].images[0].get_clim()
    cells = space.best[np.isfinite(space.best)]
    # More than half of the cells nearer than 1 rad differ in colour from those at either end.
    nearer = cells[cells < 1.0]
    assert np.mean((nearer > low) & (nearer < high)) > 0.5
    assert low <= np.min(cells) + 1e-3
    assert high <= np.max(cells) + 1e-3
    assert (BEYOND in texts(figure)) == bool(np.any(cells == 1.0))


def test_what_is_farther_than_the_scale_has_a_colour_of_its_own():
    from matplotlib.figure import Figure

    figure = Figure()
    axes, rows = figure.subplots(), np.array([[0.0, 0.5], [math.nextafter(1.0, 0.0), 1.0]])
    (entry,) = draw_distances(figure, axes, rows, (0, 2, 0, 2), ColourScale(0.0, 1.0), 'away')
    assert entry.get_label() == BEYOND
    colours = axes.images[0].to_rgba(rows)
    assert tuple(colours[1, 1]) == entry.get_facecolor()
    assert not np.allclose(colours[1, 0], colours[1, 1], atol=0.1)
    rows[1, 1] = 0.9
    assert draw_distances(figure, axes, rows, (0, 2, 0, 2), ColourScale(0.0, 1.0), 'away') == []


@pytest.mark.parametrize(
    ('distance', 'words'),
    [
        (1.0, f'singular pose: {BEYOND}'),
        (0.9, 'singularity 0.9 rad (51.6°): elbow'),
    ],
)
def test_a_caption_says_no_distance_of_what_was_not_found(distance, words):
    robot = robot_of('planar_2r')
    near = dataclasses.replace(ks.singularity(robot, [0.0, 0.9]), distance=distance)
    assert nearness(robot, near).endswith(words)


def test_a_path_that_leaves_the_scale_says_where_it_ends():
    robot, t = robot_of('planar_2r'), np.linspace(0.0, 1.0, 40)
    q = np.column_stack([t, 0.3 + 1.2 * t])
    near = ks.singularity(robot, q)
    figure = drawn(
        measures_picture(robot, PlottedMotion(t, q, q, 'steps', False, np.zeros(0, int)))
    )
    assert np.any(near.distance == 1.0)
    assert BEYOND in texts(figure)


def test_the_singular_curves_of_craig_3r_are_circles_about_joint_2():
    robot = robot_of('craig_3r')
    L1, L2, L3 = (constant.value for constant in robot.description.constants)
    plane = plane_of(robot)
    assert plane.name == 'rz'
    points = critical_points(robot, plane, 300).points
    # The half plane folds what is beyond the axis over.
    away = [np.abs(np.hypot(points[:, 0] - side * L1, points[:, 1])) for side in (1.0, -1.0)]
    off = [np.abs(r - radius) for r in away for radius in (L2 + L3, abs(L2 - L3))]
    assert len(points) > 100
    assert np.max(np.min(off, axis=0)) < 1e-6


@pytest.mark.parametrize('name', ['puma560', 'scara_hsr065', 'offset_stanford_dh'])
def test_a_section_lies_in_its_plane_and_inside_the_limits(name):
    robot = robot_of(name)
    plane = plane_of(robot, 'xz', 0.05)
    q = np.random.default_rng(2).uniform(*finite_ranges(robot).T, (500, robot.dof))
    rows = section_rows(robot, q, plane)
    rows = rows[np.isfinite(rows[:, 0])]
    assert len(rows) > 100
    points = ks.forward_kinematics(robot, rows[:, 3:])[:, :3, 3]
    assert points[:, 1] == pytest.approx(np.full(len(rows), 0.05), abs=1e-8)
    assert np.array_equal(rows[:, :2], points[:, [0, 2]])
    assert np.array_equal(rows[:, 2], ks.singularity(robot, rows[:, 3:]).distance)
    assert np.all(rows[:, 3:] >= robot.limits[:, 0])
    assert np.all(rows[:, 3:] <= robot.limits[:, 1])


def test_the_half_plane_is_about_the_axis_of_joint_1():
    robot = robot_of('parallelogram_left')  # its first axis is y of the base
    plane = plane_of(robot)
    assert 'theta1 (m)' in plane.labels[0]
    assert plane.labels[1] == 'y (m)'
    assert plane.coordinates(np.array([3.0, -2.0, 4.0])) == pytest.approx([5.0, -2.0])


# Files.


@pytest.fixture
def simple():
    return arm_picture(robot_of('planar_2r'), np.array([0.3, 0.8]))


@pytest.mark.slow
@pytest.mark.parametrize('suffix', ['.PNG', '.svg', '.pdf'])
def test_a_picture_is_a_valid_file_and_the_same_each_time(simple, suffix, tmp_path):
    files = [tmp_path / f'{k}{suffix}' for k in 'ab']
    for file in files:
        save_picture(simple, file)
    first, second = (file.read_bytes() for file in files)
    assert first == second
    if suffix == '.svg':
        assert ElementTree.fromstring(first).tag.endswith('svg')
    elif suffix == '.pdf':
        assert first.startswith(b'%PDF-')
        assert b'CreationDate' not in first
    else:
        assert first.startswith(b'\x89PNG\r\n\x1a\n')
        assert int.from_bytes(first[16:20], 'big') > 500  # width
    assert sorted(path.name for path in tmp_path.iterdir()) == [f'a{suffix}', f'b{suffix}']


def test_settings_of_the_user_do_not_change_a_picture(simple, tmp_path):
    import matplotlib

    save_picture(simple, tmp_path / 'a.svg')
    with matplotlib.rc_context({'font.size': 30, 'axes.grid': False, 'lines.linewidth': 9}):
        save_picture(simple, tmp_path / 'b.svg')
    assert (tmp_path / 'a.svg').read_bytes() == (tmp_path / 'b.svg').read_bytes()


def test_a_failure_leaves_the_old_file_whole(simple, tmp_path, monkeypatch):
    file = tmp_path / 'a.png'
    file.write_text('old')

    def fail(*_):
        raise OSError(28, 'No space left on device')

    monkeypatch.setattr(output_file.os, 'replace', fail)
    with pytest.raises(PlotError, match='No space left on device'):
        save_picture(simple, file)
    assert file.read_text() == 'old'
    assert list(tmp_path.iterdir()) == [file]


# The command.


@pytest.mark.slow
@pytest.mark.parametrize(
    ('kind', 'dof'), [('arm', 1), ('arm', 7), ('velocity', 1), ('measures', 1), ('workspace', 1)]
)
def test_every_kind_of_random_arms(kind, dof, tmp_path, capsys, monkeypatch):
    from arms import arm_of

    monkeypatch.setattr(plotted_motion, 'SAMPLES', 101)
    file = tmp_path / 'arm.yaml'
    file.write_text(arm_of(f'modified-{dof}-0').text())
    monkeypatch.chdir(tmp_path)
    options = ['--points', '1000'] if kind == 'workspace' else []
    if kind == 'velocity':
        # The smooth path of seven joints takes seconds to find.
        options = ['--path', 'sine']
    assert main(['plot', str(file), kind, *options]) == 0, capsys.readouterr().err
    name = ks.load_robot(file).name
    assert capsys.readouterr().out == f'wrote {name}_{kind}.png\n'
    assert (tmp_path / f'{name}_{kind}.png').exists()


def test_ik_tells_by_its_exit_code_that_nothing_was_found(tmp_path, capsys):
    command = ['plot', 'planar_2r', 'ik', '--save', str(tmp_path / 'a.svg'), '--xyz']
    assert main([*command, '1.0,', '0.5', '0']) == 0
    assert main([*command, '9,0,0']) == 1
    out, err = capsys.readouterr()
    assert out.count('wrote') == 2
    assert err.startswith('planar_2r: no joint positions')


@pytest.mark.parametrize(
    ('arguments', 'code', 'words'),
    [
        ('ur5e arms', 2, ("'arms'", 'arm, ik, family, velocity, measures, map, workspace')),
        ('arm ur5e', 2, ('robot comes first',)),
        ('ur5f arm', 2, ("'ur5e'",)),
        ('ur5e arm --q 1,2', 2, ('ur5e has 6 joints',)),
        ('ur5e map --path sine', 2, ('--path', 'velocity and measures', '--joints')),
        ('ur5e --workers dask://h:1', 2, ('--workers', 'map and workspace')),
        ('ur5e ik', 2, ('--xyz 0.3,0.1,0.4',)),
        ('ur5e ik --xyz 1,2', 2, ('3 numbers',)),
        ('ur5e ik --xyz 1,2,3 --rpy 0,0,0 --quaternion 0,0,0,1', 2, ('give one',)),
        ('craig_3r map --joints q1,q4', 2, ("'q4'", 'q1, q2, q3')),
        ('craig_3r map --joints q1', 2, ('two different joints', '--joints q1,q2')),
        ('craig_3r map --joints q1,q1', 2, ('two different joints',)),
        ('craig_3r map --points 1', 2, ('--points: 1', '2 to 4000')),
        ('craig_3r workspace --plane zz', 2, ("'zz'", 'rz, xy, xz, yz')),
        ('craig_3r workspace --plane rz --at 1', 2, ('--at', '--plane xy, xz or yz')),
        ('craig_3r workspace --plane xy --at 9 --points 1000', 1, ('plane z = 9',)),
        ('craig_3r workspace --workers here', 1, ('dask://HOST:PORT',)),
        ('craig_3r velocity --path no.csv', 2, ('no.csv', 'CSV file')),
        ('craig_3r --save a.jpg', 2, ("'.jpg'", '.png, .svg, .pdf')),
        ('craig_3r --save a', 2, ('suffix', '.png, .svg, .pdf')),
        ('craig_3r --save /no/such/folder/a.png', 1, ('No such file',)),
    ],
)
def test_what_cannot_be_drawn_is_refused_in_a_sentence(
    arguments, code, words, capsys, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    assert main(['plot', *arguments.split()]) == code
    out, err = capsys.readouterr()
    for word in words:
        assert word in ' '.join(err.split())
    assert 'Traceback' not in err
    assert out == ''
    assert not list(tmp_path.iterdir())


def test_errors_about_a_picture_have_codes(tmp_path):
    craig, planar = robot_of('craig_3r'), robot_of('planar_2r')
    slider = ks.robot_from_text(
        ODD.replace('revolute', 'prismatic').replace('d: 0, theta: q1', 'd: q1, theta: 0')
    )
    for code, word, call in (
        ('unknown-name', "'zz'", lambda: plane_of(craig, 'zz')),
        ('conflict', '--at', lambda: plane_of(craig, 'rz', 1.0)),
        ('conflict', 'odd', lambda: plane_of(slider, 'rz')),
        ('too-few', 'odd', lambda: joint_pair(slider, None)),
        ('unknown-name', "'q4'", lambda: joint_pair(craig, ['q1', 'q4'])),
        ('wrong-length', 'q1, q2, q3', lambda: joint_pair(craig, ['q1'])),
        ('missing-file', 'no.csv', lambda: motion_of(planar, 'no.csv')),
        ('unsupported', "'.jpg'", lambda: picture.suffix_of(tmp_path / 'a.jpg')),
        ('unsupported', 'suffix', lambda: picture.suffix_of(tmp_path / 'a')),
        ('unreachable', 'z = 9', lambda: workspace(planar, plane_of(craig, 'xy', 9.0), 100)),
    ):
        with refused(PlotError, code, word):
            call()


def test_without_a_display_show_says_so(capsys, monkeypatch):
    for name in ('DISPLAY', 'WAYLAND_DISPLAY'):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv('MPLBACKEND', 'agg')
    assert main(['plot', 'planar_2r', '--show']) == 1
    said = capsys.readouterr().err
    assert said.startswith('--show: no window')
    assert '--save FILE' in said


def test_without_matplotlib_the_sentence_says_what_to_install(capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, 'matplotlib.figure', None)
    assert main(['plot', 'planar_2r']) == 1
    assert "pip install '.[plot]'" in capsys.readouterr().err


@pytest.mark.slow
def test_the_command_line_loads_matplotlib_only_to_draw():
    code = (
        'import sys, kinematics_service.cli.commands\n'
        "print('matplotlib' in sys.modules, 'distributed' in sys.modules)"
    )
    result = subprocess.run(
        [sys.executable, '-c', code], capture_output=True, text=True, check=True, timeout=60
    )
    assert result.stdout.split() == ['False', 'False']


@pytest.mark.parametrize(
    ('header', 'separator'),
    [('stamp position.q1 position.q2', ';'), ('timestamp actual_q_0 actual_q_1', '\t')],
)
def test_a_table_that_is_audited_is_drawn(header, separator, tmp_path):
    file, page = tmp_path / 'run.csv', tmp_path / 'velocity.svg'
    rows = [header.split(), *([f'{k / 50}', f'{k / 70}', '-0.5'] for k in range(60))]
    file.write_text('\n'.join(separator.join(row) for row in rows))
    with open_source(file, Selection(robot_of('planar_2r'))) as source:
        assert sum(map(len, source.blocks)) == 60
    path = ['--path', str(file), '--save', str(page)]
    assert main(['plot', 'planar_2r', 'velocity', *path]) == 0
    assert page.exists()


@pytest.mark.parametrize('suffix', ['.csv'])
def test_a_recording_along_which_nothing_moves_in_time(suffix, tmp_path, capsys):
    file = tmp_path / f'r{suffix}'
    file.write_text('stamp,position.q1,position.q2\n1,0,0\n1,0,0\n')
    assert main(['plot', 'planar_2r', 'measures', '--path', str(file)]) == 2
    assert f'{file}: all rows' in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.parametrize(('name', 'share'), [('puma560', 1), ('five_bar', 2)])
def test_pictures_of_arms_with_loops_try_fewer_positions(name, share, monkeypatch):
    tried = []

    def workspace(robot, where, points, workers):
        tried.append(points)
        raise PlotError('enough')

    monkeypatch.setattr('kinematics_service.apps.pictures.commands.plot.workspace', workspace)
    for points in ((), ('--points', '5000')):
        assert main(['plot', name, 'workspace', *points]) != 0
    assert tried == [WORKSPACE_POINTS // share, 5000]


def test_each_joint_over_the_arcs_of_a_redundant_arm():
    robot = ks.load_robot('kuka_iiwa14')
    target = ks.forward_kinematics(robot, [0.4, 0.7, -0.3, -1.2, 0.5, 0.9, -0.2])
    result = ks.inverse_kinematics(robot, target)
    figure = drawn(family_picture(robot, result))
    arcs = result.families[0].intervals
    assert len(figure.axes) == 7
    for j, axes in enumerate(figure.axes):
        lines = axes.get_lines()[: len(arcs)]
        for line, arc in zip(lines, arcs):
            assert np.array_equal(line.get_ydata(), arc.q[:, j])
        limits = {float(line.get_ydata()[0]) for line in axes.get_lines()[len(arcs) :]}
        assert limits == set(robot.limits[j].tolist())


def test_an_arm_without_arcs_has_no_picture_of_them(capsys):
    command = ['plot', 'ur5e', 'family', '--xyz', '0.3,-0.2,0.4', '--rpy', '3,0,1']
    assert main(command) == 1
    assert capsys.readouterr().err.startswith('ur5e has no arc')
