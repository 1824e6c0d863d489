// SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
// SPDX-License-Identifier: Apache-2.0

// Write pinocchio_code.c: pose and Jacobian by Pinocchio with numbers of CasADi, common
// subexpressions joined.
#include <casadi/casadi.hpp>
#include <pinocchio/autodiff/casadi.hpp>

#include "pinocchio.hpp"

int main()
{
  using Number = casadi::SX;
  const auto model = arm_of_pinocchio().cast<Number>();
  pinocchio::DataTpl<Number> data(model);
  const auto tool = model.getFrameId("tool");
  const Number q = Number::sym("q", joints);
  Eigen::Matrix<Number, Eigen::Dynamic, 1> positions(joints);
  for (int k = 0; k < joints; ++k) {
    positions[k] = q(k);
  }
  pinocchio::computeJointJacobians(model, data, positions);
  const auto & pose = pinocchio::updateFramePlacement(model, data, tool);
  Eigen::Matrix<Number, 6, Eigen::Dynamic> jacobian(6, joints);
  jacobian.setZero();
  pinocchio::getFrameJacobian(model, data, tool, pinocchio::LOCAL_WORLD_ALIGNED, jacobian);
  Number T(12, 1), J(6 * joints, 1);
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      T(4 * row + column) = pose.rotation()(row, column);
    }
    T(4 * row + 3) = pose.translation()[row];
  }
  for (int row = 0; row < 6; ++row) {
    for (int k = 0; k < joints; ++k) {
      J(row * joints + k) = jacobian(row, k);
    }
  }
  casadi::CodeGenerator code("pinocchio_code");
  code.add(casadi::Function("code_pose", {q}, cse(std::vector<Number>{densify(T)})));
  code.add(casadi::Function(
    "code_jacobian", {q}, cse(std::vector<Number>{densify(T), densify(J)})));
  code.generate();
}
