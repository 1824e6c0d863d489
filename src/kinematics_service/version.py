"""The version of the package, which stands in `package.xml` alone."""

from importlib import metadata

__version__ = metadata.version('kinematics_service')
