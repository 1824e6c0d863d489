"""Read the version of the package, which comes from `package.xml`."""

from importlib import metadata

__version__ = metadata.version('kinematics_service')
