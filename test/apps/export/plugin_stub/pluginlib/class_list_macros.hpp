// SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <memory>

// Make the plugin as its base class, as pluginlib does.
#define PLUGINLIB_EXPORT_CLASS(type, base) \
  std::shared_ptr<base> make_plugin() { return std::make_shared<type>(); }
