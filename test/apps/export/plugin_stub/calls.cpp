// SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
// SPDX-License-Identifier: Apache-2.0

// A generated plugin as functions of C, for ctypes: each returns whether the plugin accepted it.
// The functions that a controller calls in its loop may not allocate memory by Eigen.
#include "src/plugin.cpp"

namespace
{
std::shared_ptr<kinematics_interface::KinematicsInterface> plugin = make_plugin();

Eigen::VectorXd vector(const double * numbers, int size)
{
  return Eigen::Map<const Eigen::VectorXd>(numbers, size);
}

template <class Function>
int without_memory(Function && function)
{
  Eigen::internal::set_is_malloc_allowed(false);
  const bool accepted = function();
  Eigen::internal::set_is_malloc_allowed(true);
  return accepted;
}
}  // namespace

extern "C" {
const char * errors()
{
  static std::string text;
  text.swap(stub::errors());
  stub::errors().clear();
  return text.c_str();
}

int initialize(const char * description, const char * tip, const char * base, double alpha)
{
  auto parameters = std::make_shared<rclcpp::node_interfaces::NodeParametersInterface>();
  parameters->values["kinematics.alpha"] = {"", alpha};
  if (tip) {
    parameters->values["kinematics.tip"] = {"", std::string(tip)};
  }
  if (base) {
    parameters->values["kinematics.base"] = {"", std::string(base)};
  }
  return plugin->initialize(description, parameters, "kinematics");
}

int pose(const double * q, int size, const char * link, double * T)
{
  const Eigen::VectorXd positions = vector(q, size);
  Eigen::Isometry3d result;
  const std::string name = link;
  const int accepted = without_memory(
    [&] { return plugin->calculate_link_transform(positions, name, result); });
  Eigen::Map<Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>{T} = result.matrix();
  return accepted;
}

int jacobian(const double * q, int size, const char * link, int columns, double * J)
{
  const Eigen::VectorXd positions = vector(q, size);
  Eigen::Matrix<double, 6, Eigen::Dynamic> result(6, columns);
  const std::string name = link;
  const int accepted = without_memory(
    [&] { return plugin->calculate_jacobian(positions, name, result); });
  Eigen::Map<Eigen::MatrixXd>(J, 6, columns) = result;
  return accepted;
}

int inverse(const double * q, int size, const char * link, int rows, double * result_of_J)
{
  const Eigen::VectorXd positions = vector(q, size);
  Eigen::Matrix<double, Eigen::Dynamic, 6> result(rows, 6);
  const std::string name = link;
  const int accepted = without_memory(
    [&] { return plugin->calculate_jacobian_inverse(positions, name, result); });
  Eigen::Map<Eigen::MatrixXd>(result_of_J, rows, 6) = result;
  return accepted;
}

int joint_deltas(const double * q, int size, const char * link, int rows, double * deltas)
{
  const Eigen::VectorXd positions = vector(q, size);
  kinematics_interface::Vector6 delta_x;
  delta_x << 0.1, 0.2, 0.3, 0.4, 0.5, 0.6;
  Eigen::VectorXd result(rows);
  const std::string name = link;
  const int accepted = without_memory([&] {
    return plugin->convert_cartesian_deltas_to_joint_deltas(positions, delta_x, name, result);
  });
  Eigen::Map<Eigen::VectorXd>(deltas, rows) = result;
  return accepted;
}

int cartesian_deltas(const double * q, int size, const char * link, int rows, double * deltas)
{
  const Eigen::VectorXd positions = vector(q, size);
  const Eigen::VectorXd delta_theta = Eigen::VectorXd::LinSpaced(rows, 0.1, 0.1 * rows);
  kinematics_interface::Vector6 result;
  const std::string name = link;
  const int accepted = without_memory([&] {
    return plugin->convert_joint_deltas_to_cartesian_deltas(positions, delta_theta, name, result);
  });
  Eigen::Map<kinematics_interface::Vector6>{deltas} = result;
  return accepted;
}

#ifdef INTERFACE_2
int frame_difference(double * a, double * b, double dt, double * delta)
{
  Eigen::Matrix<double, 7, 1> x_a(a), x_b(b);
  kinematics_interface::Vector6 result = kinematics_interface::Vector6::Zero();
  const bool accepted = plugin->calculate_frame_difference(x_a, x_b, dt, result);
  Eigen::Map<kinematics_interface::Vector6>{delta} = result;
  return accepted;
}
#endif
}
