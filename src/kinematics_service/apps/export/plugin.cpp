// SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
// SPDX-License-Identifier: Apache-2.0

// @ABOUT@
//
// The calls after `initialize` allocate no memory and take no lock, unless they refuse their input.

#include <algorithm>
#include <array>
#include <memory>
#include <string>
#include <vector>

#include "kinematics_interface/kinematics_interface.hpp"
#include "pluginlib/class_list_macros.hpp"
@INCLUDES@

namespace @PACKAGE@
{
constexpr int joints = @DOF@;  // of the whole arm
constexpr std::array<const char *, joints> joint_names = {@JOINTS@};

// A frame of the arm. `row` is the row of the table that carries it, 0 the base. Without functions
// its pose never changes: it is `fixed`, 3 x 4 and row-major like those of the header.
struct Link
{
  const char * name;
  int row;
  void (*pose)(const double * q, double * T);
  void (*jacobian)(const double * q, double * T, double * J);
  std::array<double, 12> fixed;
};

constexpr std::array<Link, @LINK_COUNT@> links = {{
@LINKS@
}};

// The rows of the table in which each joint occurs, as (joint, row).
constexpr std::array<std::array<int, 2>, @ENTRY_COUNT@> entries = {{@ENTRIES@}};

inline rclcpp::Logger logger() { return rclcpp::get_logger("@PACKAGE@"); }

using Positions = std::array<double, joints>;
using Jacobian = Eigen::Matrix<double, 6, Eigen::Dynamic, Eigen::ColMajor, 6, joints>;
using Square = Eigen::Matrix<
  double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, joints, joints>;

inline Eigen::Isometry3d isometry(const std::array<double, 12> & T)
{
  Eigen::Isometry3d result = Eigen::Isometry3d::Identity();
  result.matrix().topRows<3>() =
    Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>>(T.data());
  return result;
}

inline Eigen::Isometry3d pose_of(const Link & link, const Positions & q)
{
  std::array<double, 12> T = link.fixed;
  if (link.pose) {
    link.pose(q.data(), T.data());
  }
  return isometry(T);
}

// Pose and Jacobian, at the origin of the link in the axes of the arm's base frame.
inline Eigen::Isometry3d motion_of(const Link & link, const Positions & q, Jacobian & J)
{
  std::array<double, 12> T = link.fixed;
  std::array<double, 6 * joints> numbers{};
  if (link.jacobian) {
    link.jacobian(q.data(), T.data(), numbers.data());
  }
  J.resize(6, joints);
  for (int row = 0; row < 6; ++row) {
    for (int k = 0; k < joints; ++k) {
      J(row, k) = numbers[static_cast<std::size_t>(row * joints + k)];
    }
  }
  return isometry(T);
}

class Kinematics : public kinematics_interface::KinematicsInterface
{
public:
  bool initialize(
    const std::string & robot_description,
    std::shared_ptr<rclcpp::node_interfaces::NodeParametersInterface> parameters,
    const std::string & param_namespace) override
  {
    initialized_ = false;
    const std::string prefix = param_namespace.empty() ? "" : param_namespace + ".";
    rclcpp::Parameter description("robot_description", robot_description);
    if (
      robot_description.empty() &&
      !parameters->get_parameter("robot_description", description)) {
      RCLCPP_ERROR(logger(), "parameter robot_description not set in @PACKAGE@");
      return false;
    }
    for (const char * name : joint_names) {
      if (!has_joint(description.as_string(), name)) {
        RCLCPP_ERROR(
          logger(), "The robot description has no joint '%s' of @ROBOT@, the arm of this plugin.",
          name);
        return false;
      }
    }
    rclcpp::Parameter alpha("alpha", 0.000005), tip("tip", ""), base("base", "");
    if (parameters->has_parameter(prefix + "alpha")) {
      parameters->get_parameter(prefix + "alpha", alpha);
    }
    if (!parameters->has_parameter(prefix + "tip")) {
      RCLCPP_ERROR(logger(), "Failed to find end effector name parameter [tip].");
      return false;
    }
    parameters->get_parameter(prefix + "tip", tip);
    if (parameters->has_parameter(prefix + "base")) {
      parameters->get_parameter(prefix + "base", base);
    }
    alpha_ = alpha.as_double();
    base_ = base.as_string().empty() ? &links[0] : find(base.as_string());
    tip_ = find(tip.as_string());
    if (!base_ || !tip_) {
      RCLCPP_ERROR(
        logger(), "failed to find chain from robot root '%s' to end effector '%s'",
        base.as_string().c_str(), tip.as_string().c_str());
      return false;
    }
    moving_.clear();
    for (int k = 0; k < joints; ++k) {
      for (const auto & entry : entries) {
        if (entry[0] == k && above() < entry[1] && entry[1] <= below()) {
          moving_.push_back(k);
          break;
        }
      }
    }
    initialized_ = true;
    return true;
  }

