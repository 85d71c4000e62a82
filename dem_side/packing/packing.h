// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/geometry/closed_surface.h"

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <vector>

namespace kerf::dem
{
/// Elastic bond parameters for which the stored packing has the moduli of the rock.
struct ElasticCalibration
{
  double k_n = 0.;              ///< normal stiffness [N/m] (2D: [N/m] per metre of thickness)
  double k_t = 0.;              ///< tangential stiffness, same unit
  double target_young = 0.;     ///< [Pa]; 0: not calibrated yet
  double target_poisson = 0.;   ///< [-]
  double achieved_young = 0.;   ///< relaxed modulus of the packing [Pa] (plane strain in 2D)
  double achieved_poisson = 0.; ///< [-]
  double anisotropy = 0.;       ///< largest deviation of the relaxed tensor from its isotropic fit, relative [-]
  Eigen::Vector3d axis_young = Eigen::Vector3d::Zero();   ///< relaxed modulus along each axis [Pa] (2D: x and y)
  Eigen::Vector3d axis_poisson = Eigen::Vector3d::Zero(); ///< mean of the two ratios from each axis [-]
};

/// Measures of a packing's quality, stored with it. Lengths are in mean diameters. 0 means not measured, e.g. because the
/// packing is too small for a core.
struct PackingQuality
{
  double solid_fraction = 0.;      ///< of the whole filled volume
  double core_solid_fraction = 0.; ///< away from the walls, over the Laguerre cells of the particles
  double coordination = 0.;        ///< bonds per particle
  double core_coordination = 0.;
  double largest_overlap = 0.;                      ///< between two particles [mean diameters]
  Eigen::Vector3d fabric = Eigen::Vector3d::Zero(); ///< eigenvalues of the mean of n (x) n over the core's bonds, rising; sum 1
  double isotropy = 0.;                             ///< smallest / largest of them; 1: isotropic
};

/// The difference of two points or, if shorter, of their periodic images. @param periodic lengths of the periods [m]; 0: not
/// periodic.
inline Eigen::Vector3d shortest_image(Eigen::Vector3d difference, const Eigen::Vector3d &periodic)
{
  for (int c = 0; c < 3; ++c)
    if (periodic[c] > 0.)
      difference[c] -= periodic[c] * std::round(difference[c] / periodic[c]);
  return difference;
}

/// Orientation and position of a lattice.
struct Lattice
{
  int row_axis = 0; ///< rows of touching particles along x (0), or y (1) in the triangular lattice
  /// x of a plane of particles [m]; the lattice fills lower <= x < upper. Not a number: the block is centred and does not
  /// extend beyond the sides.
  double plane_at = std::numeric_limits<double>::quiet_NaN();

  bool operator==(const Lattice &other) const
  {
    const bool both_centred = std::isnan(plane_at) && std::isnan(other.plane_at);
    return row_axis == other.row_axis && (both_centred || plane_at == other.plane_at);
  }
};

/// PackingSettings that a packing attains approximately, as they were asked for. Not a number: the store is of a version that
/// did not write them.
struct AskedSettings
{
  double mean_diameter = std::numeric_limits<double>::quiet_NaN(); ///< [m]
  double radius_spread = std::numeric_limits<double>::quiet_NaN(); ///< [-]
  double gap_tolerance = std::numeric_limits<double>::quiet_NaN(); ///< [-]
};

/// [m^3], in two dimensions [m^2].
double box_volume(int dim, const Eigen::Vector3d &lower, const Eigen::Vector3d &upper);

/// The stored discretisation of the whole rock. It is generated beforehand; a simulation takes particles from it as it needs
/// them. In 2D the particles are cylinders of unit thickness with z = 0.
struct Packing
{
  int dim = 2;
  std::string kind;             ///< as PackingSettings::kind
  unsigned seed = 0;            ///< of the random packing
  double gap_tolerance = 0.;    ///< pairs closer than gap_tolerance * mean radius are bonded [-]
  double mean_diameter = 0.;    ///< [m]
  Eigen::Vector3d lower, upper; ///< filled box, or bounding box of the filled surface [m]
  /// Length of the box along its periodic axes, 0 along the others [m].
  Eigen::Vector3d periodic = Eigen::Vector3d::Zero();
  Lattice lattice; ///< settings of a lattice
  AskedSettings asked;
  std::vector<double> shape;  ///< ClosedSurface::moments() of the filled surface; empty: a box, or a store without them
  double volume_filled = 0.;  ///< [m^3] (2D: [m^2]); 0: the box
  Eigen::Matrix3Xd positions; ///< centres [m]
  Eigen::VectorXd radii;      ///< [m]
  std::vector<std::array<int, 2>> bonds; ///< index pairs, first < second, sorted, without duplicates
  ElasticCalibration calibration;
  PackingQuality quality; ///< measured when the packing was generated

