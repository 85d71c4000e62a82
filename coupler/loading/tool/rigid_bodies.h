// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/base/mesh_geometry.h"
#include "coupler/loading/tool/tool_path.h"
#include "coupler/loading/tool/tool_settings.h"

#include <cmath>
#include <limits>

namespace kerf
{
/// The place of a rigid body's surface that is nearest to a point.
struct NearestSurface
{
  double gap = 0.;          ///< distance of the point from the surface, negative inside [m]
  Eigen::Vector3d normal;   ///< out of the body
  Eigen::Vector3d velocity; ///< of the body's surface there [m/s]
};

/// A rigid body with prescribed motion.
class RigidBody
{
public:
  virtual ~RigidBody() = default;
  virtual void move_to(double time) = 0; ///< [s]
  virtual NearestSurface nearest(const Eigen::Vector3d &point) const = 0;
  /// Box around all points with a gap below @p reach [m].
  virtual Box bounds(double reach) const = 0;
  /// Smallest radius of curvature of the surface, infinite for a plane [m].
  virtual double curvature_radius() const = 0;
  /// Speed of the body without its rotation [m/s].
  virtual double speed() const = 0;
};

/// Disc cutter with its axis along z. Its shape is a flat disc grown by half of the width, so that the rim is round; without a
/// width it is a cylinder of infinite length.
class Disc : public RigidBody
{
public:
  explicit Disc(const ToolSettings &settings);
  void move_to(double time) override;
  NearestSurface nearest(const Eigen::Vector3d &point) const override;
  Box bounds(double reach) const override;
  double curvature_radius() const override { return width > 0. ? 0.5 * width : radius; }
  double speed() const override { return velocity.norm(); }

  Eigen::Vector3d centre = Eigen::Vector3d::Zero(), velocity = Eigen::Vector3d::Zero();
  double spin = 0., angle = 0.; ///< about z [rad/s], [rad]
  const double radius;
  const double width; ///< 0: infinite [m]

private:
  ToolPath path;
  bool rolling;
  double time_of_angle = 0.;
};

/// Plate of a press: the half space beyond a plane across y. The speed starts as half a cosine wave.
class Platen : public RigidBody
{
public:
  /// @param y of the face at the start [m]
  /// @param side outer normal of the face along y, 1 or -1
  /// @param speed along y [m/s]
  /// @param ramp duration of the start [s]
  Platen(double y, double side, double speed, double ramp);
  void move_to(double time) override;
  NearestSurface nearest(const Eigen::Vector3d &point) const override;
  Box bounds(double reach) const override;
  double curvature_radius() const override { return std::numeric_limits<double>::infinity(); }
  double speed() const override { return std::abs(velocity); }

  const double start, side, full_speed, ramp;
  double y, velocity = 0.; // along y [m], [m/s]
};
} // namespace kerf
