# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Results at a prompt and in a notebook: a line, a table, a sketch, formulas."""

import dataclasses
import functools
from xml.etree import ElementTree

import numpy as np
import pytest
from arms import poses, robot_of

import kinematics_service as ks
from kinematics_service.apps.pictures.plots.ranges import clear_pose
from kinematics_service.apps.pictures.plots.skeleton import skeleton_of
from kinematics_service.apps.pictures.sketch import HEIGHT, VIEW, WIDTH, sketch

# Few and many joints, slides, no limits, redundant, closed loops in a plane and in space.
SOME = [
    'planar_2r',
    'rrp_elementary',
    'scara_hsr065',
    'ur5e',
    'kuka_iiwa14',
    'five_bar',
    'flexpicker',
]
# A line at a prompt, where joints have no long names.
LINE = 200


@functools.cache
def shown_pose(name):
    return clear_pose(robot_of(name))


def well_formed(html):
    return ElementTree.fromstring(html)


@pytest.mark.parametrize('name', SOME)
def test_every_result_is_a_line_and_a_page(name):
    robot, q = robot_of(name), shown_pose(name)
    state = ks.evaluate(robot, q, np.ones_like(q))
    batch = np.stack([q, q])
    results = [robot, state, ks.singularity(robot, q), ks.evaluate(robot, batch)]
    results.append(ks.singularity(robot, batch))
    for result in results:
        assert '\n' not in repr(result)
        assert len(repr(result)) < LINE
        page = well_formed(result._repr_html_())
        assert ''.join(page.itertext()).startswith(repr(result))
    numbers = [cell.text for cell in well_formed(state._repr_html_()).iter('td')]
    for value in (*state.position, *state.jacobian[:, -1], *state.twist):
        assert f'{round(value, 4) + 0.0:.4f}' in numbers


@pytest.mark.parametrize('name', SOME)
def test_the_sketch_holds_the_whole_arm_as_it_is_seen(name):
    robot, q = robot_of(name), shown_pose(name)
    drawn = sketch(robot, q)
    lines = [line.attrib for line in well_formed(drawn).iter('line')]
    arm = [line for line in lines if line['stroke-width'] == '4']
    segments = skeleton_of(robot, q).segments
    assert len(arm) == len(segments)
    assert drawn.count('<rect') == sum(axis.slides for axis in skeleton_of(robot, q).axes)
    ends = np.array([[line[key] for key in ('x1', 'y1', 'x2', 'y2')] for line in arm], float)
    assert np.all((ends[:, ::2] >= 0) & (ends[:, ::2] <= WIDTH))
    assert np.all((ends[:, 1::2] >= 0) & (ends[:, 1::2] <= HEIGHT))
    # One scale for both directions, and up is up.
    there = np.array([np.concatenate([VIEW @ one.start, VIEW @ one.end]) for one in segments])
    x, y = there[:, ::2].ravel(), there[:, 1::2].ravel()
    scales = [
        np.ptp(pixels) / np.ptp(seen)
        for pixels, seen in ((ends[:, ::2], x), (ends[:, 1::2], y))
        if np.ptp(seen) > 0.1 * robot.singularity.task.reach
    ]
    assert scales == pytest.approx([scales[0]] * len(scales), rel=0.02)
    assert VIEW[1] @ [0.0, 0.0, 1.0] < 0.0


def test_a_singularity_says_its_level_and_distance():
    robot = ks.load_robot('planar_2r')
    assert repr(ks.singularity(robot, [0, 0.5])) == (
        'Singularity(OK, distance 0.5 rad, determinant 0.4794, rank 2 of 2)'
    )
    assert 'distance none found' in repr(ks.singularity(robot, [0, 1.5]))
    assert repr(ks.singularity(robot, [0, 0.0])).startswith('Singularity(ERROR, distance 0 rad')
    assert 'manipulability' in repr(ks.singularity('panda', [0, -1, 0, -2, 0, 1, 0]))
    levels = [[0, 0.0], [0, 1.0], [0, -1.0]]
    assert repr(ks.singularity(robot, levels)) == 'Singularity(3 poses: 2 OK, 1 ERROR)'
    assert repr(ks.singularity(robot, np.zeros((0, 2)))) == 'Singularity(0 poses: none)'


def test_solutions_are_listed_with_what_they_are():
    robot = ks.load_robot('ur5e')
    q = poses(robot)[3]
    found = ks.inverse_kinematics(robot, ks.forward_kinematics(robot, q))
    assert repr(found).startswith(f'IkResult(solved, {len(found)} solutions, closed form')
    assert repr(found).endswith('no others)')
    rows = list(well_formed(found._repr_html_()).iter('tr'))
    assert len([row for row in rows if len(row) == 9]) == 1 + len(found)
    far = ks.inverse_kinematics(robot, [9.0, 0.0, 0.0])
    assert repr(far).startswith('IkResult(unreachable, 0 solutions')
    one = ks.inverse_kinematics(robot, ks.forward_kinematics(robot, q), all_solutions=False)
    assert repr(one).endswith('others were not looked for)')
    assert far.reason in ''.join(well_formed(far._repr_html_()).itertext())


def test_names_are_text_and_never_markup():
    robot = ks.robot_from_text(
        'robot: a\nsource: "<b>&"\nconvention: standard\njoints: [{name: q1, type: revolute}]\n'
        'links:\n  - {a: 1, alpha: 0, d: 0, theta: q1}\n'
    )
    assert '<b>&' in ''.join(well_formed(robot._repr_html_()).itertext())


@pytest.mark.parametrize(('name', 'whole'), [('planar_2r', True), ('ur5e', False)])
def test_a_derivation_shows_its_formulas(name, whole):
    derivation = ks.derive(ks.load_robot(name))
    assert repr(derivation).startswith(f"Derivation('{name}', rank ")
    shown = derivation._repr_latex_()
    assert shown.startswith('$$')
    assert shown.endswith('$$')
    assert (r'\texttt{derivation.jacobian}' in shown) is not whole
    assert r'\det J &= ' in shown


def test_a_determinant_that_is_not_written_out_is_not_promised():
    derivation = ks.derive(ks.load_robot('planar_2r'))
    found = derivation.singular_set
    unwritten = dataclasses.replace(found.determinant, expression=None)
    derivation = dataclasses.replace(
        derivation, singular_set=dataclasses.replace(found, determinant=unwritten, complete=False)
    )
    assert 'too many minors' in derivation._repr_latex_()
    assert 'determinant' not in derivation._repr_latex_()
    assert repr(derivation).endswith('elbow, perhaps others)')


@pytest.mark.parametrize('name', ['crank_slider'])
def test_a_derivation_without_a_square_jacobian_shows_itself(name):
    assert '$$' in ks.derive(ks.load_robot(name))._repr_latex_()
