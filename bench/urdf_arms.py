# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Arms of other people's URDFs, as the package `rtb-data` has them."""

import os
import tempfile
from pathlib import Path

import kinematics_service as ks

# File, base and tip of a chain.
CHAINS = (
    ('abb_irb140_description/urdf/irb140.urdf', 'base_link', 'tool0'),
    ('kuka_description/kuka_kr16/urdf/kr16_2.urdf', 'base_link', 'tool0'),
    ('kuka_description/kuka_kr120/urdf/kr120r2500pro.urdf', 'base_link', 'tool0'),
    ('kuka_description/kuka_kr210/urdf/kr210l150.urdf', 'base_link', 'tool0'),
    ('kuka_description/kuka_lbr_iiwa/urdf/lbr_iiwa_14_r820.urdf', 'base_link', 'tool0'),
    ('unimation_puma560_description/urdf/puma560_robot.urdf', 'link1', 'link7'),
    ('lynxmotion_al5d_description/urdf/al5d_robot.urdf', 'base', 'link4'),
    ('trossen_descriptions/urdf/px100.urdf.xacro', 'base_link', 'ee_gripper_link'),
    ('trossen_descriptions/urdf/vx300.urdf.xacro', 'base_link', 'ee_gripper_link'),
    ('trossen_descriptions/urdf/wx250.urdf.xacro', 'base_link', 'ee_gripper_link'),
    ('qut_frankie_description/robots/panda_arm.urdf.xacro', 'panda_link0', 'panda_link8'),
)


def _read(path, folder):
    if path.suffix != '.xacro':
        return path.read_text()
    # xacro looks for packages where ROS would have installed them.
    index = folder / 'share/ament_index/resource_index/packages'
    if not index.exists():
        index.mkdir(parents=True)
        for package in path.parents[2].iterdir():
            if package.is_dir():
                (folder / 'share' / package.name).symlink_to(package)
                (index / package.name).touch()
    os.environ['AMENT_PREFIX_PATH'] = str(folder)
    import xacro

    # A robot file takes no name that begins with a slash.
    return xacro.process_file(str(path)).toxml().replace('="/', '="')


def urdf_arms():
    """Yield a name and a robot of each chain."""
    import rtbdata

    descriptions = Path(rtbdata.__file__).parent / 'xacro'
    with tempfile.TemporaryDirectory() as folder:
        for name, base, tip in CHAINS:
            path = descriptions / name
            text = _read(path, Path(folder))
            yield f'URDF {path.name.split(".")[0]}', ks.import_urdf(text, base, tip).robot
