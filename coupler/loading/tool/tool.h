// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/application/case_file/case_file.h"
#include "dem_side/dem_side.h"
#include "fem_side/fem_side.h"

#include <array>
#include <memory>

namespace kerf
{
/// Prescribed motion of the disc centre: the polygon of way points averaged over the smoothing time, so the velocity is
/// continuous and on straight parts the path is exact.
class ToolPath
{
public:
  ToolPath() = default;
  ToolPath(const std::vector<std::pair<double, Eigen::Vector3d>> &way_points, double smoothing_time);

  Eigen::Vector3d position(double time) const; ///< [m]
  Eigen::Vector3d velocity(double time) const; ///< [m/s]

private:
  Eigen::Vector3d polygon(double time) const;
  /// Integral of the polygon from the first way point's time.
  Eigen::Vector3d integral(double time) const;

  std::vector<std::pair<double, Eigen::Vector3d>> points;
  double window = 0.;
};

/// Contact between a rigid surface and a point of the rock: linear spring and dashpot, no tension, Coulomb friction
/// regularised by the tangential dashpot.
struct ToolContactLaw
{
  double friction = 0.;

  /// Force on the rock [N]. @param gap surface distance, negative in contact [m]; @param normal out of the tool;
  /// @param relative velocity of the rock against the tool [m/s]; @param stiffness [N/m]; @param damping [N s/m]
  Eigen::Vector3d force(double gap, const Eigen::Vector3d &normal, const Eigen::Vector3d &relative, double stiffness,
                        double damping) const;
};

/// What a point of the rock sees of a rigid body.
struct NearestSurface
{
  double gap = 0.;          ///< distance of the point from the surface, negative inside [m]
  Eigen::Vector3d normal;   ///< out of the body
  Eigen::Vector3d velocity; ///< of the body's surface there [m/s]
};

/// A rigid body on a prescribed way.
class RigidBody
{
public:
  virtual ~RigidBody() = default;
  virtual void move_to(double time) = 0; ///< [s]
  virtual NearestSurface nearest(const Eigen::Vector3d &point) const = 0;
  /// Box around all points with a gap below @p reach [m].
  virtual Box bounds(double reach) const = 0;
};

/// Disc cutter, its axis along z: a flat disc with half of the width around it, so that its rim is round; or a cylinder without
/// end.
class Disc : public RigidBody
{
public:
  explicit Disc(const Case::Tool &settings);
  void move_to(double time) override;
  NearestSurface nearest(const Eigen::Vector3d &point) const override;
  Box bounds(double reach) const override;

  Eigen::Vector3d centre = Eigen::Vector3d::Zero(), velocity = Eigen::Vector3d::Zero();
  double spin = 0., angle = 0.; ///< about z [rad/s], [rad]
  const double radius;
  const double width; ///< 0: without end [m]

private:
  ToolPath path;
  bool rolling;
  double time_of_angle = 0.;
};

/// Plate of a press: the half space beyond a plane across y. Its speed starts as half a cosine wave.
class Platen : public RigidBody
{
public:
  /// @param y of the face at the start [m]; @param speed along y [m/s], its sign is that of the face's outer normal;
  /// @param ramp duration of the start [s]
  Platen(double y, double speed, double ramp);
  void move_to(double time) override;
  NearestSurface nearest(const Eigen::Vector3d &point) const override;
  Box bounds(double reach) const override;

  const double start, full_speed, ramp;
  double y, speed = 0.;
};

/// Stiffness of the contact between tool and surface of the finite elements [N/m^3]: that of particles, one on each spacing
/// (two dimensions) or spacing^2. @param k_n normal bond stiffness [N/m] (2D: per metre)
double surface_stiffness(const Case::Tool &settings, int dim, double k_n, double spacing);

/// The tool: one or two rigid bodies in contact with particles and with the surface of the finite elements, each with its own
/// weight, so that the contact force does not jump when a cell below the tool is converted.
class Tool
{
public:
  /// @param k_n normal bond stiffness [N/m]; @param spacing of the particles, their mean diameter d [m]; @param density of the
  /// rock
  Tool(const Case::Tool &settings, int dim, double k_n, double spacing, double density, MPI_Comm comm);

  /// Places the tool at @p time [s].
  void move_to(double time);

  /// Adds contact forces to the particles of this rank and to the surface of the finite elements. Collective.
  void apply(dem::Particles &particles, fem::FemSide &fem);

  /// Force of the tool on the rock [N] and its power [W], summed over ranks by total(). Reaction on the tool = -force.
  /// Platens push against each other: their force is half the difference, that of the upper one in equilibrium.
  struct Load
  {
    Eigen::Vector3d force = Eigen::Vector3d::Zero();
    double power = 0.;
  };
  const Load &local_load() const { return load; }
  /// Particles that the last apply() pushed, as places in its arrays; some may be there twice.
  const std::vector<int> &touched() const { return touched_particles; }
  Load total(const Load &local) const;

  bool present() const { return settings.present(); }
  const Disc *disc() const { return dynamic_cast<const Disc *>(bodies.empty() ? nullptr : bodies[0].get()); }
  /// Faces of the platens, lower and upper y [m]; both 0 for other tools.
  std::array<double, 2> platens() const;

  /// Smallest distance of a disc from the rock in the reference configuration, negative inside [m].
  static double clearance(const Case::Tool &tool, const fem::FemSide &fem);

private:
  Eigen::Vector3d contact_force(const NearestSurface &surface, const Eigen::Vector3d &rock_velocity, double stiffness,
                                double damping, double share);
  void push_particles(const RigidBody &body, dem::Particles &particles, double share);
  void push_surface(const RigidBody &body, fem::FemSide &fem, double share);

  Case::Tool settings;
  ToolContactLaw law;
  double particle_stiffness; // [N/m]
  double surface_stiffness;  // [N/m^3], the particles' one spread over their spacing
  double surface_damping;    // [N s/m^3]
  MPI_Comm comm;
  std::vector<std::unique_ptr<RigidBody>> bodies;
  std::vector<double> shares; // of each body's force in the load
  Load load;
  std::vector<int> touched_particles;
  fem::SurfacePoints surface;
  Eigen::Matrix3Xd surface_force;
};
} // namespace kerf
