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
#include "@PACKAGE@/@ROBOT@.hpp"

namespace @PACKAGE@
{
namespace arm = kinematics_@ROBOT@;
using Eigen::Index, Eigen::Isometry3d, Eigen::Matrix, Eigen::Vector3d, Eigen::VectorXd;
using std::string;
using Jacobian = Matrix<double, 6, Eigen::Dynamic, Eigen::ColMajor, 6, arm::dof>;
using Square = Matrix<double, -1, -1, Eigen::ColMajor, arm::dof, arm::dof>;

// A frame of the arm. `row` is the row of the table that carries it, 0 for the base frame. The
// base frame has no function: its pose is the identity.
struct Link
{
  const char * name;
  int row;
  void (*jacobian)(const double * q, double * T, double * J);
};
constexpr Link links[] = {
@LINKS@
};

// The rows of the table in which each joint occurs, as (joint, row).
constexpr int entries[][2] = {@ENTRIES@};

class Kinematics : public kinematics_interface::KinematicsInterface
{
public:
  bool initialize(
    const string & robot_description,
    std::shared_ptr<rclcpp::node_interfaces::NodeParametersInterface> parameters,
    const string & param_namespace) override
  {
    const string prefix = param_namespace.empty() ? "" : param_namespace + ".";
    const auto value_of = [&](const string & name, const auto & otherwise) {
      rclcpp::Parameter value(name, otherwise);
      if (parameters->has_parameter(name)) {
        parameters->get_parameter(name, value);
      }
      return value;
    };
    tip_ = nullptr;
    string text = robot_description;
    if (text.empty()) {
      text = value_of("robot_description", string()).as_string();
    }
    if (text.empty()) {
      return refused("parameter robot_description not set in @PACKAGE@");
    }
    for (const string name : arm::joint_names) {
      const bool found = text.find('"' + name + '"') != string::npos ||
                         text.find("'" + name + "'") != string::npos;
      if (!found) {
        return refused(
          "The robot description has no joint '" + name + "' of @ROBOT@, the arm of this plugin.");
      }
    }
    if (!parameters->has_parameter(prefix + "tip")) {
      return refused("Failed to find end effector name parameter [tip].");
    }
    alpha_ = value_of(prefix + "alpha", 0.000005).as_double();
    const string base = value_of(prefix + "base", string()).as_string();
    const string tip = value_of(prefix + "tip", string()).as_string();
    base_ = base.empty() ? &links[0] : find(base);
    tip_ = base_ ? find(tip) : nullptr;
    if (!tip_) {
      return refused(
        "failed to find chain from robot root '" + base + "' to end effector '" + tip + "'");
    }
    moving_.clear();
    for (int k = 0; k < arm::dof; ++k) {
      if (std::any_of(std::begin(entries), std::end(entries), [&](const int (&entry)[2]) {
            return entry[0] == k && above() < entry[1] && entry[1] <= below();
          })) {
        moving_.push_back(k);
      }
    }
    if (base_->row > tip_->row) {
      std::reverse(moving_.begin(), moving_.end());
    }
    return true;
  }

  bool convert_cartesian_deltas_to_joint_deltas(
    const VectorXd & joint_pos, const Matrix<double, 6, 1> & delta_x, const string & link_name,
    VectorXd & delta_theta) override
  {
    return run(
      joint_pos, link_name, FUNCTION_SIGNATURE, [&] { return is_joint_vector(delta_theta); },
      [&](const Isometry3d &, const Jacobian & J) {
        delta_theta = damped(J).lazyProduct(J.transpose().lazyProduct(delta_x).eval());
      });
  }

  bool convert_joint_deltas_to_cartesian_deltas(
    const VectorXd & joint_pos, const VectorXd & delta_theta, const string & link_name,
    Matrix<double, 6, 1> & delta_x) override
  {
    return run(
      joint_pos, link_name, FUNCTION_SIGNATURE, [&] { return is_joint_vector(delta_theta); },
      [&](const Isometry3d &, const Jacobian & J) { delta_x = J.lazyProduct(delta_theta); });
  }

  bool calculate_link_transform(
    const VectorXd & joint_pos, const string & link_name, Isometry3d & transform) override
  {
    return run(
      joint_pos, link_name, FUNCTION_SIGNATURE, [] { return true; },
      [&](const Isometry3d & T, const Jacobian &) { transform = T; });
  }

  bool calculate_jacobian(
    const VectorXd & joint_pos, const string & link_name,
    Matrix<double, 6, Eigen::Dynamic> & jacobian) override
  {
    return run(
      joint_pos, link_name, FUNCTION_SIGNATURE, [&] { return is_of_size(jacobian, 6, size()); },
      [&](const Isometry3d &, const Jacobian & J) { jacobian = J; });
  }

  bool calculate_jacobian_inverse(
    const VectorXd & joint_pos, const string & link_name,
    Matrix<double, Eigen::Dynamic, 6> & inverse) override
  {
    return run(
      joint_pos, link_name, FUNCTION_SIGNATURE, [&] { return is_of_size(inverse, size(), 6); },
      [&](const Isometry3d &, const Jacobian & J) {
        inverse = damped(J).lazyProduct(J.transpose());
      });
  }

