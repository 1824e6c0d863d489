"""
Modules of apps that others ask for, by their task. The core imports no app, and an app few
others: they find commands by the table in `cli/commands.py`, and these modules by the table here.
"""

import os
from importlib import import_module
from typing import Any

# Below `apps/`.
APP_MODULES = {
    'check': 'checking.commands.check',
    'factory calibration': 'calibration.factory',
    'second source': 'calibration.second_source_watch',
    'recording': 'recordings.readers.recording',
    'motions': 'demo.motions.trajectory',
    # What a notebook shows of a result.
    'html': 'pictures.notebook',
    'latex': 'formulas.derive.output.notebook',
}


def has_app(name: str) -> bool:
    """Return whether an app is there: to remove it is to delete its folder."""
    # Not by find_spec, which imports the folder above.
    return os.path.isfile(f'{os.path.dirname(__file__)}/apps/{name}/__init__.py')


def app_module(task: str) -> Any:
    """Return the module of an app that does a task; None if the app was removed."""
    name = APP_MODULES[task]
    if not has_app(name.partition('.')[0]):
        return None
    return import_module(f'{__package__}.apps.{name}')
