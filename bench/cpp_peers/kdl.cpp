// SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
// SPDX-License-Identifier: Apache-2.0

// KDL with the fewest segments: one fixed, and one for each joint about its own z axis.
#include <kdl/chain.hpp>
#include <kdl/chainfksolverpos_recursive.hpp>
#include <kdl/chainjnttojacsolver.hpp>

#include "arm.hpp"

namespace
{
KDL::Frame frame(const double * M)
{
  return {
    KDL::Rotation(M[0], M[1], M[2], M[4], M[5], M[6], M[8], M[9], M[10]),
    KDL::Vector(M[3], M[7], M[11])};
}

KDL::Chain chain()
{
  KDL::Chain result;
  result.addSegment(KDL::Segment(KDL::Joint(KDL::Joint::Fixed), frame(still[0])));
  for (int k = 0; k < joints; ++k) {
    const auto type = slides[k] ? KDL::Joint::TransZ : KDL::Joint::RotZ;
    result.addSegment(KDL::Segment(KDL::Joint(type), frame(still[k + 1])));
  }
  return result;
}

const KDL::Chain arm = chain();
KDL::ChainFkSolverPos_recursive poses(arm);
KDL::ChainJntToJacSolver jacobians(arm);
KDL::JntArray positions(joints);
KDL::Jacobian jacobian(joints);

void take(const double * q)
{
  for (int k = 0; k < joints; ++k) {
    positions(static_cast<unsigned>(k)) = q[k];
  }
}
}  // namespace

void pose_of_kdl(const double * q, double * T, double *)
{
  KDL::Frame pose;
  take(q);
  poses.JntToCart(positions, pose);
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) {
      T[4 * row + column] = pose(row, column);
    }
  }
}

void jacobian_of_kdl(const double * q, double * T, double * J)
{
  pose_of_kdl(q, T, J);
  jacobians.JntToJac(positions, jacobian);
  for (unsigned row = 0; row < 6; ++row) {
    for (unsigned k = 0; k < joints; ++k) {
      J[row * joints + k] = jacobian(row, k);
    }
  }
}
