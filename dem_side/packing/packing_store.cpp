// SPDX-License-Identifier: GPL-2.0-or-later
#include "dem_side/packing/hdf5_file.h"
#include "dem_side/packing/packing.h"

#include "dem_side/geometry/cell_list.h"

#include <cmath>
#include <limits>
#include <sstream>

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

/// The same for what was asked for.
template <class Asked, class Visitor>
void visit_asked(Asked &asked, Visitor &&visit)
{
  visit("asked_mean_diameter", asked.mean_diameter);
  visit("asked_radius_spread", asked.radius_spread);
  visit("asked_gap_tolerance", asked.gap_tolerance);
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

/// Throws when the value is not a number in [least, most].
void check_range(const Hdf5Reader &file, const std::string &name, double value, double least, double most)
{
  if (value >= least && value <= most)
    return;
  std::ostringstream text;
  text << "attribute '" << name << "' = " << value << " is not in [" << least << ", " << most << "]";
  file.fail(text.str());
}

constexpr double largest = std::numeric_limits<double>::max(), smallest = std::numeric_limits<double>::min();
constexpr double round_off = 1e-6; ///< of lengths, relative to the mean diameter

void check_kind(const Packing &packing, const Hdf5Reader &file)
{
  const bool flat = packing.kind == "triangular", solid = packing.kind == "fcc" || packing.kind == "hcp";
  if (!(packing.kind == "random" || (flat && packing.dim == 2) || (solid && packing.dim == 3)))
    file.fail("attribute 'kind' = '" + packing.kind + "' is no packing of " + std::to_string(packing.dim) + " dimensions");
}

void check_attributes(const Packing &packing, const Hdf5Reader &file)
{
  check_kind(packing, file);
  check_range(file, "mean_diameter", packing.mean_diameter, smallest, largest);
  check_range(file, "gap_tolerance", packing.gap_tolerance, 0., 2.);
  for (int c = 0; c < packing.dim; ++c)
    if (!(std::isfinite(packing.lower[c]) && std::isfinite(packing.upper[c]) && packing.lower[c] < packing.upper[c]))
      file.fail("attributes 'lower' and 'upper' are no corners of a box");
  for (int c = 0; c < 3; ++c)
    if (packing.periodic[c] != 0. &&
        !(c < packing.dim &&
          std::abs(packing.periodic[c] - (packing.upper[c] - packing.lower[c])) <= 1e-9 * std::abs(packing.periodic[c])))
      file.fail("attribute 'periodic' is not the length of the box, or 0");
  check_range(file, "volume_filled", packing.volume_filled, 0.,
              (1. + round_off) * box_volume(packing.dim, packing.lower, packing.upper));
  for (const double moment : packing.shape)
    check_range(file, "shape", moment, -1. - round_off, 1. + round_off);

  const ElasticCalibration &elastic = packing.calibration;
  const bool calibrated = elastic.target_young != 0.;
  check_range(file, "target_young", elastic.target_young, 0., largest);
  check_range(file, "k_n", elastic.k_n, calibrated ? smallest : 0., largest);
  check_range(file, "k_t", elastic.k_t, 0., largest);
  check_range(file, "achieved_young", elastic.achieved_young, calibrated ? smallest : 0., largest);
  check_range(file, "target_poisson", elastic.target_poisson, -1., 0.5);
  check_range(file, "achieved_poisson", elastic.achieved_poisson, -1., 1.);
  check_range(file, "anisotropy", elastic.anisotropy, 0., largest);
  for (int c = 0; c < 3; ++c)
  {
    check_range(file, "axis_young", elastic.axis_young[c], 0., largest);
    check_range(file, "axis_poisson", elastic.axis_poisson[c], -largest, largest);
    check_range(file, "fabric", packing.quality.fabric[c], 0., 1. + round_off);
  }
  visit_quality(packing.quality, [&](const char *name, double value) { check_range(file, name, value, 0., largest); });
}

void check_particles(const Packing &packing, const Hdf5Reader &file)
{
  const double d = packing.mean_diameter;
  double sum = 0.;
  for (int i = 0; i < packing.size(); ++i)
  {
    const auto particle = [i] { return "particle " + std::to_string(i); };
    if (!(packing.radii[i] > 0. && packing.radii[i] <= d))
      file.fail(particle() + " has no radius in (0, mean diameter]");
    for (int c = 0; c < 3; ++c)
    {
      const double low = c < packing.dim ? packing.lower[c] : 0., high = c < packing.dim ? packing.upper[c] : 0.;
      if (!(packing.positions(c, i) >= low - round_off * d && packing.positions(c, i) <= high + round_off * d))
        file.fail(particle() + " is not in the box");
    }
    sum += packing.radii[i];
  }
  if (!(std::abs(2. * sum / packing.size() - d) <= round_off * d))
    file.fail("attribute 'mean_diameter' is not that of the radii");
  if (const double fraction = packing.solid_fraction(); !(fraction >= 0.01 && fraction <= 1.))
    file.fail("the particles do not fill their volume: solid fraction " + std::to_string(fraction));
  CellList(packing.positions, 2. * packing.radii.maxCoeff(), packing.periodic)
    .for_each_pair(
      [&](int i, int j)
      {
        if (!(packing.branch(i, j).norm() >= 0.5 * (packing.radii[i] + packing.radii[j])))
          file.fail("particles " + std::to_string(i) + " and " + std::to_string(j) + " overlap");
      });
}

void check_bonds(const Packing &packing, const Hdf5Reader &file)
{
  if (packing.bonds.empty())
    file.fail("the packing has no bonds");
  const double largest_gap = (packing.gap_tolerance * 0.5 + round_off) * packing.mean_diameter;
  for (std::size_t b = 0; b < packing.bonds.size(); ++b)
  {
    const auto &[i, j] = packing.bonds[b];
    const std::string name = "bond " + std::to_string(b);
    if (!(i >= 0 && i < j && j < packing.size()))
      file.fail(name + " joins particles " + std::to_string(i) + " and " + std::to_string(j) + " of " +
                std::to_string(packing.size()));
    if (b > 0 && !(packing.bonds[b - 1] < packing.bonds[b]))
      file.fail(name + " is double or out of order");
    if (!(packing.branch(i, j).norm() <= packing.radii[i] + packing.radii[j] + largest_gap))
      file.fail(name + " joins particles " + std::to_string(i) + " and " + std::to_string(j) +
                ", which are further apart than the gap tolerance");
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
  if (!std::isnan(packing.asked.radius_spread))
    visit_asked(packing.asked, [&](const char *name, double value) { file.attribute(name, value); });
  if (!packing.shape.empty())
    file.attribute("shape", packing.shape);
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
    const std::int64_t row_axis = file.integer("lattice_row_axis");
    check_range(file, "lattice_row_axis", double(row_axis), 0., 1.);
    packing.lattice.row_axis = static_cast<int>(row_axis);
    if (file.has_attribute("lattice_plane_at"))
    {
      packing.lattice.plane_at = file.number("lattice_plane_at");
      check_range(file, "lattice_plane_at", packing.lattice.plane_at, -largest, largest);
    }
  }
  const auto read = [&](const char *name, double &value) { value = file.number(name); };
  if (file.has_attribute("asked_radius_spread")) // absent in stores of versions that did not compare it
    visit_asked(packing.asked,
                [&](const char *name, double &value) { check_range(file, name, value = file.number(name), 0., largest); });
  if (file.has_attribute("shape"))
    packing.shape = file.numbers("shape");
  visit_values(packing.calibration, read);
  packing.calibration.axis_young = point(file, "axis_young");
  packing.calibration.axis_poisson = point(file, "axis_poisson");
  visit_quality(packing.quality, read);
  packing.quality.fabric = point(file, "fabric");
  check_attributes(packing, file);

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
  check_particles(packing, file);
  check_bonds(packing, file);
  return packing;
}
} // namespace kerf::dem
