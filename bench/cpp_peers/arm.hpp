// SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
// SPDX-License-Identifier: Apache-2.0

// The arm of a run: `arm_of_run.hpp` is written by bench/cpp.py.
#pragma once

#include "arm_of_run.hpp"

// Joint k turns about, or slides along, the z axis of the frame after still[k]; still[joints] is
// the tool. Matrices are 3 x 4, row-major.
extern const double still[joints + 1][12];
extern const bool slides[joints];

// Each function computes 3 x 4 T, or T and 6 x joints J, row-major or as its library stores them.
using Call = void (*)(const double * q, double * T, double * J);
void pose_of_header(const double * q, double * T, double * J);
void jacobian_of_header(const double * q, double * T, double * J);
void pose_of_kdl(const double * q, double * T, double * J);
void jacobian_of_kdl(const double * q, double * T, double * J);
void pose_of_pinocchio(const double * q, double * T, double * J);
void jacobian_of_pinocchio(const double * q, double * T, double * J);
void pose_of_pinocchio_code(const double * q, double * T, double * J);
void jacobian_of_pinocchio_code(const double * q, double * T, double * J);
