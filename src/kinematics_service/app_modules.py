"""
Modules of apps that the core asks for, by their task. The core imports no app: it finds its
commands by the table in `cli/commands.py`, and these modules by the table here.
"""

from importlib import import_module
from typing import Any

# Below `apps/`.
APP_MODULES = {
    'check': 'checking.commands.check',
    'second source': 'calibration.second_source',
    # What a notebook shows of a result.
    'html': 'pictures.notebook',
    'latex': 'formulas.derive.output.notebook',
}


def app_module(task: str) -> Any:
    """Return the module of an app that does a task; None if the app's folder was removed."""
    from importlib.util import find_spec  # which the package alone does without

    name = APP_MODULES[task]
    if find_spec(f'{__package__}.apps.{name.partition(".")[0]}') is None:
        return None
    return import_module(f'{__package__}.apps.{name}')
