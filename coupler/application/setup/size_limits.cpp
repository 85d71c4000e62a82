// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/application/setup/size_limits.h"

#include "coupler/base/errors.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>
#include <sys/resource.h>

namespace kerf
{
namespace
{
constexpr double largest_number = std::numeric_limits<int>::max(); // cells and particles are numbered by int

/// Cells of sizes h g, h g^2, ... that fill @p length, none larger than @p bound (0: none).
double graded_cells(double length, double h, double growth, double bound)
{
  if (length <= 0.)
    return 0.;
  double n = length / h;
  if (growth > 1.)
    n = std::min(n, std::log1p(length * (growth - 1.) / (h * growth)) / std::log(growth) + (bound > 0. ? length / bound : 0.));
  return std::ceil(n);
}

double box_cells(const fem::MeshSettings &mesh, int dim)
{
  double cells = 1.;
  for (int c = 0; c < dim; ++c)
  {
    const double lower = mesh.lower[c], upper = mesh.upper[c];
    double a = std::clamp(mesh.fine_lower[c], lower, upper), b = std::clamp(mesh.fine_upper[c], lower, upper);
    if (!(b > a))
      a = lower, b = upper;
    const auto side = [&](double length) { return graded_cells(length, mesh.cell_size, mesh.growth, mesh.largest_cell_size); };
    cells *= side(a - lower) + std::max(1., std::round((b - a) / mesh.cell_size)) + side(upper - b);
  }
  return cells;
}

/// @param item what is counted, in the plural @param key with its value, and what to do about it
void check_size(const Case &settings, double number, double bytes, const std::string &item, const std::string &key)
{
  const double there_is = available_memory();
  if (number <= largest_number && (settings.force || bytes <= there_is))
    return;
  std::ostringstream text;
  text.precision(3);
  text << settings.directory << "/case.prm: " << key << ": about " << number << ' ' << item;
  if (number > largest_number)
    text << ", kerf can number " << largest_number;
  else
    text << " need about " << bytes / 1e9 << " GB, this machine has " << there_is / 1e9 << " GB; --force tries it";
  throw InputError(text.str());
}

std::string with_value(const std::string &key, double value)
{
  std::ostringstream text;
  text << key << " = " << value;
  return text.str();
}
} // namespace

double bytes_of_program()
{
  return 190e6;
}
double bytes_of_cell(int dim)
{
  return dim == 2 ? 1000. : 2000.;
}
double bytes_of_particle(int dim)
{
  return dim == 2 ? 4300. : 9000.;
}
double bytes_of_stored_particle()
{
  return 120.;
}

double estimate_cells(const Case &settings)
{
  const fem::MeshSettings &mesh = settings.body.mesh;
  const int dim = settings.dim();
  double cells = 0., cell_volume = std::pow(mesh.cell_size, dim);
  const bool from_file = !mesh.gmsh_file.empty();
  if (from_file)
    cells = static_cast<double>(std::filesystem::file_size(mesh.gmsh_file)) / (dim == 2 ? 16. : 24.); // a line of a cell
  else if (mesh.shape == fem::MeshShape::disc)
    cells = 2. * dem::box_volume(dim, mesh.lower, mesh.upper) / cell_volume; // they may have down to half the size
  else
    cells = box_cells(mesh, dim);
  double refined = 0.;
  for (const fem::RefinedBox &box : mesh.refined)
  {
    double inside = cells; // coarse cells that the box meets, each in part
    if (!from_file)
    {
      inside = 1.;
      for (int c = 0; c < dim; ++c)
      {
        const double length = std::min(box.upper[c], mesh.upper[c]) - std::max(box.lower[c], mesh.lower[c]);
        inside *= length > 0. ? length / mesh.cell_size + 1. : 0.;
      }
    }
    refined += std::min(inside, cells) * std::pow(2., box.levels * dim);
  }
  return cells + refined;
}

double estimate_particles(const dem::PackingSettings &packing, double volume)
{
  const double d = packing.mean_diameter, s = packing.radius_spread;
  const bool lattice = packing.kind != "random";
  if (packing.dim == 2)
    return volume * (lattice ? 0.907 : 0.84 / (1. + s * s / 3.)) / (M_PI / 4. * d * d);
  return volume * (lattice ? 0.74 : 0.62 / (1. + s * s)) / (M_PI / 6. * d * d * d);
}

double available_memory()
{
  double bytes = std::numeric_limits<double>::infinity();
  std::ifstream file("/proc/meminfo");
  for (std::string line; std::getline(file, line);)
    if (double kilobytes = 0.; line.rfind("MemAvailable:", 0) == 0 && std::istringstream(line.substr(13)) >> kilobytes)
      bytes = 1024. * kilobytes;
  if (double group = 0.; std::ifstream("/sys/fs/cgroup/memory.max") >> group && group > 0.) // "max" is no number
    bytes = std::min(bytes, group);
  rlimit limit = {};
  if (getrlimit(RLIMIT_AS, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY)
    bytes = std::min(bytes, static_cast<double>(limit.rlim_cur));
  return bytes;
}

void check_mesh_size(const Case &settings, int n_ranks)
{
  const double cells = estimate_cells(settings);
  const fem::MeshSettings &mesh = settings.body.mesh;
  const std::string key = !mesh.refined.empty()     ? "Mesh/Refine"
                          : !mesh.gmsh_file.empty() ? "Mesh/File"
                                                    : with_value("Mesh/Cell size", mesh.cell_size);
  check_size(settings, cells, bytes_of_program() + n_ranks * cells * bytes_of_cell(settings.dim()), "cells", key);
}

void check_contact_points(const Case &settings, int n_ranks)
{
  constexpr double bytes_of_point = 200.;
  const fem::MeshSettings &mesh = settings.body.mesh;
  if (!mesh.gmsh_file.empty())
    return; // the finite elements bound their number
  const Eigen::Vector3d extent = mesh.upper - mesh.lower;
  const double spacing = settings.body.surface_spacing;
  double points = 0.;
  for (int c = 0; c < settings.dim(); ++c) // two sides normal to each axis
    points +=
      2. * (settings.dim() == 2 ? extent[1 - c] / spacing : extent[(c + 1) % 3] / spacing * (extent[(c + 2) % 3] / spacing));
  check_size(settings, points, n_ranks * points * bytes_of_point, "contact points on the mesh's surface",
             with_value("Packing/Mean diameter", settings.packing.mean_diameter));
}

void check_particle_number(const Case &settings, double n_particles, int n_ranks)
{
  const double bytes =
    bytes_of_program() * n_ranks + n_particles * (bytes_of_particle(settings.dim()) + n_ranks * bytes_of_stored_particle());
  check_size(settings, n_particles, bytes, "particles", with_value("Packing/Mean diameter", settings.packing.mean_diameter));
}
} // namespace kerf
