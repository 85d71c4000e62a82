// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/loading/debris_contact.h"

#include "coupler/base/mpi_helpers.h"
#include "coupler/loading/surface_resolution.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <unordered_set>

namespace kerf
{
using Eigen::Vector3d;
using Eigen::Vector3i;

namespace
{
/// Candidates for contact are the fragments that are nearer to the surface than contact needs plus this margin [mean
/// diameters]. They are chosen anew before the fastest fragment has crossed half of it: a larger margin saves searches and
/// costs candidates.
constexpr double search_margin = 0.5;
/// Longest time between two searches [steps], for fragments that are at rest when they are looked at.
constexpr int longest_wait = 200;
/// An overlap that rises by more than this in a step did not arise by motion: a fast fragment moves by a twentieth of it
/// [mean diameters].
constexpr double largest_rise = 0.02;
/// Largest number of bins along an axis, so that a few points far apart do not need many empty bins.
constexpr int most_bins = 64;
} // namespace

DebrisContact::DebrisContact(const dem::BondParameters &bond, const dem::Packing &packing, double dt, MPI_Comm comm)
  : packing(packing), dt(dt), comm(comm), rank(rank_of(comm)), law{bond.friction}, stiffness(bond.k_n), damping(bond.damping),
    patch(surface_resolution::patch_radius(packing.dim) * packing.mean_diameter), debris(packing.size(), 0),
    near_surface(packing.size(), 0)
{
}

void DebrisContact::find_debris(const dem::DemSide &dem, const dem::StoredBonds &bonds, const std::vector<TiedParticle> &ties)
{
  const std::int64_t n_broken = dem.n_bonds_broken();
  const int n_active = dem.n_active(), n_ties = static_cast<int>(ties.size());
  if (n_broken == broken_seen && n_active == active_seen && n_ties == ties_seen)
    return;
  broken_seen = n_broken;
  active_seen = n_active;
  ties_seen = n_ties;

  std::vector<int> ends;
  for (const dem::BrokenBond &bond : dem.broken_bonds())
    ends.insert(ends.end(), {bond.first, bond.second});
  ends = gather_all(ends, MPI_INT, comm);
  const auto key = [this](std::int64_t i, std::int64_t j) { return std::min(i, j) * packing.size() + std::max(i, j); };
  std::unordered_set<std::int64_t> broken;
  std::vector<char> is_damaged(packing.size(), 0);
  for (std::size_t k = 0; k < ends.size(); k += 2)
  {
    broken.insert(key(ends[k], ends[k + 1]));
    is_damaged[ends[k]] = is_damaged[ends[k + 1]] = 1;
  }

  const std::vector<char> &active = dem.is_active();
  std::vector<char> attached(packing.size(), 0);
  std::vector<int> stack;
  for (const TiedParticle &tie : ties)
    if (active[tie.index] && !attached[tie.index])
    {
      attached[tie.index] = 1;
      stack.push_back(tie.index);
    }
  while (!stack.empty())
  {
    const int i = stack.back();
    stack.pop_back();
    for (const int j : bonds.partners_of(i))
      if (active[j] && !attached[j] && !(is_damaged[i] && is_damaged[j] && broken.count(key(i, j))))
      {
        attached[j] = 1;
        stack.push_back(j);
      }
  }
  n_debris_particles = 0;
  for (int i = 0; i < packing.size(); ++i)
  {
    debris[i] = active[i] && !attached[i] && !ties.empty();
    n_debris_particles += debris[i];
  }
  steps_until_search = 0;
}

std::vector<DebrisContact::Fragment> DebrisContact::gather(const dem::Particles &particles,
                                                           const std::vector<char> &selected) const
{
  constexpr int record = 12; // index, position, velocity, spin, radius, mass
  std::vector<double> values;
  for (int i = 0; i < particles.n; ++i)
    if (selected[particles.index[i]])
    {
      values.push_back(particles.index[i]);
      for (const dem::Vectors *field : {&particles.position, &particles.velocity, &particles.angular_velocity})
        values.insert(values.end(), field->col(i).data(), field->col(i).data() + 3);
      values.push_back(particles.radius[i]);
      values.push_back(particles.mass[i]);
    }
  values = gather_all(values, MPI_DOUBLE, comm);
  std::vector<Fragment> all;
  for (std::size_t k = 0; k < values.size(); k += record)
    all.push_back({static_cast<int>(values[k]), Vector3d::Map(&values[k + 1]), Vector3d::Map(&values[k + 4]),
                   Vector3d::Map(&values[k + 7]), values[k + 10], values[k + 11]});
  std::sort(all.begin(), all.end(), [](const Fragment &a, const Fragment &b) { return a.index < b.index; });
  return all;
}

void DebrisContact::find_points(const std::vector<Fragment> &all, const fem::SurfaceContact &surface, double reach)
{
  Vector3d lower = Vector3d::Constant(1e300), upper = Vector3d::Constant(-1e300);
  for (const Fragment &fragment : all)
  {
    lower = lower.cwiseMin((fragment.position.array() - reach).matrix());
    upper = upper.cwiseMax((fragment.position.array() + reach).matrix());
  }
  if (packing.dim == 2)
    lower[2] = -1., upper[2] = 1.;
  surface.surface_points(lower, upper, {}, points);

  const int n = static_cast<int>(points.area.size());
  sorted = dem::CellSort();
  if (n == 0)
    return;
  bins.lower = points.position.rowwise().minCoeff();
  const Vector3d extent = points.position.rowwise().maxCoeff() - bins.lower;
  bins.cell_size = std::max(2. * reach, extent.maxCoeff() / most_bins);
  for (int c = 0; c < 3; ++c)
    bins.n_cells[c] = static_cast<int>(extent[c] / bins.cell_size) + 1;
  std::vector<int> bin_of(n);
  for (int q = 0; q < n; ++q)
    bin_of[q] = bins.index(bins.cell_at(Vector3d(points.position.col(q))));
  sorted = dem::CellSort(bin_of, bins.size());
}

/// Calls visit(q) for all surface points within the reach of a position, and for some others.
template <typename Visit>
void DebrisContact::for_each_point_near(const Vector3d &position, double reach, const Visit &visit) const
{
  if (sorted.order.empty())
    return;
  const Vector3d half = Vector3d::Constant(reach);
  const Eigen::Array3d n_bins(bins.n_cells[0], bins.n_cells[1], bins.n_cells[2]);
  if (((position + half - bins.lower).array() < 0.).any() ||
      ((position - half - bins.lower).array() > n_bins * bins.cell_size).any())
    return;
  const std::array<int, 3> first = bins.cell_at(Vector3d(position - half)), last = bins.cell_at(Vector3d(position + half));
  for (int z = first[2]; z <= last[2]; ++z)
    for (int y = first[1]; y <= last[1]; ++y)
      for (int x = first[0]; x <= last[0]; ++x)
      {
        const int bin = bins.index(x, y, z);
        for (int k = sorted.first[bin]; k < sorted.first[bin + 1]; ++k)
          visit(sorted.order[k]);
      }
}

DebrisContact::Touch DebrisContact::nearest(const Fragment &fragment) const
{
  Touch touch;
  for_each_point_near(fragment.position, fragment.radius + patch,
                      [&](int q)
                      {
                        const Vector3d away = fragment.position - points.position.col(q), normal = points.normal.col(q);
                        const double height = away.dot(normal);
                        const Vector3d along = away - height * normal;
                        const double aside = along.norm();
                        const Vector3d arm = (aside > patch ? patch / aside : 1.) * along - away;
                        if (const double distance = arm.norm(); height > 0. && distance < touch.distance)
                          touch = {distance, q, arm};
                      });
  return touch;
}

/// Chooses the fragments that can meet the surface before the next search.
void DebrisContact::find_near(const dem::Particles &particles, const fem::SurfaceContact &surface)
{
  const double margin = search_margin * packing.mean_diameter;
  const std::vector<Fragment> all = gather(particles, debris);
  find_points(all, surface, packing.radii.maxCoeff() + patch + margin);

  double speed = 0.;
  std::vector<int> local;
  for (const Fragment &fragment : all)
  {
    speed = std::max(speed, fragment.velocity.norm());
    bool meets = false;
    const double reach = fragment.radius + patch + margin;
    for_each_point_near(fragment.position, reach,
                        [&](int q)
                        { meets = meets || (fragment.position - points.position.col(q)).squaredNorm() < reach * reach; });
    if (meets)
      local.push_back(fragment.index);
  }
  near = gather_all(local, MPI_INT, comm);
  std::sort(near.begin(), near.end());
  near.erase(std::unique(near.begin(), near.end()), near.end());
  near_surface.assign(packing.size(), 0);
  for (const int index : near)
    near_surface[index] = 1;

  // A fragment that comes off the rock next to the surface starts without force. One that is seen first in the air is not
  // embedded.
  std::vector<double> depths(all.size());
  for (std::size_t k = 0; k < all.size(); ++k)
    depths[k] = near_surface[all[k].index] && !states.count(all[k].index) ? all[k].radius - nearest(all[k]).distance : 0.;
  MPI_Allreduce(MPI_IN_PLACE, depths.data(), static_cast<int>(depths.size()), MPI_DOUBLE, MPI_MAX, comm);
  for (std::size_t k = 0; k < all.size(); ++k)
  {
    states.try_emplace(all[k].index, ContactState{std::max(0., depths[k]), 0.});
    if (!near_surface[all[k].index])
      states.at(all[k].index).overlap = 0.;
  }

  steps_until_search = longest_wait;
  if (speed > 0.)
    steps_until_search = std::clamp(static_cast<int>(0.5 * margin / (speed * dt)), 1, longest_wait);
}

/// Overlap of a fragment with the surface at @p distance from its centre [m]; not positive: no contact. The depth by which it
/// was embedded does not count and shrinks as the fragment moves out. An overlap that appears within one step did not arise by
/// motion: the fragment came from within the rock, where there is no surface, and is embedded by that much more. Theory (9.12).
double DebrisContact::update_overlap(const Fragment &fragment, double distance)
{
  ContactState &m = states.at(fragment.index);
  m.embedded = std::min(m.embedded, std::max(0., fragment.radius - distance));
  double overlap = fragment.radius - m.embedded - distance;
  if (overlap > m.overlap + largest_rise * packing.mean_diameter)
  {
    m.embedded += overlap - m.overlap;
    overlap = m.overlap;
  }
  m.overlap = std::max(0., overlap);
  return overlap;
}

void DebrisContact::apply(dem::Phase phase, dem::Particles &particles, fem::SurfaceContact &surface, ParticleWork &work)
{
  elastic = 0.;
  if (n_debris_particles == 0)
    return;
  if (phase == dem::Phase::setup || steps_until_search-- <= 0)
    find_near(particles, surface);
  if (near.empty())
    return;

  const std::vector<Fragment> all = gather(particles, near_surface);
  find_points(all, surface, packing.radii.maxCoeff() + patch);
  point_force.setZero(3, points.area.size());
  Eigen::Matrix<double, 6, Eigen::Dynamic> loads = Eigen::Matrix<double, 6, Eigen::Dynamic>::Zero(6, all.size());
  std::vector<Touch> touches;
  std::vector<std::pair<double, int>> closest; // distance and rank
  for (const Fragment &fragment : all)
  {
    touches.push_back(nearest(fragment));
    closest.emplace_back(touches.back().distance, rank);
  }
  static_assert(sizeof(std::pair<double, int>) == 16);
  MPI_Allreduce(MPI_IN_PLACE, closest.data(), static_cast<int>(closest.size()), MPI_DOUBLE_INT, MPI_MINLOC, comm);
  for (std::size_t k = 0; k < all.size(); ++k)
  {
    const Fragment &fragment = all[k];
    const auto &[distance, q, arm] = touches[k];
    const double gap = -update_overlap(fragment, closest[k].first);
    if (closest[k].second != rank || gap >= 0. || q < 0 || distance == 0.)
      continue;
    const double k_n = points.weight[q] * stiffness;
    const Vector3d velocity = fragment.velocity + fragment.spin.cross(arm) - points.velocity.col(q);
    const Vector3d force = law.force(gap, -arm / distance, velocity, k_n, 2. * damping * std::sqrt(k_n * fragment.mass));
    elastic += 0.5 * k_n * gap * gap;
    point_force.col(q) -= force;
    loads.col(k).head<3>() += force;
    loads.col(k).tail<3>() += arm.cross(force);
  }
  surface.add_surface_forces(point_force, fem::SurfaceLoad::debris);
  MPI_Allreduce(MPI_IN_PLACE, loads.data(), static_cast<int>(loads.size()), MPI_DOUBLE, MPI_SUM, comm);

  std::unordered_map<int, int> fragment_of;
  for (std::size_t k = 0; k < all.size(); ++k)
    fragment_of[all[k].index] = static_cast<int>(k);
  for (int i = 0; i < particles.n; ++i)
    if (near_surface[particles.index[i]])
    {
      const auto load = loads.col(fragment_of.at(particles.index[i]));
      if (load.isZero(0.))
        continue;
      particles.force.col(i) += load.head<3>();
      particles.torque.col(i) += load.tail<3>();
      work.add(particles, i, load.head<3>(), load.tail<3>());
    }
}
} // namespace kerf
