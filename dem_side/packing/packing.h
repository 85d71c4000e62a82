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
/// Elastic bond parameters that give the stored packing the moduli of the rock.
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

/// What a packing is judged by, stored with it. Lengths in mean diameters; 0: not measured, e.g. too small for a core.
struct PackingQuality
{
  double solid_fraction = 0.;      ///< of the whole volume that is filled
  double core_solid_fraction = 0.; ///< away from the walls, over the particles' own cells
  double coordination = 0.;        ///< bonds a particle
  double core_coordination = 0.;
  double largest_overlap = 0.;                      ///< between two particles [mean diameters]
  Eigen::Vector3d fabric = Eigen::Vector3d::Zero(); ///< eigenvalues of the mean of n (x) n over the core's bonds, rising; sum 1
  double isotropy = 0.;                             ///< smallest / largest of them; 1: isotropic
};

/// Bond strengths that give packings of this kind the strengths of the rock, from simulated tests on several packings.
struct StrengthCalibration
{
  double R_n = 0., R_t = 0.;        ///< tensile and shear strength of a bond [N] (2D: [N/m])
  double shear_friction = 0.;       ///< of the bond, as it was when the strengths were found [-]
  double friction = 0.;             ///< of broken bonds, likewise [-]
  double target_tensile = 0.;       ///< Brazilian strength [Pa]; 0: not calibrated yet
  double target_compressive = 0.;   ///< uniaxial compressive strength [Pa]
  double achieved_tensile = 0.;     ///< mean over the packings [Pa]
  double scatter_tensile = 0.;      ///< standard deviation over the packings [Pa]
  double achieved_compressive = 0.; ///< mean over the packings [Pa]
  double scatter_compressive = 0.;  ///< standard deviation over the packings [Pa]
  double achieved_young = 0.;       ///< of the compressed specimens, mean [Pa]
  double scatter_young = 0.;        ///< [Pa]
  double achieved_poisson = 0.;     ///< of the compressed specimens, mean [-]
  double scatter_poisson = 0.;      ///< [-]
  double n_packings = 0.;           ///< tested
};

/// The difference of two points, or of their images if these are closer. @param periodic lengths after which space repeats
/// itself [m], 0: not.
inline Eigen::Vector3d shortest_image(Eigen::Vector3d difference, const Eigen::Vector3d &periodic)
{
  for (int c = 0; c < 3; ++c)
    if (periodic[c] > 0.)
      difference[c] -= periodic[c] * std::round(difference[c] / periodic[c]);
  return difference;
}

/// Orientation and place of a lattice.
struct Lattice
{
  int row_axis = 0; ///< rows of touching particles along x (0), or y (1) in the triangular lattice
  /// x of a plane of particles [m]; the particles with lower <= x < upper are taken. Not a number: the block is centred and
  /// touches no more than the sides.
  double plane_at = std::numeric_limits<double>::quiet_NaN();

  bool operator==(const Lattice &other) const
  {
    const bool both_centred = std::isnan(plane_at) && std::isnan(other.plane_at);
    return row_axis == other.row_axis && (both_centred || plane_at == other.plane_at);
  }
};

/// [m^3], in two dimensions [m^2].
double box_volume(int dim, const Eigen::Vector3d &lower, const Eigen::Vector3d &upper);

/// The stored discretisation of the whole rock: generated beforehand, particles are taken from it when they are needed.
/// In 2D the particles are cylinders of unit thickness with z = 0.
struct Packing
{
  int dim = 2;
  std::string kind;             ///< as PackingSettings::kind
  unsigned seed = 0;            ///< of the random packing
  double gap_tolerance = 0.;    ///< pairs closer than gap_tolerance * mean radius are bonded [-]
  double mean_diameter = 0.;    ///< [m]
  Eigen::Vector3d lower, upper; ///< box that is filled, or around the surface that is filled [m]
  /// Length of the box along the axes across which the packing repeats itself, 0 along the others [m].
  Eigen::Vector3d periodic = Eigen::Vector3d::Zero();
  Lattice lattice;                       ///< what a lattice was made with
  double volume_filled = 0.;             ///< [m^3] (2D: [m^2]); 0: the box
  Eigen::Matrix3Xd positions;            ///< centres [m]
  Eigen::VectorXd radii;                 ///< [m]
  std::vector<std::array<int, 2>> bonds; ///< index pairs, first < second, sorted, no doubles
  ElasticCalibration calibration;
  StrengthCalibration strength;
  PackingQuality quality; ///< of the time when it was made

  int size() const { return static_cast<int>(radii.size()); }
  double volume(int i) const;    ///< pi r^2 (2D) or 4/3 pi r^3 (3D)
  double solid_fraction() const; ///< volume of the particles / volume that is filled
  double coordination() const;   ///< bonds a particle, 2 n_bonds / n

  /// The difference of two points, or of their images if these are closer (minimum image) [m].
  Eigen::Vector3d shortest(const Eigen::Vector3d &difference) const { return shortest_image(difference, periodic); }
  /// From particle i to particle j as stored [m].
  Eigen::Vector3d branch(int i, int j) const { return shortest(positions.col(j) - positions.col(i)); }
  /// How far a particle that is now at @p position, or at an image of it, has come from its stored centre [m].
  Eigen::Vector3d displacement(int i, const Eigen::Vector3d &position) const { return shortest(position - positions.col(i)); }
  /// The image of a point in the half-open box [lower, upper) along periodic axes [m].
  Eigen::Vector3d wrapped(Eigen::Vector3d position) const;
};

struct PackingSettings
{
  std::string kind = "random"; ///< or a lattice: "triangular" (2D), "fcc", "hcp" (3D)
  int dim = 2;
  Eigen::Vector3d lower = Eigen::Vector3d::Zero();
  Eigen::Vector3d upper = Eigen::Vector3d::Zero(); ///< box to fill [m]
  std::shared_ptr<const SurfaceMesh> surface;      ///< closed surface inside the box to fill instead of it
  double mean_diameter = 0.;                       ///< [m]
  double radius_spread = 0.4;                      ///< radii uniform in mean (1 - s, 1 + s) [-]
  double gap_tolerance = 0.1;                      ///< [-]
  unsigned seed = 1;
  std::array<bool, 3> periodic = {{false, false, false}}; ///< axes across which the packing repeats itself; not x
  Lattice lattice;
};

/// Called now and then with the done fraction in [0, 1] and a short text.
using Progress = std::function<void(double, const std::string &)>;

/// Fills the box or the surface; same settings, same packing. Not collective (serial). Throws std::runtime_error with one line.
Packing generate_packing(const PackingSettings &settings, const Progress &progress = {});

/// Bonds every pair with gap < tolerance * mean radius of all particles.
void bond_by_gap(Packing &packing, double gap_tolerance);

/// HDF5 store. load_packing() throws std::runtime_error "FILE: what is wrong".
void save_packing(const Packing &packing, const std::string &path);
Packing load_packing(const std::string &path);
} // namespace kerf::dem