  // A virtual function of kinematics_interface 2 (Kilted and later), which Jazzy does not have.
  bool calculate_frame_difference(
    Matrix<double, 7, 1> & x_a, Matrix<double, 7, 1> & x_b, double dt,
    Matrix<double, 6, 1> & delta_x)
  {
    if (dt < 0) {
      return refused("The period (" + std::to_string(dt) + ") must be a non-negative number") ||
             refused(FUNCTION_SIGNATURE);
    }
    const Eigen::Quaterniond a(x_a(6), x_a(3), x_a(4), x_a(5)), b(x_b(6), x_b(3), x_b(4), x_b(5));
    const Eigen::AngleAxisd turn(b * a.inverse());
    delta_x << (x_b.head<3>() - x_a.head<3>()) / dt, turn.axis() * (turn.angle() / dt);
    return true;
  }

private:
  static bool refused(const string & reason)
  {
    RCLCPP_ERROR(rclcpp::get_logger("@PACKAGE@"), "%s", reason.c_str());
    return false;
  }

  static const Link * find(const string & name)
  {
    const auto found = std::find_if(
      std::begin(links), std::end(links), [&](const Link & link) { return name == link.name; });
    return found == std::end(links) ? nullptr : found;
  }

  // The chain of the parameters base and tip has the rows above() + 1 to below() of the table.
  int above() const { return std::min(base_->row, tip_->row); }
  int below() const { return std::max(base_->row, tip_->row); }
  Index size() const { return static_cast<Index>(moving_.size()); }

  bool is_in_chain(const Link & link) const
  {
    return &link == base_ || (above() <= link.row && link.row <= below());
  }

  bool is_joint_vector(const VectorXd & vector) const
  {
    return vector.size() == size() ||
           refused(
             "Invalid joint vector size (" + std::to_string(vector.size()) +
             "). Expected size is " + std::to_string(size()) + ".");
  }

  template <class AnyMatrix>
  static bool is_of_size(const AnyMatrix & matrix, Index rows, Index columns)
  {
    const auto text = [](Index m, Index n) {
      return "(" + std::to_string(m) + ", " + std::to_string(n) + ")";
    };
    return (matrix.rows() == rows && matrix.cols() == columns) ||
           refused(
             "The size of the jacobian " + text(matrix.rows(), matrix.cols()) +
             " does not match the required size of " + text(rows, columns));
  }

  bool is_link(const string & name) const
  {
    const Link * link = find(name);
    if (link && is_in_chain(*link)) {
      return true;
    }
    string names;
    for (const Link & other : links) {
      names += is_in_chain(other) ? string("\n") + other.name : "";
    }
    return refused(
      "The link " + name + " was not found in the robot chain. Available links are: " + names);
  }

  // Check the input, and call `use` with pose and Jacobian of a link in the base of the chain.
  template <class Fits, class Use>
  bool run(
    const VectorXd & joint_pos, const string & link_name, const char * function, Fits fits,
    Use use) const
  {
    if (!tip_) {
      refused("The @PACKAGE@ plugin was not initialized. Ensure you called the initialize method.");
    }
    if (!tip_ || !is_joint_vector(joint_pos) || !is_link(link_name) || !fits()) {
      return refused(string("Input verification failed in '") + function + "'");
    }
    std::array<double, arm::dof> q{};  // joints outside the chain move none of its links
    for (Index i = 0; i < size(); ++i) {
      q[joint(i)] = joint_pos[i];
    }
    Jacobian J, J_base, result(6, size());
    Isometry3d T = motion_of(*find(link_name), q.data(), J);
    if (base_ != &links[0]) {
      const Isometry3d T_base = motion_of(*base_, q.data(), J_base);
      const Eigen::Matrix3d R = T_base.linear().transpose();
      const Vector3d offset = T.translation() - T_base.translation();
      for (int k = 0; k < arm::dof; ++k) {
        const Vector3d v = J_base.col(k).head<3>(), w = J_base.col(k).tail<3>();
        J.col(k).head<3>() = R * (J.col(k).head<3>() - v - w.cross(offset)).eval();
        J.col(k).tail<3>() = R * (J.col(k).tail<3>() - w).eval();
      }
      T = T_base.inverse() * T;
    }
    for (Index i = 0; i < size(); ++i) {
      result.col(i) = J.col(moving_[static_cast<std::size_t>(i)]);
    }
    if (!T.matrix().allFinite() || !result.allFinite()) {
      return refused("The joint positions are not finite, or no closed loop of @ROBOT@ fits them.");
    }
    use(T, result);
    return true;
  }

  std::size_t joint(Index i) const
  {
    return static_cast<std::size_t>(moving_[static_cast<std::size_t>(i)]);
  }

  // Return pose and Jacobian, at the origin of the link in the axes of the arm's base frame.
  static Isometry3d motion_of(const Link & link, const double * q, Jacobian & J)
  {
    double T[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}, numbers[6 * arm::dof] = {};
    if (link.jacobian) {
      link.jacobian(q, T, numbers);
    }
    J.resize(6, arm::dof);
    for (int k = 0; k < 6 * arm::dof; ++k) {
      J(k / arm::dof, k % arm::dof) = numbers[k];
    }
    Isometry3d pose = Isometry3d::Identity();
    pose.affine() = Eigen::Map<const Matrix<double, 3, 4, Eigen::RowMajor>>(T);
    return pose;
  }

  // Return (J^T J + alpha I)^-1.
  Square damped(const Jacobian & J) const
  {
    Square A = J.transpose().lazyProduct(J);
    A.diagonal().array() += alpha_;
    return A.inverse();
  }

  double alpha_ = 0.0;
  const Link * base_ = nullptr;
  const Link * tip_ = nullptr;  // nullptr until the plugin is initialized
  std::vector<int> moving_;     // the joints between base and tip, from base to tip
};
}  // namespace @PACKAGE@

PLUGINLIB_EXPORT_CLASS(@PACKAGE@::Kinematics, kinematics_interface::KinematicsInterface)
