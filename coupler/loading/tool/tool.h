// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/base/near_cell.h"
#include "coupler/loading/contact_law.h"
#include "coupler/loading/tool/rigid_bodies.h"
#include "coupler/loading/tool/tool_settings.h"
#include "dem_side/dem_side.h"
#include "dem_side/packing/packing.h"
#include "fem_side/fem_side.h"

#include <array>
#include <memory>
#include <utility>
#include <vector>

namespace kerf
{
/// What a contact whose stiffness follows the time step adds to omega^2 dt^2 of what it touches, whose limit is 4: that of its
/// spring and of its dashpot together. A safety of 0.7 leaves 2.04. Theory (9.21).
constexpr double contact_share_of_step = 1.4;

/// Stiffness per area of the contact between tool and surface of the finite elements, for a given stiffness ratio [N/m^3]. It
/// is that of a layer of particles, see surface_resolution::particle_spacing.
/// @param k_n normal bond stiffness [N/m] (2D: per metre)
/// @param mean_diameter of the particles [m]
double surface_stiffness(const ToolSettings &settings, int dim, double k_n, double mean_diameter);

/// Its damping for such a stiffness [N s/m^3]. @param density of the rock [kg/m^3]
double surface_damping(const ToolSettings &settings, double stiffness, double density, double mean_diameter);

/// The tool: one or two rigid bodies in contact with particles and with the surface of the finite elements. Each contact has
/// the weight of its side.
class Tool
{
public:
  /// @param k_n normal bond stiffness [N/m] (2D: per metre)
  /// @param mean_diameter of the particles [m]
  /// @param density of the rock [kg/m^3]
  Tool(const ToolSettings &settings, int dim, double k_n, double mean_diameter, double density, MPI_Comm comm);

  /// Makes the contact as stiff as the step @p dt [s] allows, unless the settings give a stiffness ratio. Theory (9.20),
  /// (9.21).
  /// @param layer thickness of the layer of rock whose mass the surface of the finite elements offers to the contact [m]
  void set_time_step(double dt, double layer);
  /// Chooses the particles that platens hold when they pull: those that touch them in the store, with the gap of a bond. Other
  /// tools hold nothing. Not collective.
  void hold(const dem::Packing &packing);

  /// Places the tool at @p time [s].
  void move_to(double time);

  /// Weights of contact with particles, by index in the packing [-]; negative: that of the particle's centre, as for all
  /// particles when the list is empty.
  void set_contact_weights(std::vector<double> weights) { contact_weights = std::move(weights); }

  /// Adds contact forces to the particles of this rank and to the surface of the finite elements. Collective.
  /// @param rock_surface nullptr: there are no finite elements
  void apply(dem::Particles &particles, fem::SurfaceContact *rock_surface);

  /// Cells of this rank with a part of their outer surface within @p reach [m] of the tool or of where it may be after
  /// @p duration [s]. Some may be there twice. Not collective.
  std::vector<NearCell> near_cells(const fem::SurfaceContact &rock_surface, double reach, double duration) const;

  /// The same for all cells of the boundary, with or without finite elements, by their enclosing balls at the start.
  std::vector<NearCell> near_cells(const fem::Mesh &mesh, double reach, double duration) const;

  /// Load of the tool on the rock; the reaction on the tool is -force. Platens push against each other: their force is half the
  /// difference, in equilibrium that of the upper platen.
  struct Load
  {
    Eigen::Vector3d force = Eigen::Vector3d::Zero(); ///< [N]
    double power = 0.;                               ///< of the tool's force [W]
  };
  const Load &local_load() const { return load; } ///< of this rank
  Load total(const Load &local) const;            ///< sum over the ranks; collective
  /// Particles that the last apply() pushed, as places in its arrays. Some may be there twice.
  const std::vector<int> &touched() const { return touched_particles; }
  /// Stiffness of their contacts in the same order [N/m].
  const std::vector<double> &touched_stiffness() const { return contact_stiffness; }

  bool present() const { return settings.present(); }
  /// The disc cutter; nullptr for other tools.
  const Disc *disc() const { return dynamic_cast<const Disc *>(bodies.empty() ? nullptr : bodies[0].get()); }
  /// Faces of the platens, lower and upper y [m]; both 0 for other tools.
  std::array<double, 2> platens() const;

  /// Smallest distance of a disc at the start from the rock in the reference configuration, negative inside [m].
  static double clearance(const ToolSettings &tool, const fem::FemSide &fem);

private:
  Eigen::Vector3d contact_force(const NearestSurface &surface, const Eigen::Vector3d &rock_velocity, double stiffness,
                                double damping, double share);
  /// Of the contact with the particle at place @p i [N/m]. Theory (9.8), (9.20).
  double stiffness_against(const dem::Particles &particles, int i) const;
  void push_particles(const RigidBody &body, dem::Particles &particles, double share);
  void push_surface(const RigidBody &body, fem::SurfaceContact &rock_surface, double share);
  Eigen::Vector3d holding_force(const NearestSurface &surface, const Eigen::Vector3d &rock_velocity, double stiffness,
                                double damping, double share);
  void hold_particles(const RigidBody &body, const std::vector<double> &start_gap, dem::Particles &particles, double share);
  void hold_surface(const RigidBody &body, fem::SurfaceContact &rock_surface, double share);

  ToolSettings settings;
  ContactLaw law;
  double particle_stiffness;  // [N/m]
  double mass_stiffness = 0.; // of a particle per mass, if the stiffness follows the time step [1/s^2]
  double density;             // [kg/m^3]
  double surface_stiffness;   // [N/m^3]
  double surface_damping;     // [N s/m^3]
  MPI_Comm comm;
  std::vector<std::unique_ptr<RigidBody>> bodies;
  std::vector<double> shares; // of each body's force in the load
  double mean_diameter;       // [m]
  // Of platens that pull: gap of each particle of the store at the start [m]; infinite: it is not held.
  std::array<std::vector<double>, 2> start_gaps;
  Load load;
  std::vector<int> touched_particles;
  std::vector<double> contact_stiffness;
  std::vector<double> contact_weights;
  fem::SurfacePoints points;
  Eigen::Matrix3Xd point_force;
};
} // namespace kerf
