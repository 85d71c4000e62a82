// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/loading/contact_law.h"
#include "coupler/loading/tool/rigid_bodies.h"
#include "coupler/loading/tool/tool_settings.h"
#include "dem_side/dem_side.h"
#include "fem_side/fem_side.h"

#include <array>
#include <memory>

namespace kerf
{
/// Stiffness of the contact between tool and surface of the finite elements [N/m^3]: that of particles, one on each spacing
/// (two dimensions) or spacing^2. @param k_n normal bond stiffness [N/m] (2D: per metre)
double surface_stiffness(const ToolSettings &settings, int dim, double k_n, double spacing);

/// The tool: one or two rigid bodies in contact with particles and with the surface of the finite elements, each with its own
/// weight, so that the contact force does not jump when a cell below the tool is converted.
class Tool
{
public:
  /// @param k_n normal bond stiffness [N/m]; @param spacing of the particles, their mean diameter d [m]; @param density of the
  /// rock
  Tool(const ToolSettings &settings, int dim, double k_n, double spacing, double density, MPI_Comm comm);

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
  static double clearance(const ToolSettings &tool, const fem::FemSide &fem);

private:
  Eigen::Vector3d contact_force(const NearestSurface &surface, const Eigen::Vector3d &rock_velocity, double stiffness,
                                double damping, double share);
  void push_particles(const RigidBody &body, dem::Particles &particles, double share);
  void push_surface(const RigidBody &body, fem::FemSide &fem, double share);

  ToolSettings settings;
  ContactLaw law;
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
