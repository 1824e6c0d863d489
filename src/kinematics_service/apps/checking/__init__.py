"""
Is this the robot of the file: `check`, and the frame check, with which audits and calibrations
begin.

In: joint positions with poses of a second source, or the known poses of a robot file. Hypotheses
(`hypotheses.py`: units, signs, offsets, lags, other orders of angles) are fitted and compared
(`causes.py`); out comes a diagnosis that names the cause (`diagnosis.py`).
"""
