// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/case_file.h"
#include "dem_side/dem_side.h"
#include "fem_side/fem_side.h"

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

/// Rigid disc cutter in contact with particles and with the surface of the finite elements, each with its own weight, so that
/// the contact force does not jump when a cell below the tool is converted.
class Tool
{
public:
  /// @param k_n normal bond stiffness [N/m]; @param diameter mean particle diameter d [m]; @param density of the rock
  Tool(const Case::Tool &settings, double k_n, double diameter, double density, MPI_Comm comm);

  /// Places the tool at @p time [s].
  void move_to(double time);

  /// Adds contact forces to the particles of this rank and to the surface of the finite elements. Collective.
  void apply(dem::Particles &particles, fem::FemSide &fem);

  /// Force [N] and power [W] of the tool on the rock, summed over ranks by total(). Reaction on the tool = -force.
  struct Load
  {
    Eigen::Vector3d force = Eigen::Vector3d::Zero();
    double power = 0.;
  };
  const Load &local_load() const { return load; }
  Load total(const Load &local) const;

  bool present() const { return settings.present; }
  const Eigen::Vector3d &centre() const { return position; }
  double radius() const { return settings.radius; }
  double angle() const { return rotation_angle; }

  /// Distance of the disc from the rock in the reference configuration, negative inside [m].
  static double clearance(const Case::Tool &tool, const fem::FemSide &fem);

private:
  /// Force on a point of the rock with radius @p point_radius (0: surface point); adds it to the load.
  Eigen::Vector3d contact_force(const Eigen::Vector3d &point, const Eigen::Vector3d &velocity,
                                const Eigen::Vector3d &angular_velocity, double point_radius, double stiffness, double damping);

  Case::Tool settings;
  ToolPath path;
  ToolContactLaw law;
  double particle_stiffness; // [N/m]
  double surface_stiffness;  // [N/m^3], the particles' one spread over their spacing
  double surface_damping;    // [N s/m^3]
  MPI_Comm comm;
  Eigen::Vector3d position = Eigen::Vector3d::Zero(), velocity = Eigen::Vector3d::Zero();
  double spin = 0.;           // about z [rad/s]
  double rotation_angle = 0.; // [rad]
  double rotation_time = 0.;
  Load load;
  fem::SurfacePoints surface;
  Eigen::Matrix3Xd surface_force;
};
} // namespace kerf
