// SPDX-License-Identifier: GPL-2.0-or-later
#include "dem_side/generation/packing_generator.h"

#include "dem_side/generation/compaction.h"
#include "dem_side/geometry/cell_list.h"
#include "dem_side/packing/packing_quality.h"

#include <sstream>
#include <stdexcept>

namespace kerf::dem
{
namespace
{
constexpr double largest_overlap = 1e-3;    ///< between particles of the finished packing [mean radii]
constexpr double diameter_tolerance = 5e-3; ///< of the mean diameter after the compaction
constexpr double clean_up_tolerance = 1e-2; ///< of the mean diameter of the finished packing

void check_periodic(const PackingSettings &settings, std::ostringstream &error)
{
  const bool is_lattice = settings.kind != "random", repeats = settings.periodic[1] || settings.periodic[2];
  const int row_axis = settings.lattice.row_axis;
  if (settings.periodic[0] || (settings.dim == 2 && settings.periodic[2]))
    error << "packing: periodic axes are y" << (settings.dim == 2 ? "" : " and z") << " in " << settings.dim << " dimensions";
  else if (repeats && settings.surface)
    error << "packing: a periodic packing fills a box, not a surface";
  else if (row_axis != 0 && !(row_axis == 1 && settings.kind == "triangular"))
    error << "packing: rows along another axis than x are there in the triangular lattice only, along y";
  else if (!std::isnan(settings.lattice.plane_at) && !is_lattice)
    error << "packing: a random packing has no planes of particles to place";
  else if (repeats && is_lattice)
    if (const std::string misfit = lattice_misfit(settings); !misfit.empty())
      error << "packing: " << misfit;
}

void check(const PackingSettings &settings)
{
  std::ostringstream error;
  const bool flat_kind = settings.kind == "triangular", solid_kind = settings.kind == "fcc" || settings.kind == "hcp";
  if (settings.kind != "random" && !flat_kind && !solid_kind)
    error << "packing: kind '" << settings.kind << "' is unknown, use random, triangular, fcc or hcp";
  else if (settings.dim != 2 && settings.dim != 3)
    error << "packing: there are 2 or 3 dimensions, not " << settings.dim;
  else if ((flat_kind && settings.dim == 3) || (solid_kind && settings.dim == 2))
    error << "packing: kind '" << settings.kind << "' is a lattice in " << (flat_kind ? 2 : 3) << " dimensions, not "
          << settings.dim;
  else if (!(settings.mean_diameter > 0.) || !std::isfinite(settings.mean_diameter))
    error << "packing: the mean diameter must be positive, not " << settings.mean_diameter;
  else if (!(settings.radius_spread >= 0. && settings.radius_spread <= 0.8))
    error << "packing: the radius spread must be in [0, 0.8], not " << settings.radius_spread;
  else if (!(settings.gap_tolerance >= 0. && settings.gap_tolerance <= 2.))
    error << "packing: the gap tolerance must be in [0, 2] mean radii, not " << settings.gap_tolerance;
  else
    for (int c = 0; c < settings.dim; ++c)
    {
      const double sides = (settings.upper[c] - settings.lower[c]) / settings.mean_diameter;
      if (!(sides >= 4.) || !(sides <= 1e5))
      {
        error << "packing: side "
              << "xyz"[c] << " of the box is " << sides << " mean diameters long, it must be 4 to 100000";
        break;
      }
    }
  if (error.str().empty())
    check_periodic(settings, error);
  if (!error.str().empty())
    throw std::invalid_argument(error.str());
}

/// The settings with the bounding box of their surface, which must lie in the box of the settings.
PackingSettings with_surface_box(PackingSettings settings)
{
  if (!settings.surface || settings.surface->points.cols() == 0)
    return settings;
  const Eigen::Vector3d low = settings.surface->points.rowwise().minCoeff(),
                        high = settings.surface->points.rowwise().maxCoeff();
  for (int c = 0; c < settings.dim; ++c)
  {
    const double slack = 1e-6 * (settings.upper[c] - settings.lower[c]);
    if (low[c] < settings.lower[c] - slack || high[c] > settings.upper[c] + slack)
    {
      std::ostringstream error;
      error << "packing: the surface reaches from " << low[c] << " to " << high[c] << " m along "
            << "xyz"[c] << ", it must be inside of the box from " << settings.lower[c] << " to " << settings.upper[c];
      throw std::invalid_argument(error.str());
    }
    settings.lower[c] = low[c];
    settings.upper[c] = high[c];
  }
  return settings;
}

double mean(const Eigen::VectorXd &values)
{
  double sum = 0.; // in index order, because Eigen's order depends on the machine
  for (Eigen::Index i = 0; i < values.size(); ++i)
    sum += values[i];
  return sum / double(values.size());
}

/// Expected solid fraction of a jammed packing, which is lower along the walls.
double expected_fraction(const PackingSettings &settings, const Container &container)
{
  const double in_bulk = settings.dim == 2 ? 0.85 : 0.645, lost_layer = settings.dim == 2 ? 0.10 : 0.12; // [diameters]
  return in_bulk * std::max(0.6, 1. - lost_layer * settings.mean_diameter * container.area() / container.volume());
}

/// Radii of a uniform distribution in mean (1 -+ spread), with the volume @p space in total. They are its quantiles in random
/// order, so that mean and spread do not depend on the seed.
std::vector<double> draw_radii(const PackingSettings &settings, double space, std::mt19937_64 &random)
{
  const double r = settings.mean_diameter / 2., s = settings.radius_spread;
  const double pi = 3.14159265358979323846;
  const double mean_volume = settings.dim == 2 ? pi * r * r * (1. + s * s / 3.) : 4. / 3. * pi * r * r * r * (1. + s * s);
  const int n = std::max(1, static_cast<int>(space / mean_volume + 0.5));
  std::vector<double> radii(n);
  for (int i = 0; i < n; ++i)
    radii[i] = r * (1. + s * ((2. * i + 1.) / n - 1.));
  for (int i = n - 1; i > 0; --i) // not by std::shuffle, which differs between libraries
    std::swap(radii[i], radii[static_cast<int>(uniform(random) * (i + 1))]);
  return radii;
}

/// Random points, uniformly distributed inside. Points close in space get close indices, which makes loops over bonds faster.
Eigen::Matrix3Xd draw_positions(const Container &container, int n, double mean_radius, std::mt19937_64 &random)
{
  Eigen::Matrix3Xd points = Eigen::Matrix3Xd::Zero(3, n);
  std::int64_t tries = 0;
  for (int i = 0; i < n; ++tries)
  {
    if (tries > std::int64_t(1000) * n + 10000)
      throw std::invalid_argument("packing: the surface leaves too little room for its particles, use smaller ones");
    Eigen::Vector3d x = Eigen::Vector3d::Zero();
    for (int c = 0; c < container.dim(); ++c)
      x[c] = container.lower()[c] + (container.upper()[c] - container.lower()[c]) * uniform(random);
    if (container.contains(x) && container.walls(x, 0.5 * mean_radius).empty())
      points.col(i++) = x;
  }
  const std::vector<int> order = CellList(points, 4. * mean_radius).sorted();
  Eigen::Matrix3Xd sorted(3, n);
  for (int i = 0; i < n; ++i)
    sorted.col(i) = points.col(order[i]);
  return sorted;
}

/// Changes the scale until the mean overlap in mechanical equilibrium is small but not zero, just above jamming.
void approach_jamming(Compaction &compaction, int steps_a_round, const std::function<void(double)> &progress)
{
  const double target = 4e-4, touching = 0.05 * target;
  double slope = 1.4; // d (mean overlap / mean radius) / d scale, updated by the secant below
  double previous_scale = 0., previous_overlap = 0.;
  double loose = 0., dense = 1e300; // scales below and above jamming
  const int max_rounds = 12;
  for (int round = 0; round < max_rounds; ++round)
  {
    progress(double(round) / max_rounds);
    compaction.minimise(0.05, steps_a_round, [&](double share) { progress((round + share) / max_rounds); });
    const double overlap = compaction.mean_overlap(), scale = compaction.scale();
    if (overlap > 0.5 * target && overlap < 2. * target)
      return;
    (overlap < target ? loose : dense) = scale;
    if (previous_overlap > touching && overlap > touching && scale != previous_scale)
      slope = std::clamp((overlap - previous_overlap) / (scale - previous_scale), 0.7, 3.);
    previous_scale = scale;
    previous_overlap = overlap;
    // Without contacts there is no slope: take a step upwards, or the middle when a dense scale is known.
    double next = overlap > touching ? scale - (overlap - target) / slope : scale * (1. + 2e-3);
    if (loose > 0. && dense < 1e300 && !(next > loose && next < dense))
      next = (loose + dense) / 2.;
    compaction.set_scale(next);
  }
}

/// Stretches the positions so that the outermost particle at each side touches the box, except along periodic axes.
void touch_sides(Packing &packing)
{
  for (int c = 0; c < packing.dim; ++c)
  {
    if (packing.periodic[c] > 0.)
      continue;
    for (int round = 0; round < 8; ++round) // stretching may change which particle is the outermost
    {
      int first = 0, last = 0;
      for (int i = 1; i < packing.size(); ++i)
      {
        if (packing.positions(c, i) - packing.radii[i] < packing.positions(c, first) - packing.radii[first])
          first = i;
        if (packing.positions(c, i) + packing.radii[i] > packing.positions(c, last) + packing.radii[last])
          last = i;
      }
      const double from = packing.positions(c, first), to = packing.positions(c, last);
      const double new_from = packing.lower[c] + packing.radii[first], new_to = packing.upper[c] - packing.radii[last];
      for (int i = 0; i < packing.size(); ++i)
        packing.positions(c, i) = new_from + (packing.positions(c, i) - from) * ((new_to - new_from) / (to - from));
    }
  }
}

/// One jammed packing of particles that fill the fraction of the container when their scale is 1.
void compact(Packing &packing, const PackingSettings &settings, const Container &container, double fraction,
             const Progress &progress)
{
  const auto report = [&](double done, const char *what)
  {
    if (progress)
      progress(done, what);
  };
  std::mt19937_64 random(settings.seed);
  const double mean_radius = settings.mean_diameter / 2.;
  const std::vector<double> radii = draw_radii(settings, fraction * container.volume(), random);
  const int n = static_cast<int>(radii.size());
  report(0., "spreading the particles");
  Compaction compaction(container, draw_positions(container, n, mean_radius, random), radii, mean_radius);
  compaction.set_scale(0.75);
  compaction.minimise(0.1, 300);
  report(0.02, "spreading the particles");
  compaction.set_scale(0.88);
  compaction.minimise(0.1, 300);
  // Discs find denser arrangements in long thermal motion; spheres are as dense after a quick compression.
  const int annealing_steps = settings.dim == 2 ? 5500 : 600;
  compaction.anneal(1.015, 0.06, annealing_steps, random,
                    [&](double done) { report(0.05 + 0.6 * done, "shaking the particles together"); });
  approach_jamming(compaction, 2000, [&](double done) { report(0.65 + 0.3 * done, "approaching jamming"); });
  packing.positions = compaction.positions();
  for (int i = 0; i < packing.positions.cols(); ++i)
    packing.positions.col(i) = packing.wrapped(packing.positions.col(i));
  packing.radii = compaction.radii();
}

/// Removes overlaps and particles that hold nothing, grows rattlers until they are held, and bonds. Throws
/// std::invalid_argument when more than few particles are removed.
void clean_up(Packing &packing, const PackingSettings &settings, const Container &container)
{
  for (int round = 0; round < 3; ++round)
  {
    if (container.is_box())
      touch_sides(packing);
    remove_overlaps(packing, 0.9 * largest_overlap * mean(packing.radii));
  }
  hold_rattlers(packing, container, settings.mean_diameter / 2. * (1. + settings.radius_spread));
  const int n = packing.size();
  for (bool is_done = false; !is_done;) // the particle that touched a side may be among the removed ones
  {
    if (container.is_box())
      touch_sides(packing);
    bond_by_gap(packing, settings.gap_tolerance);
    is_done = remove_unconnected_particles(packing) == 0. || packing.size() == 0;
  }
  const double removed = double(n - packing.size()) / n;
  if (removed > 0.01 + 4. / n) // 1 %, and some particles at the corners of small packings
  {
    std::ostringstream error;
    error << "packing: " << 100. * removed << " % of the particles have fewer than two bonds at gap tolerance "
          << settings.gap_tolerance << "; use a larger one";
    throw std::invalid_argument(error.str());
  }
}
} // namespace

void generate_random(Packing &packing, const PackingSettings &settings, const Container &container, const Progress &progress)
{
  const double wanted = settings.mean_diameter / 2.;
  // The solid fraction at jamming decides the diameter. When the estimate was not good enough, the next attempt corrects it.
  double fraction = expected_fraction(settings, container), growth = 1.;
  int attempt = 0;
  const auto approach = [&]
  {
    for (int k = 0; k < 3; ++k, ++attempt)
    {
      const auto share = [&](double done, const std::string &text)
      {
        if (progress)
          progress(attempt == 0 ? 0.9 * done : 0.9 + 0.1 * (1. - std::pow(0.6, attempt - 1 + done)), text); // mostly one
      };
      compact(packing, settings, container, fraction, share);
      const double factor = growth * mean(packing.radii) / wanted;
      if (std::abs(factor - 1.) <= diameter_tolerance)
        break;
      fraction *= std::pow(factor, packing.dim);
    }
  };
  approach();
  const double compacted = mean(packing.radii);
  clean_up(packing, settings, container);
  // In wide distributions small particles rattle in the gaps between the large ones. They grow or are removed.
  if (const double factor = mean(packing.radii) / wanted; std::abs(factor - 1.) > clean_up_tolerance)
  {
    growth = mean(packing.radii) / compacted;
    fraction *= std::pow(factor, packing.dim);
    approach();
    clean_up(packing, settings, container);
  }
  packing.mean_diameter = 2. * mean(packing.radii);
}

Packing generate_packing(const PackingSettings &requested, const Progress &progress)
{
  const PackingSettings settings = with_surface_box(requested);
  check(settings);
  // The reach covers the largest particle, which may get a little larger before the packing is jammed.
  const Container container(settings, 0.6 * settings.mean_diameter * (1. + settings.radius_spread));
  Packing packing;
  packing.dim = settings.dim;
  packing.kind = settings.kind;
  packing.lower = container.lower();
  packing.upper = container.upper();
  packing.volume_filled = container.volume();
  packing.asked = {settings.mean_diameter, settings.radius_spread, settings.gap_tolerance};
  packing.shape = container.shape();
  for (int c = 0; c < packing.dim; ++c)
    packing.periodic[c] = settings.periodic[c] ? packing.upper[c] - packing.lower[c] : 0.;
  if (settings.kind == "random")
  {
    packing.seed = settings.seed;
    generate_random(packing, settings, container, progress);
  }
  else
  {
    packing.mean_diameter = settings.mean_diameter;
    packing.lattice = settings.lattice;
    place_lattice(packing, container);
    // Nearest neighbours have gap 0 (+- round-off), second neighbours at least 0.83 r.
    bond_by_gap(packing, std::clamp(settings.gap_tolerance, 1e-6, 0.5));
    if (!container.is_box())
      remove_unconnected_particles(packing);
  }
  if (packing.size() == 0)
    throw std::invalid_argument("packing: no particles are left, use smaller ones");
  packing.quality = measure_quality(packing);
  if (progress)
  {
    std::ostringstream text;
    text << packing.size() << " particles, " << packing.bonds.size() << " bonds, solid fraction " << packing.solid_fraction();
    progress(1., text.str());
  }
  return packing;
}
} // namespace kerf::dem
