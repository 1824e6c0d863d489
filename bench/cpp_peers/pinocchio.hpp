// SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <pinocchio/algorithm/frames.hpp>
#include <pinocchio/algorithm/jacobian.hpp>
#include <pinocchio/algorithm/joint-configuration.hpp>
#include <pinocchio/multibody.hpp>

#include "arm.hpp"

inline pinocchio::SE3 placement(const double * M)
{
  const Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>> T(M);
  return pinocchio::SE3(T.leftCols<3>(), T.col(3));
}

inline pinocchio::Model arm_of_pinocchio()
{
  pinocchio::Model model;
  pinocchio::JointIndex joint = 0;
  for (int k = 0; k < joints; ++k) {
    const auto name = "joint_" + std::to_string(k);
    joint = slides[k]
      ? model.addJoint(joint, pinocchio::JointModelPZ(), placement(still[k]), name)
      : model.addJoint(joint, pinocchio::JointModelRZ(), placement(still[k]), name);
  }
  model.addFrame(pinocchio::Frame("tool", joint, placement(still[joints]), pinocchio::OP_FRAME));
  return model;
}
