// SPDX-License-Identifier: GPL-2.0-or-later
#include "dem_side/packing/hdf5_file.h"
#include "dem_side/packing/packing.h"

#include <cmath>
#include <limits>

namespace kerf::dem
{
namespace
{
const std::string format_name = "kerf packing";
constexpr std::int64_t format_version = 2;

/// Visits the values of the calibration with their names in the file.
template <class Calibration, class Visitor>
void visit_values(Calibration &calibration, Visitor &&visit)
{
  visit("k_n", calibration.k_n);
  visit("k_t", calibration.k_t);
  visit("target_young", calibration.target_young);
  visit("target_poisson", calibration.target_poisson);
  visit("achieved_young", calibration.achieved_young);
  visit("achieved_poisson", calibration.achieved_poisson);
  visit("anisotropy", calibration.anisotropy);
}

/// The same for the numbers of PackingQuality.
template <class Quality, class Visitor>
void visit_quality(Quality &quality, Visitor &&visit)
{
  visit("solid_fraction", quality.solid_fraction);
  visit("core_solid_fraction", quality.core_solid_fraction);
  visit("coordination", quality.coordination);
  visit("core_coordination", quality.core_coordination);
  visit("largest_overlap", quality.largest_overlap);
  visit("isotropy", quality.isotropy);
}

std::vector<double> three(const Eigen::Vector3d &x)
{
  return {x[0], x[1], x[2]};
}

Eigen::Vector3d point(const Hdf5Reader &file, const std::string &name)
{
  const std::vector<double> values = file.numbers(name);
  if (values.size() != 3)
    file.fail("attribute '" + name + "' must have 3 values");
  return {values[0], values[1], values[2]};
}

void check(const Packing &packing, const Hdf5Reader &file)
{
  for (int c = 0; c < 3; ++c)
    if (packing.periodic[c] != 0. &&
        !(c < packing.dim &&
          std::abs(packing.periodic[c] - (packing.upper[c] - packing.lower[c])) <= 1e-9 * std::abs(packing.periodic[c])))
      file.fail("attribute 'periodic' is not the length of the box, or 0");
  for (int i = 0; i < packing.size(); ++i)
    if (!packing.positions.col(i).allFinite() || !(packing.radii[i] > 0.) || !std::isfinite(packing.radii[i]))
      file.fail("particle " + std::to_string(i) + " has no finite position and positive radius");
  for (int i = 0; i < packing.size(); ++i)
    for (int c = 0; c < 3; ++c)
    {
      const double x = packing.positions(c, i), r = packing.radii[i]; // compaction leaves small overlaps with the box
      const bool in = c < packing.dim ? x >= packing.lower[c] - r && x <= packing.upper[c] + r : x == 0.;
      if (!in || (c < packing.dim && !(2. * r <= packing.upper[c] - packing.lower[c])))
        file.fail("particle " + std::to_string(i) + " does not lie in the box");
    }
  for (std::size_t b = 0; b < packing.bonds.size(); ++b)
  {
    const auto &[i, j] = packing.bonds[b];
    if (i < 0 || j >= packing.size() || i >= j)
      file.fail("bond " + std::to_string(b) + " joins particles " + std::to_string(i) + " and " + std::to_string(j) + " of " +
                std::to_string(packing.size()));
    if (!((packing.positions.col(i) - packing.positions.col(j)).norm() > 1e-3 * (packing.radii[i] + packing.radii[j])))
      file.fail("particles " + std::to_string(i) + " and " + std::to_string(j) + " of a bond are at the same place");
    if (b > 0 && !(packing.bonds[b - 1] < packing.bonds[b]))
      file.fail("bond " + std::to_string(b) + " is double or out of order");
  }
}
} // namespace

void save_packing(const Packing &packing, const std::string &path)
{
  Hdf5Writer file(path);
  file.attribute("format", format_name);
  file.attribute("version", format_version);
  file.attribute(
    "units",
    std::string(
      "positions, radii, mean_diameter, box: m; k_n, k_t: N/m (2D: N/m per m); largest_overlap: mean diameters; young: Pa"));
  file.attribute("kind", packing.kind);
  file.attribute("dim", packing.dim);
  file.attribute("seed", std::int64_t(packing.seed));
  file.attribute("gap_tolerance", packing.gap_tolerance);
  file.attribute("mean_diameter", packing.mean_diameter);
  file.attribute("lower", three(packing.lower));
  file.attribute("upper", three(packing.upper));
  file.attribute("volume_filled", packing.volume_filled);
  file.attribute("periodic", three(packing.periodic));
  file.attribute("lattice_row_axis", packing.lattice.row_axis);
  if (!std::isnan(packing.lattice.plane_at))
    file.attribute("lattice_plane_at", packing.lattice.plane_at);
  const auto write = [&](const char *name, double value) { file.attribute(name, value); };
  visit_values(packing.calibration, write);
  file.attribute("axis_young", three(packing.calibration.axis_young));
  file.attribute("axis_poisson", three(packing.calibration.axis_poisson));
  visit_quality(packing.quality, write);
  file.attribute("fabric", three(packing.quality.fabric));
  // A column of the matrix is a particle, so the matrix in memory is the table row by row.
  file.table("positions", packing.positions.data(), packing.positions.cols(), 3);
  file.table("radii", packing.radii.data(), packing.radii.size());
  std::vector<int> bonds;
  for (const auto &[i, j] : packing.bonds)
    bonds.insert(bonds.end(), {i, j});
  file.table("bonds", bonds.data(), packing.bonds.size(), 2);
  file.close();
}

Packing load_packing(const std::string &path)
{
  const Hdf5Reader file(path);
  if (!file.has_attribute("format") || file.text("format") != format_name)
    file.fail("is not a packing file");
  if (const auto version = file.integer("version"); version != format_version)
    file.fail("has packing format version " + std::to_string(version) + ", this program reads version " +
              std::to_string(format_version));

  Packing packing;
  packing.kind = file.text("kind");
  const std::int64_t dim = file.integer("dim"), seed = file.integer("seed");
  if (dim != 2 && dim != 3)
    file.fail("dim must be 2 or 3, not " + std::to_string(dim));
  if (seed < 0 || seed > std::int64_t(std::numeric_limits<unsigned>::max()))
    file.fail("seed " + std::to_string(seed) + " is out of range");
  packing.dim = static_cast<int>(dim);
  packing.seed = static_cast<unsigned>(seed);
  packing.gap_tolerance = file.number("gap_tolerance");
  packing.mean_diameter = file.number("mean_diameter");
  packing.lower = point(file, "lower");
  packing.upper = point(file, "upper");
  packing.volume_filled = file.number("volume_filled");
  if (file.has_attribute("periodic")) // absent in stores of versions without periodic packings
  {
    packing.periodic = point(file, "periodic");
    packing.lattice.row_axis = static_cast<int>(file.integer("lattice_row_axis"));
    if (file.has_attribute("lattice_plane_at"))
      packing.lattice.plane_at = file.number("lattice_plane_at");
  }
  const auto read = [&](const char *name, double &value) { value = file.number(name); };
  visit_values(packing.calibration, read);
  packing.calibration.axis_young = point(file, "axis_young");
  packing.calibration.axis_poisson = point(file, "axis_poisson");
  visit_quality(packing.quality, read);
  packing.quality.fabric = point(file, "fabric");

  const std::vector<double> positions = file.table("positions", 3), radii = file.table("radii");
  const std::vector<int> bonds = file.integer_table("bonds", 2);
  if (radii.empty() && positions.empty())
    file.fail("the packing holds no particles");
  if (positions.size() != 3 * radii.size())
    file.fail("has " + std::to_string(positions.size() / 3) + " positions but " + std::to_string(radii.size()) + " radii");
  packing.positions = Eigen::Map<const Eigen::Matrix3Xd>(positions.data(), 3, radii.size());
  packing.radii = Eigen::Map<const Eigen::VectorXd>(radii.data(), radii.size());
  for (std::size_t b = 0; b < bonds.size(); b += 2)
    packing.bonds.push_back({bonds[b], bonds[b + 1]});
  check(packing, file);
  return packing;
}
} // namespace kerf::dem