  bool convert_cartesian_deltas_to_joint_deltas(
    const Eigen::VectorXd & joint_pos, const Eigen::Matrix<double, 6, 1> & delta_x,
    const std::string & link_name, Eigen::VectorXd & delta_theta) override
  {
    const Link * link = verified(joint_pos, link_name);
    if (!link || !is_joint_vector(delta_theta)) {
      return refused(FUNCTION_SIGNATURE);
    }
    Jacobian J;
    motion(joint_pos, *link, J);
    delta_theta.noalias() = damped(J).lazyProduct(J.transpose().lazyProduct(delta_x).eval());
    return true;
  }

  bool convert_joint_deltas_to_cartesian_deltas(
    const Eigen::VectorXd & joint_pos, const Eigen::VectorXd & delta_theta,
    const std::string & link_name, Eigen::Matrix<double, 6, 1> & delta_x) override
  {
    const Link * link = verified(joint_pos, link_name);
    if (!link || !is_joint_vector(delta_theta)) {
      return refused(FUNCTION_SIGNATURE);
    }
    Jacobian J;
    motion(joint_pos, *link, J);
    delta_x = J.lazyProduct(delta_theta);
    return true;
  }

  bool calculate_link_transform(
    const Eigen::VectorXd & joint_pos, const std::string & link_name,
    Eigen::Isometry3d & transform) override
  {
    const Link * link = verified(joint_pos, link_name);
    if (!link) {
      return refused(FUNCTION_SIGNATURE);
    }
    const Positions q = positions(joint_pos);
    transform = pose_of(*link, q);
    if (base_ != &links[0]) {
      transform = pose_of(*base_, q).inverse() * transform;
    }
    return true;
  }

  bool calculate_jacobian(
    const Eigen::VectorXd & joint_pos, const std::string & link_name,
    Eigen::Matrix<double, 6, Eigen::Dynamic> & jacobian) override
  {
    const Link * link = verified(joint_pos, link_name);
    if (!link || !is_of_size(jacobian.rows(), jacobian.cols(), 6, size())) {
      return refused(FUNCTION_SIGNATURE);
    }
    Jacobian J;
    motion(joint_pos, *link, J);
    jacobian = J;
    return true;
  }

  bool calculate_jacobian_inverse(
    const Eigen::VectorXd & joint_pos, const std::string & link_name,
    Eigen::Matrix<double, Eigen::Dynamic, 6> & jacobian_inverse) override
  {
    const Link * link = verified(joint_pos, link_name);
    if (
      !link || !is_of_size(jacobian_inverse.rows(), jacobian_inverse.cols(), size(), 6)) {
      return refused(FUNCTION_SIGNATURE);
    }
    Jacobian J;
    motion(joint_pos, *link, J);
    jacobian_inverse.noalias() = damped(J).lazyProduct(J.transpose());
    return true;
  }

  // A virtual function of kinematics_interface 2 (Kilted and later), which Jazzy does not have.
  bool calculate_frame_difference(
    Eigen::Matrix<double, 7, 1> & x_a, Eigen::Matrix<double, 7, 1> & x_b, double dt,
    Eigen::Matrix<double, 6, 1> & delta_x)
  {
    if (dt < 0) {
      RCLCPP_ERROR(logger(), "The period (%f) must be a non-negative number", dt);
      return refused(FUNCTION_SIGNATURE);
    }
    const Eigen::Quaterniond a(x_a(6), x_a(3), x_a(4), x_a(5));
    const Eigen::Quaterniond b(x_b(6), x_b(3), x_b(4), x_b(5));
    const Eigen::AngleAxisd turn(b * a.inverse());
    delta_x.head<3>() = (x_b.head<3>() - x_a.head<3>()) / dt;
    delta_x.tail<3>() = turn.axis() * (turn.angle() / dt);
    return true;
  }

private:
  static bool has_joint(const std::string & description, const std::string & name)
  {
    return description.find('"' + name + '"') != std::string::npos ||
           description.find("'" + name + "'") != std::string::npos;
  }

