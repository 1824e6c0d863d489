"""What is asked of the middleware beyond the quality of service that ROS knows."""

import os
from collections.abc import MutableMapping
from pathlib import Path

PROFILES = Path(__file__).with_name('fastdds.xml')
# Where Fast DDS looks for profiles (2.14, of Jazzy): the file named by the variable, and one in
# the working directory unless it is told to skip that.
VARIABLE = 'FASTRTPS_DEFAULT_PROFILES_FILE'
LOCAL = 'DEFAULT_FASTRTPS_PROFILES.xml'


def take_profiles(environment: MutableMapping[str, str] = os.environ) -> bool:
    """
    Let Fast DDS read our profiles; return False where the user has profiles, which stand.

    To be called before the first participant is made; means nothing to another middleware.
    """
    if environment.get(VARIABLE) or Path(LOCAL).exists():
        return False
    environment[VARIABLE] = str(PROFILES)
    return True
