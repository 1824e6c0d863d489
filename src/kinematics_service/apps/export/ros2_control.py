# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Write an arm as an ament package for ros2_control: a plugin for `kinematics_interface`.

The package has the header of `export --cpp`, and `plugin.cpp` of this folder, which serves the
base, the tool and the points of the robot file as links. Texts between @ are replaced by those of
the arm.
"""

import re
from collections.abc import Iterator, Mapping
from html import escape
from importlib.resources import files
from pathlib import Path

from ...errors import KinematicsError
from ...output_file import write_file
from ...robot.loops import moving_variables
from ...robot.robot import Robot
from ...version import __version__
from .header import function_ends, header_of, quoted

CMAKE = """\
cmake_minimum_required(VERSION 3.16)
project(@PACKAGE@ LANGUAGES CXX)

if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release)
endif()

find_package(ament_cmake REQUIRED)
find_package(Eigen3 REQUIRED NO_MODULE)
find_package(kinematics_interface REQUIRED)
find_package(pluginlib REQUIRED)

add_library(${PROJECT_NAME} SHARED src/plugin.cpp)
target_compile_features(${PROJECT_NAME} PUBLIC cxx_std_17)
target_include_directories(${PROJECT_NAME} PUBLIC
  $<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}/include>
  $<INSTALL_INTERFACE:include/${PROJECT_NAME}>)
target_link_libraries(${PROJECT_NAME} PUBLIC
  Eigen3::Eigen kinematics_interface::kinematics_interface pluginlib::pluginlib)
if(NOT MSVC)
  # Without fused multiply-add the results have the bits of kinematics_service on every processor.
  target_compile_options(${PROJECT_NAME} PRIVATE
    -Wall -Wextra -Wconversion -Wpedantic -ffp-contract=off)
endif()

pluginlib_export_plugin_description_file(kinematics_interface plugin.xml)
install(DIRECTORY include/ DESTINATION include/${PROJECT_NAME})
install(TARGETS ${PROJECT_NAME} EXPORT export_${PROJECT_NAME}
  ARCHIVE DESTINATION lib LIBRARY DESTINATION lib RUNTIME DESTINATION bin)
ament_export_targets(export_${PROJECT_NAME} HAS_LIBRARY_TARGET)
ament_export_dependencies(Eigen3 kinematics_interface pluginlib)
ament_package()
"""
PACKAGE_XML = """\
<?xml version="1.0"?>
<package format="3">
  <name>@PACKAGE@</name>
  <version>0.0.0</version>
  <description>Kinematics of @ROBOT@ for ros2_control</description>
  <!-- Replace name and address by yours. A later export leaves this file as it is. -->
  <maintainer email="you@example.com">TODO: your name</maintainer>
  <!-- The licence of the program that wrote the code. Replace it if the numbers have another. -->
  <license>Apache-2.0</license>
  <buildtool_depend>ament_cmake</buildtool_depend>
  <depend>eigen</depend>
  <depend>kinematics_interface</depend>
  <depend>pluginlib</depend>
  <export>
    <build_type>ament_cmake</build_type>
  </export>
</package>
"""
PLUGIN_XML = """\
<library path="@PACKAGE@">
  <class name="@PACKAGE@/Kinematics"
         type="@PACKAGE@::Kinematics"
         base_class_type="kinematics_interface::KinematicsInterface">
    <description>Kinematics of @ROBOT@, @DOF@ joints, links @LINK_NAMES@</description>
  </class>
</library>
"""


def write_package(robot: Robot, folder: Path) -> str:
    """
    Write an ament package with a plugin for an arm into a folder, and return the package's name.

    A folder that has this package already gets new files. Its `package.xml` stays as it is,
    because users write their names into it.

    Raises
    ------
    KinematicsError
        The folder has other files, it cannot be written, or no header can be made of the arm.
    """
    package = package_name(robot)
    texts = package_files(robot)
    try:
        written = folder / 'package.xml'
        if written.exists() and f'<name>{package}</name>' in written.read_text(encoding='utf-8'):
            del texts['package.xml']
        elif folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
            raise KinematicsError(
                f'{folder}: exists and is not the package {package}; give a new or empty folder'
            )
        for name, text in texts.items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            write_file(folder / name, text)
    except OSError as error:
        raise KinematicsError(f'{folder}: cannot be written: {error.strerror}') from None
    return package


def package_files(robot: Robot) -> dict[str, str]:
    """
    Return the text of each file of an arm's package, by the path in the package.

    Raises
    ------
    KinematicsError
        No header can be made of the arm.
    """
    package = package_name(robot)
    links = list(_links(robot))
    values = {
        'PACKAGE': package,
        'ROBOT': robot.name,
        'DOF': str(robot.dof),
        'ABOUT': f'{robot.name}, made by kinematics_service {__version__}',
        'LINKS': ',\n'.join(f'  {{{quoted(name)}, {rest}}}' for name, rest in links),
        'ENTRIES': ', '.join(f'{{{joint}, {row}}}' for joint, row in _entries(robot)),
    }
    plugin = files(__package__).joinpath('plugin.cpp').read_text(encoding='utf-8')
    in_xml = {'LINK_NAMES': ', '.join(name for name, _ in links), **values}
    in_xml = {key: escape(value) for key, value in in_xml.items()}
    return {
        'package.xml': _filled(PACKAGE_XML, in_xml),
        'plugin.xml': _filled(PLUGIN_XML, in_xml),
        'CMakeLists.txt': _filled(CMAKE, values),
        'src/plugin.cpp': _filled(plugin, values),
        f'include/{package}/{robot.name}.hpp': header_of(robot, cpp=True),
    }


def package_name(robot: Robot) -> str:
    """Return the name of an arm's package; names of packages have no capital letters."""
    return f'kinematics_interface_{robot.name.lower()}'


def _links(robot: Robot) -> Iterator[tuple[str, str]]:
    # Yield name and other values of each Link of plugin.cpp: the base, the tool and the points.
    yield robot.base_frame, '0, nullptr'
    yield robot.tool_frame, f'{robot.rows}, arm::jacobian'
    ends = function_ends(robot)
    for point in robot.description.points:
        yield point.name, f'{point.row}, arm::jacobian{ends[point.name]}'


def _entries(robot: Robot) -> Iterator[tuple[int, int]]:
    # Yield each joint and row of the table in which the joint, or a loop that it moves, occurs.
    links = robot.description.links
    for row in range(1, robot.rows + 1):
        moving = moving_variables(robot.description, links[row - 1 : row])
        yield from ((j, row) for j, name in enumerate(robot.variables) if name in moving)


def _filled(template: str, values: Mapping[str, str]) -> str:
    return re.sub('@([A-Z_]+)@', lambda found: values[found[1]], template)
