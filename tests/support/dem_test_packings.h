// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/dem_side.h"

#include <cmath>

/// Small packings made by hand, and what most particle tests do with them.
namespace kerf::dem::test
{
/// Bonds all pairs closer than @p reach.
inline void bond_near_pairs(Packing &packing, double reach)
{
  for (int i = 0; i < packing.size(); ++i)
    for (int j = i + 1; j < packing.size(); ++j)
      if ((packing.positions.col(i) - packing.positions.col(j)).norm() < reach)
        packing.bonds.push_back({{i, j}});
}

/// Triangular lattice of touching discs of radius r, rows along x; the lattice starts at the origin. Bonds by row order.
inline Packing triangular_lattice(int n_x, int n_y, double r)
{
  Packing packing;
  packing.kind = "triangular";
  packing.mean_diameter = 2. * r;
  packing.positions.setZero(3, n_x * n_y);
  packing.radii.setConstant(n_x * n_y, r);
  const auto at = [n_x](int column, int row) { return row * n_x + column; };
  for (int row = 0; row < n_y; ++row)
    for (int column = 0; column < n_x; ++column)
    {
      packing.positions.col(at(column, row)) << r * (2. * column + row % 2), std::sqrt(3.) * r * row, 0.;
      if (column + 1 < n_x)
        packing.bonds.push_back({{at(column, row), at(column + 1, row)}});
      const int left = column + row % 2 - 1; // of the two neighbours above
      for (const int above : {left, left + 1})
        if (row + 1 < n_y && above >= 0 && above < n_x)
          packing.bonds.push_back({{at(column, row), at(above, row + 1)}});
    }
  packing.lower = packing.positions.rowwise().minCoeff().array() - r;
  packing.upper = packing.positions.rowwise().maxCoeff().array() + r;
  return packing;
}

/// Face-centred cubic lattice of touching spheres of radius r, n cells a side.
inline Packing fcc_lattice(int n, double r)
{
  Packing packing;
  packing.kind = "fcc";
  packing.dim = 3;
  packing.mean_diameter = 2. * r;
  packing.positions.resize(3, 4 * n * n * n);
  packing.radii.setConstant(4 * n * n * n, r);
  const double side = 2. * std::sqrt(2.) * r;
  int k = 0;
  for (int x = 0; x < n; ++x)
    for (int y = 0; y < n; ++y)
      for (int z = 0; z < n; ++z)
        for (const auto &corner :
             {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(.5, .5, 0), Eigen::Vector3d(.5, 0, .5), Eigen::Vector3d(0, .5, .5)})
          packing.positions.col(k++) = side * (Eigen::Vector3d(x, y, z) + corner);
  packing.lower = packing.positions.rowwise().minCoeff().array() - r;
  packing.upper = packing.positions.rowwise().maxCoeff().array() + r;
  bond_near_pairs(packing, 2.01 * r);
  return packing;
}

/// Two particles on the x axis, the first at the origin.
inline Packing two_particles(double first_radius, double second_radius, double distance, int dim = 2)
{
  Packing packing;
  packing.dim = dim;
  packing.mean_diameter = first_radius + second_radius;
  packing.positions.setZero(3, 2);
  packing.positions(0, 1) = distance;
  packing.radii = Eigen::Vector2d(first_radius, second_radius);
  packing.bonds = {{{0, 1}}};
  packing.lower = Eigen::Vector3d::Constant(-first_radius);
  packing.upper = Eigen::Vector3d::Constant(first_radius);
  packing.upper[0] = distance + second_radius;
  return packing;
}

constexpr double unbreakable = 1e30;

/// k_n = 1e9, k_t = k_n / 4, no strength limit, no damping; density 2700; step 0.2 of 2 / omega_max of a triangular lattice
/// (dispersion relation: omega_max^2 = 6.5 k_n / m at k_t / k_n = 1/4); the domain leaves room around the packing.
inline Settings settings(const Packing &packing)
{
  Settings s;
  s.packing = &packing;
  s.bond.k_n = 1e9;
  s.bond.k_t = 0.25e9;
  s.bond.R_n = s.bond.R_t = unbreakable;
  s.bond.friction = 0.5;
  s.density = 2700.;
  const double r = packing.radii.minCoeff();
  const double mass = s.density * (packing.dim == 2 ? M_PI * r * r : 4. / 3. * M_PI * r * r * r);
  s.time_step = 0.2 * 2. / std::sqrt(6.5 * s.bond.k_n / mass);
  const double room = 3. * packing.mean_diameter;
  s.domain_lower = packing.lower.array() - room;
  s.domain_upper = packing.upper.array() + room;
  return s;
}

inline std::vector<NewParticle> all_particles(const Packing &packing)
{
  std::vector<NewParticle> particles(packing.size());
  for (int i = 0; i < packing.size(); ++i)
    particles[i].index = i;
  return particles;
}

/// Inserts with weight one and sets up.
inline void start(DemSide &dem, const Packing &packing, const std::vector<NewParticle> &particles, const ForceHook &hook = {})
{
  dem.insert(particles);
  dem.set_weights(Eigen::VectorXd::Ones(packing.size()));
  dem.setup(hook);
}

/// A number in [-1, 1) from an integer, the same on every machine.
inline double noise(std::uint64_t seed)
{
  seed = (seed + 0x9e3779b97f4a7c15ull) * 0xbf58476d1ce4e5b9ull;
  seed = (seed ^ (seed >> 27)) * 0x94d049bb133111ebull;
  return static_cast<double>((seed ^ (seed >> 31)) >> 11) * 0x1p-52 - 1.;
}

enum class Quantity
{
  position,
  velocity,
  angular_velocity,
  force,
  torque
};

/// A field of all particles on every rank, by index in the packing.
inline Eigen::Matrix3Xd gather(DemSide &dem, const Packing &packing, Quantity quantity, MPI_Comm comm = MPI_COMM_WORLD)
{
  const Particles p = dem.particles();
  const Vectors *fields[] = {&p.position, &p.velocity, &p.angular_velocity, &p.force, &p.torque};
  Eigen::Matrix3Xd all = Eigen::Matrix3Xd::Zero(3, packing.size());
  for (int i = 0; i < p.n; ++i)
    all.col(p.index[i]) = fields[static_cast<int>(quantity)]->col(i);
  MPI_Allreduce(MPI_IN_PLACE, all.data(), static_cast<int>(all.size()), MPI_DOUBLE, MPI_SUM, comm);
  return all;
}
} // namespace kerf::dem::test