  static const Link * find(const std::string & name)
  {
    for (const Link & link : links) {
      if (name == link.name) {
        return &link;
      }
    }
    return nullptr;
  }

  // The chain of the parameters base and tip has the rows above() + 1 to below() of the table.
  int above() const { return std::min(base_->row, tip_->row); }
  int below() const { return std::max(base_->row, tip_->row); }
  bool is_in_chain(const Link & link) const
  {
    return &link == base_ || (above() <= link.row && link.row <= below());
  }

  Eigen::Index size() const { return static_cast<Eigen::Index>(moving_.size()); }

  const Link * verified(const Eigen::VectorXd & joint_pos, const std::string & link_name) const
  {
    if (!initialized_) {
      RCLCPP_ERROR(
        logger(),
        "The @PACKAGE@ plugin was not initialized. Ensure you called the initialize method.");
      return nullptr;
    }
    if (!is_joint_vector(joint_pos)) {
      return nullptr;
    }
    const Link * link = find(link_name);
    if (link && is_in_chain(*link)) {
      return link;
    }
    std::string names;
    for (const Link & other : links) {
      names += is_in_chain(other) ? std::string("\n") + other.name : "";
    }
    RCLCPP_ERROR(
      logger(), "The link %s was not found in the robot chain. Available links are: %s",
      link_name.c_str(), names.c_str());
    return nullptr;
  }

  bool is_joint_vector(const Eigen::VectorXd & vector) const
  {
    if (vector.size() != size()) {
      RCLCPP_ERROR(
        logger(), "Invalid joint vector size (%td). Expected size is %td.", vector.size(), size());
      return false;
    }
    return true;
  }

  static bool is_of_size(
    Eigen::Index rows, Eigen::Index columns, Eigen::Index due_rows, Eigen::Index due_columns)
  {
    if (rows != due_rows || columns != due_columns) {
      RCLCPP_ERROR(
        logger(), "The size of the jacobian (%td, %td) does not match the required size of "
        "(%td, %td)", rows, columns, due_rows, due_columns);
      return false;
    }
    return true;
  }

  static bool refused(const char * function)
  {
    RCLCPP_ERROR(logger(), "Input verification failed in '%s'", function);
    return false;
  }

  // Return the positions of all joints. Those outside the chain move none of its links.
  Positions positions(const Eigen::VectorXd & joint_pos) const
  {
    Positions q{};
    for (std::size_t i = 0; i < moving_.size(); ++i) {
      q[static_cast<std::size_t>(moving_[i])] = joint_pos[static_cast<Eigen::Index>(i)];
    }
    return q;
  }

  // Compute the Jacobian of a link relative to the base of the chain, in the axes of that base.
  void motion(const Eigen::VectorXd & joint_pos, const Link & link, Jacobian & result) const
  {
    const Positions q = positions(joint_pos);
    Jacobian J, J_base;
    const Eigen::Isometry3d T = motion_of(link, q, J);
    if (base_ != &links[0]) {
      const Eigen::Isometry3d T_base = motion_of(*base_, q, J_base);
      const Eigen::Matrix3d R = T_base.linear().transpose();
      const Eigen::Vector3d arm = T.translation() - T_base.translation();
      for (int k = 0; k < joints; ++k) {
        const Eigen::Vector3d v = J_base.col(k).head<3>(), w = J_base.col(k).tail<3>();
        J.col(k).head<3>() = R * (J.col(k).head<3>() - v - w.cross(arm)).eval();
        J.col(k).tail<3>() = R * (J.col(k).tail<3>() - w).eval();
      }
    }
    result.resize(6, size());
    for (std::size_t i = 0; i < moving_.size(); ++i) {
      result.col(static_cast<Eigen::Index>(i)) = J.col(moving_[i]);
    }
  }

  // Return (J^T J + alpha I)^-1.
  Square damped(const Jacobian & J) const
  {
    Square A = J.transpose().lazyProduct(J);
    A.diagonal().array() += alpha_;
    return A.inverse();
  }

  bool initialized_ = false;
  double alpha_ = 0.000005;
  const Link * base_ = &links[0];
  const Link * tip_ = &links[0];
  std::vector<int> moving_;  // the joints between base and tip
};
}  // namespace @PACKAGE@

PLUGINLIB_EXPORT_CLASS(@PACKAGE@::Kinematics, kinematics_interface::KinematicsInterface)
