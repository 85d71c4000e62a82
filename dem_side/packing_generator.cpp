// SPDX-License-Identifier: GPL-2.0-or-later
#include "dem_side/packing_generator.h"

#include "dem_side/cell_list.h"
#include "dem_side/soft_packing.h"

#include <numeric>
#include <sstream>
#include <stdexcept>

namespace kerf::dem
{
namespace
{
constexpr double nominal_fraction = 0.85; ///< at which the mean diameter is met exactly
constexpr double largest_overlap = 1e-3;  ///< of the finished packing [mean radii]

double mean(const Eigen::VectorXd &values)
{
  double sum = 0.; // in index order: Eigen's order depends on the machine
  for (Eigen::Index i = 0; i < values.size(); ++i)
    sum += values[i];
  return sum / double(values.size());
}

double distance(const Eigen::Matrix3Xd &positions, int i, int j)
{
  double square = 0.;
  for (int c = 0; c < 3; ++c)
  {
    const double d = positions(c, j) - positions(c, i);
    square += d * d;
  }
  return std::sqrt(square);
}

/// Radii uniform in mean (1 -+ spread) until they fill the nominal fraction of the box.
std::vector<double> draw_radii(Packing packing, const PackingSettings &settings, std::mt19937_64 &random)
{
  const double mean_radius = settings.mean_diameter / 2.;
  double space = nominal_fraction;
  for (int c = 0; c < packing.dim; ++c)
    space *= packing.upper[c] - packing.lower[c];
  std::vector<double> radii;
  packing.radii.resize(1);
  while (space > 0.)
  {
    radii.push_back(mean_radius * (1. + settings.radius_spread * (2. * uniform(random) - 1.)));
    packing.radii[0] = radii.back();
    space -= packing.volume(0);
  }
  return radii;
}

/// Uniformly random points; those close in space get close indices, which the loops over bonds like.
Eigen::Matrix3Xd draw_positions(const Packing &packing, int n, double mean_radius, std::mt19937_64 &random)
{
  Eigen::Matrix3Xd points = Eigen::Matrix3Xd::Zero(3, n);
  for (int i = 0; i < n; ++i)
    for (int c = 0; c < packing.dim; ++c)
    {
      const double lower = packing.lower[c] + mean_radius, upper = packing.upper[c] - mean_radius;
      points(c, i) = lower + (upper - lower) * uniform(random);
    }
  const std::vector<int> order = CellList(points, 4. * mean_radius).sorted();
  Eigen::Matrix3Xd sorted(3, n);
  for (int i = 0; i < n; ++i)
    sorted.col(i) = points.col(order[i]);
  return sorted;
}

/// Changes the scale until the mean overlap in mechanical equilibrium is small but not zero: just above jamming.
void approach_jamming(SoftPacking &soft, const std::function<void(double)> &progress)
{
  const double target = 4e-4;
  double slope = 1.5; // d (mean overlap / mean radius) / d scale; the secant below learns it
  double previous_scale = 0., previous_overlap = 0.;
  const int max_rounds = 12;
  for (int round = 0; round < max_rounds; ++round)
  {
    progress(double(round) / max_rounds);
    soft.minimise(0.02, 4000);
    const double overlap = soft.mean_overlap(), scale = soft.scale();
    if (overlap > 0.5 * target && overlap < 2. * target)
      return;
    if (previous_overlap > 0. && overlap > 0. && scale != previous_scale)
      slope = std::clamp((overlap - previous_overlap) / (scale - previous_scale), 0.3, 4.);
    previous_scale = scale;
    previous_overlap = overlap;
    soft.set_scale(std::min(scale - (overlap - target) / slope, SoftPacking::max_scale));
  }
}

/// Stretches the positions so that on each side the outermost particle touches the box.
void touch_sides(Packing &packing)
{
  for (int c = 0; c < packing.dim; ++c)
    for (int round = 0; round < 4; ++round) // stretching may change which particle is the outermost
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

/// Shrinks all radii alike until no overlap is larger than allowed.
void remove_overlaps(Packing &packing)
{
  for (int round = 0; round < 4; ++round)
  {
    touch_sides(packing);
    const double allowed = 0.9 * largest_overlap * mean(packing.radii);
    double factor = 1.;
    CellList(packing.positions, 2. * packing.radii.maxCoeff())
      .for_each_pair(
        [&](int i, int j)
        {
          const double sum = packing.radii[i] + packing.radii[j];
          factor = std::min(factor, (distance(packing.positions, i, j) + allowed) / sum);
        });
    packing.radii *= factor;
    if (factor == 1.)
      break;
  }
  touch_sides(packing);
}

/// A particle without hold in its cage (rattler) is moved to the middle of the cage and grown until it touches.
void hold_rattlers(Packing &packing, double largest_radius)
{
  bond_by_gap(packing, 0.02);
  std::vector<int> holds(packing.size(), 0);
  for (const auto &[i, j] : packing.bonds)
  {
    ++holds[i];
    ++holds[j];
  }
  std::vector<std::vector<int>> cage(packing.size());
  const double sight = 4. * largest_radius;
  CellList(packing.positions, sight)
    .for_each_pair(
      [&](int i, int j)
      {
        if (distance(packing.positions, i, j) >= sight)
          return;
        if (holds[i] < 2)
          cage[i].push_back(j);
        if (holds[j] < 2)
          cage[j].push_back(i);
      });

  for (int i = 0; i < packing.size(); ++i)
  {
    if (holds[i] >= 2)
      continue;
    Eigen::Vector3d x = packing.positions.col(i);
    // Free radius at x and the direction away from what limits it.
    const auto free_radius = [&](Eigen::Vector3d &away)
    {
      double free = 1e300;
      for (const int j : cage[i])
      {
        double square = 0.;
        for (int c = 0; c < 3; ++c)
          square += (x[c] - packing.positions(c, j)) * (x[c] - packing.positions(c, j));
        const double d = std::sqrt(square);
        if (d - packing.radii[j] < free)
        {
          free = d - packing.radii[j];
          away = (x - packing.positions.col(j)) / d;
        }
      }
      for (int c = 0; c < packing.dim; ++c)
        for (const double side : {1., -1.})
        {
          const double d = side > 0. ? x[c] - packing.lower[c] : packing.upper[c] - x[c];
          if (d < free)
          {
            free = d;
            away = side * Eigen::Vector3d::Unit(c);
          }
        }
      return free;
    };
    Eigen::Vector3d away = Eigen::Vector3d::Zero(), best = x;
    double best_free = 0.;
    for (double step = 0.1 * largest_radius; step > 1e-4 * largest_radius; step *= 0.98)
    {
      const double free = free_radius(away);
      if (free > best_free)
      {
        best_free = free;
        best = x;
      }
      x += step * away;
    }
    packing.positions.col(i) = best;
    packing.radii[i] = std::max(packing.radii[i], std::min(best_free, largest_radius));
  }
}
} // namespace

double remove_loose_particles(Packing &packing)
{
  const int n = packing.size();
  std::vector<std::vector<int>> partners(n);
  for (const auto &[i, j] : packing.bonds)
  {
    partners[i].push_back(j);
    partners[j].push_back(i);
  }
  std::vector<int> held(n), loose;
  std::vector<char> removed(n, 0);
  for (int i = 0; i < n; ++i)
    if ((held[i] = static_cast<int>(partners[i].size())) < 2)
      loose.push_back(i);
  while (!loose.empty())
  {
    const int i = loose.back();
    loose.pop_back();
    if (removed[i])
      continue;
    removed[i] = 1;
    for (const int j : partners[i])
      if (!removed[j] && --held[j] < 2)
        loose.push_back(j);
  }

  std::vector<int> body(n, -1), members, stack;
  for (int seed = 0; seed < n; ++seed)
  {
    if (removed[seed] || body[seed] >= 0)
      continue;
    body[seed] = static_cast<int>(members.size());
    members.push_back(0);
    for (stack = {seed}; !stack.empty();)
    {
      const int i = stack.back();
      stack.pop_back();
      ++members[body[seed]];
      for (const int j : partners[i])
        if (!removed[j] && body[j] < 0)
        {
          body[j] = body[seed];
          stack.push_back(j);
        }
    }
  }
  const int main_body = static_cast<int>(std::max_element(members.begin(), members.end()) - members.begin());

  std::vector<int> new_index(n, -1);
  int kept = 0;
  for (int i = 0; i < n; ++i)
    if (!removed[i] && body[i] == main_body)
    {
      new_index[i] = kept;
      packing.positions.col(kept) = Eigen::Vector3d(packing.positions.col(i));
      packing.radii[kept] = packing.radii[i];
      ++kept;
    }
  packing.positions.conservativeResize(3, kept);
  packing.radii.conservativeResize(kept);
  std::vector<std::array<int, 2>> bonds;
  for (const auto &[i, j] : packing.bonds)
    if (new_index[i] >= 0 && new_index[j] >= 0)
      bonds.push_back({new_index[i], new_index[j]});
  packing.bonds = std::move(bonds);
  return n ? double(n - kept) / n : 0.;
}

void generate_random(Packing &packing, const PackingSettings &settings, const Progress &progress)
{
  const auto report = [&](double done, const char *what)
  {
    if (progress)
      progress(done, what);
  };
  std::mt19937_64 random(settings.seed);
  const double mean_radius = settings.mean_diameter / 2.;
  const double largest_radius = mean_radius * (1. + settings.radius_spread);

  const std::vector<double> radii = draw_radii(packing, settings, random);
  const int n = static_cast<int>(radii.size());
  SoftPacking soft(packing.dim, packing.lower, packing.upper, draw_positions(packing, n, mean_radius, random), radii,
                   mean_radius);
  soft.set_scale(0.75);
  soft.minimise(0.02, 500);
  soft.set_scale(0.88);
  soft.minimise(0.02, 500);
  soft.anneal(1.01, 0.06, 8000, random, [&](double done) { report(0.05 + 0.6 * done, "shaking the particles together"); });
  approach_jamming(soft, [&](double done) { report(0.65 + 0.3 * done, "approaching jamming"); });

  packing.positions = soft.positions();
  packing.radii = soft.radii();
  remove_overlaps(packing);
  hold_rattlers(packing, largest_radius);
  touch_sides(packing);
  bond_by_gap(packing, settings.gap_tolerance);
  const double removed = remove_loose_particles(packing);
  if (removed > 0.01 + 4. / n) // 1 % and the corners, which matter in small packings
  {
    std::ostringstream error;
    error << "packing: " << 100. * removed << " % of the particles have fewer than two bonds at gap tolerance "
          << settings.gap_tolerance << "; use a larger one";
    throw std::runtime_error(error.str());
  }
  std::ostringstream text;
  text << 100. * removed << " % loose particles removed";
  report(0.99, text.str().c_str());
  packing.mean_diameter = 2. * mean(packing.radii);
}
} // namespace kerf::dem
