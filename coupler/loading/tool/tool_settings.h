// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <Eigen/Core>
#include <utility>
#include <vector>

namespace kerf
{
enum class ToolKind
{
  none,
  disc,   ///< rigid disc cutter
  platens ///< two rigid plates that close on the body along y
};

/// Shape, motion and contact of the tool.
struct ToolSettings
{
  ToolKind kind = ToolKind::disc;
  double radius = 0.;                                   ///< of the disc [m]
  double width = 0.;                                    ///< of the disc along its axis, 0: infinite [m]
  std::vector<std::pair<double, Eigen::Vector3d>> path; ///< of the disc: time [s], centre [m]
  double smoothing_time = 0.;                           ///< of the disc's path; start-up time of the platens [s]
  bool rolling = true; ///< the disc rolls along its lowest point without slip, else it does not rotate
  /// Of the platens relative to each other [m/s]. Negative: they pull; each holds the rock that touches it at the start.
  double closing_speed = 0.;
  double lower = 0., upper = 0.; ///< faces of the platens at the start, y [m]; filled in from the mesh
  double stiffness_ratio = 0.;   ///< contact stiffness / k_n; 0: as stiff as the time step allows [-]
  double friction = 0.;          ///< Coulomb coefficient [-]
  double damping = 0.;           ///< fraction of critical [-]

  bool present() const { return kind != ToolKind::none; }
  bool pulls() const { return kind == ToolKind::platens && closing_speed < 0.; }
};
} // namespace kerf
