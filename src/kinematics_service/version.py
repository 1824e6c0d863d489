"""The version of the package, from `package.xml` alone."""

from importlib import metadata

__version__ = metadata.version('kinematics_service')
