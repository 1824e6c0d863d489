# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
# Declare the functions of Python's math module that the kernel calls; the compiled kernel takes
# them from C's math.h.
cdef extern from "<math.h>" nogil:
    double atan2(double, double)
    double ceil(double)
    double copysign(double, double)
    double cos(double)
    double exp(double)
    double floor(double)
    double fmod(double, double)
    bint isfinite(double)
    bint isnan(double)
    double log(double)
    double pow(double, double)
    double remainder(double, double)
    double sin(double)
    double sqrt(double)
