// SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
// SPDX-License-Identifier: Apache-2.0

#include "pinocchio.hpp"

namespace
{
const pinocchio::Model model = arm_of_pinocchio();
pinocchio::Data data(model);
const pinocchio::FrameIndex tool = model.getFrameId("tool");
using Rows = Eigen::Matrix<double, 3, 4, Eigen::RowMajor>;

void write(double * T)
{
  const pinocchio::SE3 & pose = pinocchio::updateFramePlacement(model, data, tool);
  Eigen::Map<Rows> out(T);
  out.leftCols<3>() = pose.rotation();
  out.col(3) = pose.translation();
}
}  // namespace

void pose_of_pinocchio(const double * q, double * T, double *)
{
  pinocchio::forwardKinematics(model, data, Eigen::Map<const Eigen::VectorXd>(q, joints));
  write(T);
}

void jacobian_of_pinocchio(const double * q, double * T, double * J)
{
  pinocchio::computeJointJacobians(model, data, Eigen::Map<const Eigen::VectorXd>(q, joints));
  write(T);
  Eigen::Map<Eigen::Matrix<double, 6, joints, Eigen::RowMajor>> out(J);
  out.setZero();
  pinocchio::getFrameJacobian(model, data, tool, pinocchio::LOCAL_WORLD_ALIGNED, out);
}