  int size() const { return static_cast<int>(radii.size()); }
  double volume(int i) const;    ///< pi r^2 (2D) or 4/3 pi r^3 (3D)
  double solid_fraction() const; ///< volume of the particles / filled volume
  /// Density of the particles [kg/m^3] for which the packing with its voids has the density of the rock: @p rock_density /
  /// solid fraction.
  double particle_density(double rock_density) const { return rock_density / solid_fraction(); }
  double coordination() const; ///< bonds per particle, 2 n_bonds / n

  /// The difference of two points or, if shorter, of their periodic images (minimum image) [m].
  Eigen::Vector3d shortest(const Eigen::Vector3d &difference) const { return shortest_image(difference, periodic); }
  /// Vector from particle i to particle j as stored [m].
  Eigen::Vector3d branch(int i, int j) const { return shortest(positions.col(j) - positions.col(i)); }
  /// Displacement of a particle from its stored centre to @p position or a periodic image of it [m].
  Eigen::Vector3d displacement(int i, const Eigen::Vector3d &position) const { return shortest(position - positions.col(i)); }
  /// The periodic image of a point in the half-open box [lower, upper) [m].
  Eigen::Vector3d wrapped(Eigen::Vector3d position) const;
};

struct PackingSettings
{
  std::string kind = "random"; ///< or a lattice: "triangular" (2D), "fcc", "hcp" (3D)
  int dim = 2;
  Eigen::Vector3d lower = Eigen::Vector3d::Zero();
  Eigen::Vector3d upper = Eigen::Vector3d::Zero(); ///< box to fill [m]
  std::shared_ptr<const SurfaceMesh> surface;      ///< closed surface inside of the box, filled instead of the box
  double mean_diameter = 0.;                       ///< [m]
  double radius_spread = 0.4;                      ///< radii uniform in mean (1 - s, 1 + s) [-]
  double gap_tolerance = 0.1;                      ///< [-]
  unsigned seed = 1;
  std::array<bool, 3> periodic = {{false, false, false}}; ///< periodic axes; not x
  Lattice lattice;
};

/// Called from time to time with the completed fraction in [0, 1] and a short text.
using Progress = std::function<void(double, const std::string &)>;

/// Fills the box or the surface. Equal settings give equal packings. Serial, not collective. Throws std::invalid_argument with
/// one line when the settings are wrong or leave no room for particles, std::runtime_error when the compaction fails.
Packing generate_packing(const PackingSettings &settings, const Progress &progress = {});

/// Bonds every pair with a gap below @p gap_tolerance times the mean radius of all particles. Theory (11.5).
void bond_by_gap(Packing &packing, double gap_tolerance);

/// The store is an HDF5 file; for its errors see Hdf5Writer and Hdf5Reader. Every value that is read is within its range: all
/// numbers are finite, the box has an extent, particles lie in it and hardly overlap, bonds are as long as the gap tolerance
/// allows.
void save_packing(const Packing &packing, const std::string &path);
Packing load_packing(const std::string &path);
} // namespace kerf::dem
