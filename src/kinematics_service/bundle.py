"""
The bundled robots, and how a robot is found by name or by path.

"""

import difflib
import os
from collections.abc import Mapping
from importlib import resources
from pathlib import Path

from .errors import RobotNotFoundError


def _folder() -> Path:
    try:
        return Path(str(resources.files('kinematics_service.config')))
    except ModuleNotFoundError:
        # `colcon build --symlink-install` knows one source folder only; the checkout has both.
        return Path(__file__).resolve().parents[2] / 'config'


def bundled_robots() -> Mapping[str, Path]:
    """
    Return the files of the bundled robots by name, in alphabetical order.

    """
    return {path.stem: path for path in sorted(_folder().glob('*.yaml'))}


def find_robot_file(name: str | os.PathLike[str]) -> Path:
    """
    Return the file of a robot given by bundled name or by path.

    Raises
    ------
    RobotNotFoundError
        Neither a file nor a bundled robot; the message lists the names.

    """
    text = os.fspath(name)
    bundled = bundled_robots()
    if text in bundled:
        return bundled[text]
    path = Path(text)
    looks_like_a_path = path.suffix in ('.yaml', '.yml') or path.name != text
    if path.exists() or looks_like_a_path:
        return path
    near = difflib.get_close_matches(text, bundled, n=1)
    hint = f'did you mean {near[0]!r}? ' if near else ''
    raise RobotNotFoundError(
        f'no robot {text!r}: {hint}give a YAML file or one of: {", ".join(bundled)}'
    )
