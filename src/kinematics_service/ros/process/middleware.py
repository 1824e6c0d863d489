"""Fast DDS profiles: settings of the middleware beyond ROS's quality of service."""

import os
from collections.abc import MutableMapping
from pathlib import Path

PROFILES = Path(__file__).with_name('fastdds.xml')
# Fast DDS (2.14, of Jazzy) reads profiles from the file named by the variable, and from one in the
# working directory unless it is told to skip that.
VARIABLE = 'FASTRTPS_DEFAULT_PROFILES_FILE'
LOCAL = 'DEFAULT_FASTRTPS_PROFILES.xml'


def take_profiles(environment: MutableMapping[str, str] = os.environ) -> bool:
    """
    Let Fast DDS read this package's profiles; return False if the user has profiles, which stay.

    It must be called before the first participant is made, and has no effect on another
    middleware.
    """
    if environment.get(VARIABLE) or Path(LOCAL).exists():
        return False
    environment[VARIABLE] = str(PROFILES)
    return True
