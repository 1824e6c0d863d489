// SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
// SPDX-License-Identifier: Apache-2.0

// The parts of kinematics_interface 1 and rclcpp that a generated plugin uses, for tests without
// ROS. Errors are kept as text.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <Eigen/LU>

#include <cstdio>
#include <map>
#include <memory>
#include <string>

#define FUNCTION_SIGNATURE __func__
#define RCLCPP_ERROR(logger, ...)                                          \
  do {                                                                     \
    char line[1000];                                                       \
    std::snprintf(line, sizeof line, __VA_ARGS__);                         \
    stub::errors() += "[" + (logger) + "] " + line + "\n";                 \
  } while (false)

namespace stub
{
inline std::string & errors()
{
  static std::string text;
  return text;
}
}  // namespace stub

namespace rclcpp
{
using Logger = std::string;
inline Logger get_logger(const std::string & name) { return name; }

class Parameter
{
public:
  Parameter() = default;
  Parameter(const std::string &, const std::string & text) : text_(text) {}
  Parameter(const std::string &, double number) : number_(number) {}
  std::string as_string() const { return text_; }
  double as_double() const { return number_; }

private:
  std::string text_;
  double number_ = 0.0;
};

namespace node_interfaces
{
struct NodeParametersInterface
{
  std::map<std::string, Parameter> values;
  bool has_parameter(const std::string & name) const { return values.count(name) > 0; }
  bool get_parameter(const std::string & name, Parameter & value) const
  {
    if (has_parameter(name)) {
      value = values.at(name);
    }
    return has_parameter(name);
  }
};
}  // namespace node_interfaces
}  // namespace rclcpp

namespace kinematics_interface
{
using Vector6 = Eigen::Matrix<double, 6, 1>;

class KinematicsInterface
{
public:
  virtual ~KinematicsInterface() = default;
  virtual bool initialize(
    const std::string &, std::shared_ptr<rclcpp::node_interfaces::NodeParametersInterface>,
    const std::string &) = 0;
  virtual bool convert_cartesian_deltas_to_joint_deltas(
    const Eigen::VectorXd &, const Vector6 &, const std::string &, Eigen::VectorXd &) = 0;
  virtual bool convert_joint_deltas_to_cartesian_deltas(
    const Eigen::VectorXd &, const Eigen::VectorXd &, const std::string &, Vector6 &) = 0;
  virtual bool calculate_link_transform(
    const Eigen::VectorXd &, const std::string &, Eigen::Isometry3d &) = 0;
  virtual bool calculate_jacobian(
    const Eigen::VectorXd &, const std::string &, Eigen::Matrix<double, 6, Eigen::Dynamic> &) = 0;
  virtual bool calculate_jacobian_inverse(
    const Eigen::VectorXd &, const std::string &, Eigen::Matrix<double, Eigen::Dynamic, 6> &) = 0;
#ifdef INTERFACE_2
  virtual bool calculate_frame_difference(
    Eigen::Matrix<double, 7, 1> &, Eigen::Matrix<double, 7, 1> &, double, Vector6 &) = 0;
#endif
};
}  // namespace kinematics_interface
