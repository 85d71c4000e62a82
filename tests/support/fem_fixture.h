// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "fem_side/fem_side.h"

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <unistd.h>

/// Rocks and meshes that the tests of the continuum share.
namespace kerf::fem::test
{
inline Material rock()
{
  Material material;
  material.density = 2650.;
  material.young = 40e9;
  material.poisson = 0.2;
  return material;
}

/// Structured box from the origin.
inline Settings box(const Eigen::Vector3d &upper, const double cell_size, MPI_Comm comm = MPI_COMM_WORLD)
{
  Settings settings;
  settings.comm = comm;
  settings.dim = upper.z() > 0. ? 3 : 2;
  settings.mesh.upper = upper;
  settings.mesh.cell_size = cell_size;
  settings.material = rock();
  return settings;
}

/// Gives quadrature points and points of the surface the weights of their places, weight(X).
template <typename Weight>
void set_weights(FemSide &side, const Weight &weight)
{
  const auto at = [&](const Eigen::Matrix3Xd &X)
  {
    Eigen::VectorXd alpha(X.cols());
    for (int i = 0; i < X.cols(); ++i)
      alpha[i] = weight(Eigen::Vector3d(X.col(i)));
    return alpha;
  };
  side.set_weights(at(side.quadrature_points()), at(side.surface_positions()));
}

inline BoundaryCondition condition(const int id, const BoundaryKind kind)
{
  BoundaryCondition result;
  result.id = id;
  result.kind = kind;
  return result;
}

/// The same number in (-1, 1) on every rank for the same index.
inline double noise(const std::uint64_t index)
{
  std::uint64_t z = (index + 77) * 6364136223846793005ull + 1442695040888963407ull;
  z = (z ^ (z >> 29)) * 0xbf58476d1ce4e5b9ull;
  z ^= z >> 32;
  return static_cast<double>(z >> 11) * 0x1p-52 - 1.;
}

/// In-plane noise for every column; rows above dim stay zero.
inline Eigen::Matrix3Xd noise_field(const int n, const double size, const std::uint64_t seed, const int dim = 2)
{
  Eigen::Matrix3Xd field = Eigen::Matrix3Xd::Zero(3, n);
  for (int i = 0; i < n; ++i)
    for (int d = 0; d < dim; ++d)
      field(d, i) = size * noise(seed * 1000003ull + 3ull * i + d);
  return field;
}

/// A gmsh file of this process, removed at the end of the scope.
class MshFile
{
public:
  explicit MshFile(const std::string &name)
    : path((std::filesystem::temp_directory_path() / ("kerf_" + name + "_" + std::to_string(getpid()) + ".msh")).string())
  {
  }
  ~MshFile() { std::filesystem::remove(path); }

