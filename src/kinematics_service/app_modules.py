# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Find the module that does a task, such as `check`. The module belongs to an app, an optional part
of the package in the folder `apps`.

The core of the package does not import apps, and an app imports few other apps. The core finds the
commands of apps in the table `APPS` of `cli/commands.py`, and other modules of apps in the table
`APP_MODULES`.
"""

import os
from importlib import import_module
from typing import Any

# Maps each task to the module, in the folder `apps`, that does the task.
APP_MODULES = {
    'check': 'checking.commands.check',
    'factory calibration': 'calibration.factory',
    'second source': 'calibration.second_source_watch',
    'recording': 'recordings.readers.recording',
    'motions': 'demo.motions.trajectory',
    # The next two modules show results in a notebook.
    'html': 'pictures.notebook',
    'latex': 'formulas.derive.output.notebook',
}


def has_app(name: str) -> bool:
    """Return whether an app is installed: the folder of the app exists."""
    # Look for the file of the app. `find_spec` would import the package `apps`.
    return os.path.isfile(f'{os.path.dirname(__file__)}/apps/{name}/__init__.py')


def app_module(task: str) -> Any:
    """Return the module that does a task, or None if the app of the task was removed."""
    name = APP_MODULES[task]
    if not has_app(name.partition('.')[0]):
        return None
    return import_module(f'{__package__}.apps.{name}')
