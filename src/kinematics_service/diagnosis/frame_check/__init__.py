"""
Compares the tool poses of a robot file with those of a second source, and finds the cause of a
difference.
"""

from ...errors import FramesError as FramesError
from .causes import TestedCause as TestedCause
from .diagnosis import FrameDiagnosis as FrameDiagnosis
from .diagnosis import diagnose_frames as diagnose_frames
from .errors import PoseLimit as PoseLimit
from .judgement import FrameLimits as FrameLimits