  const std::string path;
};

/// nx x ny quadrilaterals of size h with every inner node moved by up to a quarter of h in each direction; boundary ids as in
/// the structured box. @p skew moves the upper right corner to the right by that much, so that the right side is not straight.
inline void write_distorted_msh(const std::string &path, const int nx, const int ny, const double h, const double skew = 0.)
{
  std::ofstream file(path);
  file.precision(17);
  const auto node = [nx](const int i, const int j) { return j * (nx + 1) + i + 1; };
  file << "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n" << (nx + 1) * (ny + 1) << '\n';
  for (int j = 0; j <= ny; ++j)
    for (int i = 0; i <= nx; ++i)
    {
      const bool inner = i > 0 && i < nx && j > 0 && j < ny;
      const double dx = inner ? 0.25 * noise(2 * node(i, j)) : (i == nx && j == ny ? skew / h : 0.);
      const double dy = inner ? 0.25 * noise(2 * node(i, j) + 1) : 0.;
      file << node(i, j) << ' ' << h * (i + dx) << ' ' << h * (j + dy) << " 0\n";
    }
  file << "$EndNodes\n$Elements\n" << nx * ny + 2 * (nx + ny) << '\n';
  int number = 0;
  const auto line = [&](const int id, const int a, const int b)
  { file << ++number << " 1 2 " << id << ' ' << id << ' ' << a << ' ' << b << '\n'; };
  for (int j = 0; j < ny; ++j)
  {
    line(0, node(0, j), node(0, j + 1));
    line(1, node(nx, j), node(nx, j + 1));
  }
  for (int i = 0; i < nx; ++i)
  {
    line(2, node(i, 0), node(i + 1, 0));
    line(3, node(i, ny), node(i + 1, ny));
  }
  for (int j = 0; j < ny; ++j)
    for (int i = 0; i < nx; ++i)
      file << ++number << " 3 2 9 9 " << node(i, j) << ' ' << node(i + 1, j) << ' ' << node(i + 1, j + 1) << ' '
           << node(i, j + 1) << '\n';
  file << "$EndElements\n";
}

/// nx x ny x nz hexahedra of size h with every inner node moved by up to 0.15 h in each direction; boundary ids as in the
/// structured box.
inline void write_distorted_hex_msh(const std::string &path, const int nx, const int ny, const int nz, const double h)
{
  std::ofstream file(path);
  file.precision(17);
  const auto node = [nx, ny](const int i, const int j, const int k) { return (k * (ny + 1) + j) * (nx + 1) + i + 1; };
  file << "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n" << (nx + 1) * (ny + 1) * (nz + 1) << '\n';
  for (int k = 0; k <= nz; ++k)
    for (int j = 0; j <= ny; ++j)
      for (int i = 0; i <= nx; ++i)
      {
        const bool inner = i > 0 && i < nx && j > 0 && j < ny && k > 0 && k < nz;
        const int number = node(i, j, k);
        const auto shift = [&](const int d) { return inner ? 0.15 * noise(3 * number + d) : 0.; };
        file << number << ' ' << h * (i + shift(0)) << ' ' << h * (j + shift(1)) << ' ' << h * (k + shift(2)) << '\n';
      }
  file << "$EndNodes\n$Elements\n" << nx * ny * nz + 2 * (nx * ny + ny * nz + nx * nz) << '\n';
  int number = 0;
  const auto quad = [&](const int id, const int a, const int b, const int c, const int d)
  { file << ++number << " 3 2 " << id << ' ' << id << ' ' << a << ' ' << b << ' ' << c << ' ' << d << '\n'; };
  for (int k = 0; k < nz; ++k)
    for (int j = 0; j < ny; ++j)
      for (const int i : {0, nx})
        quad(i == 0 ? 0 : 1, node(i, j, k), node(i, j + 1, k), node(i, j + 1, k + 1), node(i, j, k + 1));
  for (int k = 0; k < nz; ++k)
    for (int i = 0; i < nx; ++i)
      for (const int j : {0, ny})
        quad(j == 0 ? 2 : 3, node(i, j, k), node(i + 1, j, k), node(i + 1, j, k + 1), node(i, j, k + 1));
  for (int j = 0; j < ny; ++j)
    for (int i = 0; i < nx; ++i)
      for (const int k : {0, nz})
        quad(k == 0 ? 4 : 5, node(i, j, k), node(i + 1, j, k), node(i + 1, j + 1, k), node(i, j + 1, k));
  for (int k = 0; k < nz; ++k)
    for (int j = 0; j < ny; ++j)
      for (int i = 0; i < nx; ++i)
        file << ++number << " 5 2 9 9 " << node(i, j, k) << ' ' << node(i + 1, j, k) << ' ' << node(i + 1, j + 1, k) << ' '
             << node(i, j + 1, k) << ' ' << node(i, j, k + 1) << ' ' << node(i + 1, j, k + 1) << ' '
             << node(i + 1, j + 1, k + 1) << ' ' << node(i, j + 1, k + 1) << '\n';
  file << "$EndElements\n";
}

/// Sum over all ranks.
inline double global_sum(double value)
{
  MPI_Allreduce(MPI_IN_PLACE, &value, 1, MPI_DOUBLE, MPI_SUM, MPI_COMM_WORLD);
  return value;
}

inline int this_rank()
{
  int rank = 0;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  return rank;
}

/// Message for the user of the settings that building the side refuses; empty if it accepts them.
inline std::string error_of(const Settings &settings)
{
  try
  {
    make_fem_side(settings);
  }
  catch (const std::invalid_argument &error)
  {
    return error.what();
  }
  return "";
}

inline double total(const Energies &energies)
{
  return energies.kinetic + energies.elastic;
}

inline void step(FemSide &side, const double dt, const double time)
{
  side.begin_step(dt, time);
  side.compute_forces();
  side.end_step(dt, time);
}

/// Nodes on the outer boundary.
inline std::vector<bool> boundary_nodes(const Mesh &mesh)
{
  std::vector<bool> result(mesh.n_nodes(), false);
  for (const BoundaryFace &face : mesh.boundary)
    for (const int node : face.nodes)
      if (node >= 0)
        result[node] = true;
  return result;
}
} // namespace kerf::fem::test
