// SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
// SPDX-License-Identifier: Apache-2.0

// Print a line for each function: its name, its least ns a call, and its largest difference from
// the header. The functions take turns, so that a busy machine is busy for all of them.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <limits>
#include <random>
#include <vector>

#include "arm.hpp"
#include "header_of_run.hpp"

void pose_of_header(const double * q, double * T, double *) { header::pose(q, T); }
void jacobian_of_header(const double * q, double * T, double * J) { header::jacobian(q, T, J); }

#ifdef WITH_PINOCCHIO
extern "C" int code_pose(const double **, double **, long long *, double *, int);
extern "C" int code_jacobian(const double **, double **, long long *, double *, int);

void pose_of_pinocchio_code(const double * q, double * T, double *)
{
  code_pose(&q, &T, nullptr, nullptr, 0);
}

void jacobian_of_pinocchio_code(const double * q, double * T, double * J)
{
  double * results[] = {T, J};
  code_jacobian(&q, results, nullptr, nullptr, 0);
}
#endif

namespace
{
struct Case
{
  const char * name;
  Call call;
  double best;
};

constexpr int poses = 1000, rounds = 2000;
}  // namespace

int main()
{
  std::vector<Case> cases = {
    {"header: pose", pose_of_header, 0},
    {"header: pose and Jacobian", jacobian_of_header, 0},
    {"KDL: pose", pose_of_kdl, 0},
    {"KDL: pose and Jacobian", jacobian_of_kdl, 0},
#ifdef WITH_PINOCCHIO
    {"Pinocchio: pose", pose_of_pinocchio, 0},
    {"Pinocchio: pose and Jacobian", jacobian_of_pinocchio, 0},
    {"Pinocchio and CasADi: pose", pose_of_pinocchio_code, 0},
    {"Pinocchio and CasADi: pose and Jacobian", jacobian_of_pinocchio_code, 0},
#endif
  };
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> angle(-3.0, 3.0);
  std::vector<double> q(poses * joints);
  std::generate(q.begin(), q.end(), [&] { return angle(random); });
  double T[12], J[6 * joints], T_due[12], J_due[6 * joints], sum = 0;
  for (Case & one : cases) {
    one.best = std::numeric_limits<double>::infinity();
  }
  for (int round = 0; round < rounds; ++round) {
    for (Case & one : cases) {
      const auto begin = std::chrono::steady_clock::now();
      for (int i = 0; i < poses; ++i) {
        one.call(&q[i * joints], T, J);
        sum += T[3];
      }
      const std::chrono::duration<double, std::nano> taken =
        std::chrono::steady_clock::now() - begin;
      one.best = std::min(one.best, taken.count() / poses);
    }
  }
  for (const Case & one : cases) {
    double worst = 0;
    for (int i = 0; i < poses; ++i) {
      jacobian_of_header(&q[i * joints], T_due, J_due);
      std::copy(J_due, J_due + 6 * joints, J);
      one.call(&q[i * joints], T, J);
      for (int k = 0; k < 12; ++k) {
        worst = std::max(worst, std::fabs(T[k] - T_due[k]));
      }
      for (int k = 0; k < 6 * joints; ++k) {
        worst = std::max(worst, std::fabs(J[k] - J_due[k]));
      }
    }
    std::printf("%s;%.1f;%.1e\n", one.name, one.best, worst);
  }
  return std::isfinite(sum) ? 0 : 1;
}
