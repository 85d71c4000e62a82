// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/loading/debris_contact.h"

#include "coupler/base/mpi_helpers.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <unordered_set>

namespace kerf
{
using Eigen::Vector3d;
using Eigen::Vector3i;

DebrisContact::DebrisContact(const dem::BondParameters &bond, const dem::Packing &packing, double dt, MPI_Comm comm)
  : packing(packing), dt(dt), comm(comm), law{bond.friction}, stiffness(bond.k_n), damping(bond.damping),
    patch((packing.dim == 2 ? 0.15 : 0.21) * packing.mean_diameter), loose(packing.size(), 0), near_surface(packing.size(), 0)
{
  MPI_Comm_rank(comm, &rank);
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
  std::vector<char> of_rock(packing.size(), 0);
  std::vector<int> stack;
  for (const TiedParticle &tie : ties)
    if (active[tie.index] && !of_rock[tie.index])
    {
      of_rock[tie.index] = 1;
      stack.push_back(tie.index);
    }
  while (!stack.empty())
  {
    const int i = stack.back();
    stack.pop_back();
    for (const int j : bonds.partners_of(i))
      if (active[j] && !of_rock[j] && !(is_damaged[i] && is_damaged[j] && broken.count(key(i, j))))
      {
        of_rock[j] = 1;
        stack.push_back(j);
      }
  }
  n_debris_particles = 0;
  for (int i = 0; i < packing.size(); ++i)
  {
    loose[i] = active[i] && !of_rock[i] && !ties.empty();
    n_debris_particles += loose[i];
  }
  steps_until_look = 0;
}

std::vector<DebrisContact::Visitor> DebrisContact::visitors(const dem::Particles &particles,
                                                            const std::vector<char> &which) const
{
  constexpr int record = 12; // index, position, velocity, spin, radius, mass
  std::vector<double> values;
  for (int i = 0; i < particles.n; ++i)
    if (which[particles.index[i]])
    {
      values.push_back(particles.index[i]);
      for (const dem::Vectors *field : {&particles.position, &particles.velocity, &particles.angular_velocity})
        values.insert(values.end(), field->col(i).data(), field->col(i).data() + 3);
      values.push_back(particles.radius[i]);
      values.push_back(particles.mass[i]);
    }
  values = gather_all(values, MPI_DOUBLE, comm);
  std::vector<Visitor> all;
  for (std::size_t k = 0; k < values.size(); k += record)
    all.push_back({static_cast<int>(values[k]), Vector3d::Map(&values[k + 1]), Vector3d::Map(&values[k + 4]),
                   Vector3d::Map(&values[k + 7]), values[k + 10], values[k + 11]});
  std::sort(all.begin(), all.end(), [](const Visitor &a, const Visitor &b) { return a.index < b.index; });
  return all;
}

Vector3i DebrisContact::bin_of(const Vector3d &position) const
{
  const Eigen::Array3d bin = ((position - origin).array() / bin_size).floor();
  return bin.cwiseMax(0.).cwiseMin((n_bins.array() - 1).cast<double>()).cast<int>();
}

void DebrisContact::find_points(const std::vector<Visitor> &all, const fem::FemSide &fem, double reach)
{
  Vector3d lower = Vector3d::Constant(1e300), upper = Vector3d::Constant(-1e300);
  for (const Visitor &visitor : all)
  {
    lower = lower.cwiseMin((visitor.position.array() - reach).matrix());
    upper = upper.cwiseMax((visitor.position.array() + reach).matrix());
  }
  if (packing.dim == 2)
    lower[2] = -1., upper[2] = 1.;
  fem.surface_points(lower, upper, {}, points);

  const int n = static_cast<int>(points.area.size());
  bin_start.assign(1, 0);
  n_bins.setZero();
  if (n == 0)
    return;
  constexpr int most = 64; // bins along an axis
  origin = points.position.rowwise().minCoeff();
  const Vector3d extent = points.position.rowwise().maxCoeff() - origin;
  bin_size = std::max(2. * reach, extent.maxCoeff() / most);
  n_bins = (extent / bin_size).array().cast<int>() + 1;
  const auto flat = [&](const Vector3i &bin) { return (bin[2] * n_bins[1] + bin[1]) * n_bins[0] + bin[0]; };
  bin_start.assign(n_bins.prod() + 1, 0);
  std::vector<int> bin(n);
  for (int q = 0; q < n; ++q)
    ++bin_start[(bin[q] = flat(bin_of(points.position.col(q)))) + 1];
  for (std::size_t b = 1; b < bin_start.size(); ++b)
    bin_start[b] += bin_start[b - 1];
  bin_points.resize(n);
  std::vector<int> next(bin_start.begin(), bin_start.end() - 1);
  for (int q = 0; q < n; ++q)
    bin_points[next[bin[q]]++] = q;
}

/// Calls visit(q) for all surface points within the reach, and for some others.
template <typename Visit>
void DebrisContact::for_each_point_near(const Vector3d &position, double reach, const Visit &visit) const
{
  if (n_bins.isZero())
    return;
  const Vector3d half = Vector3d::Constant(reach);
  if (((position + half - origin).array() < 0.).any() ||
      ((position - half - origin).array() > n_bins.array().cast<double>() * bin_size).any())
    return;
  const Vector3i first = bin_of(position - half), last = bin_of(position + half);
  for (int z = first[2]; z <= last[2]; ++z)
    for (int y = first[1]; y <= last[1]; ++y)
      for (int x = first[0]; x <= last[0]; ++x)
      {
        const int bin = (z * n_bins[1] + y) * n_bins[0] + x;
        for (int k = bin_start[bin]; k < bin_start[bin + 1]; ++k)
          visit(bin_points[k]);
      }
}

DebrisContact::Touch DebrisContact::nearest(const Visitor &visitor) const
{
  Touch touch;
  for_each_point_near(visitor.position, visitor.radius + patch,
                      [&](int q)
                      {
                        const Vector3d away = visitor.position - points.position.col(q), normal = points.normal.col(q);
                        const double height = away.dot(normal);
                        const Vector3d along = away - height * normal;
                        const double aside = along.norm();
                        const Vector3d arm = (aside > patch ? patch / aside : 1.) * along - away;
                        if (const double distance = arm.norm(); height > 0. && distance < touch.distance)
                          touch = {distance, q, arm};
                      });
  return touch;
}

/// Chooses the loose particles that can meet the surface before the next look.
void DebrisContact::find_near(const dem::Particles &particles, const fem::FemSide &fem)
{
  constexpr int longest_wait = 200; // steps
  const double margin = 0.5 * packing.mean_diameter;
  const std::vector<Visitor> all = visitors(particles, loose);
  find_points(all, fem, packing.radii.maxCoeff() + patch + margin);

  double speed = 0.;
  std::vector<int> local;
  for (const Visitor &visitor : all)
  {
    speed = std::max(speed, visitor.velocity.norm());
    bool meets = false;
    const double reach = visitor.radius + patch + margin;
    for_each_point_near(visitor.position, reach,
                        [&](int q)
                        { meets = meets || (visitor.position - points.position.col(q)).squaredNorm() < reach * reach; });
    if (meets)
      local.push_back(visitor.index);
  }
  near = gather_all(local, MPI_INT, comm);
  std::sort(near.begin(), near.end());
  near.erase(std::unique(near.begin(), near.end()), near.end());
  near_surface.assign(packing.size(), 0);
  for (const int index : near)
    near_surface[index] = 1;

  // A particle that comes off the rock beside the surface starts without force. Seen first in the air it is not embedded.
  std::vector<double> depths(all.size());
  for (std::size_t k = 0; k < all.size(); ++k)
    depths[k] = near_surface[all[k].index] && !memory.count(all[k].index) ? all[k].radius - nearest(all[k]).distance : 0.;
  MPI_Allreduce(MPI_IN_PLACE, depths.data(), static_cast<int>(depths.size()), MPI_DOUBLE, MPI_MAX, comm);
  for (std::size_t k = 0; k < all.size(); ++k)
  {
    memory.try_emplace(all[k].index, Memory{std::max(0., depths[k]), 0.});
    if (!near_surface[all[k].index])
      memory.at(all[k].index).overlap = 0.;
  }

  steps_until_look = longest_wait;
  if (speed > 0.)
    steps_until_look = std::clamp(static_cast<int>(0.5 * margin / (speed * dt)), 1, longest_wait);
}

/// How far a particle overlaps the surface [m], at @p distance from it; not positive: no contact. Once out of what it was
/// embedded in it stays out. An overlap cannot appear at once: then the particle came from within the rock, where it met no
/// surface.
double DebrisContact::follow(const Visitor &visitor, double distance)
{
  const double sudden = 0.02 * packing.mean_diameter; // twenty times what a fast fragment moves in a step
  Memory &m = memory.at(visitor.index);
  m.embedded = std::min(m.embedded, std::max(0., visitor.radius - distance));
  double overlap = visitor.radius - m.embedded - distance;
  if (overlap > m.overlap + sudden)
  {
    m.embedded += overlap - m.overlap;
    overlap = m.overlap;
  }
  m.overlap = std::max(0., overlap);
  return overlap;
}

void DebrisContact::apply(dem::Phase phase, dem::Particles &particles, fem::FemSide &fem, ParticleWork &work)
{
  elastic = 0.;
  if (n_debris_particles == 0)
    return;
  if (phase == dem::Phase::setup || steps_until_look-- <= 0)
    find_near(particles, fem);
  if (near.empty())
    return;

  const std::vector<Visitor> all = visitors(particles, near_surface);
  find_points(all, fem, packing.radii.maxCoeff() + patch);
  point_force.setZero(3, points.area.size());
  Eigen::Matrix<double, 6, Eigen::Dynamic> loads = Eigen::Matrix<double, 6, Eigen::Dynamic>::Zero(6, all.size());
  std::vector<Touch> touches;
  std::vector<std::pair<double, int>> closest; // distance and rank
  for (const Visitor &visitor : all)
  {
    touches.push_back(nearest(visitor));
    closest.emplace_back(touches.back().distance, rank);
  }
  static_assert(sizeof(std::pair<double, int>) == 16);
  MPI_Allreduce(MPI_IN_PLACE, closest.data(), static_cast<int>(closest.size()), MPI_DOUBLE_INT, MPI_MINLOC, comm);
  for (std::size_t k = 0; k < all.size(); ++k)
  {
    const Visitor &visitor = all[k];
    const auto &[distance, q, arm] = touches[k];
    const double gap = -follow(visitor, closest[k].first);
    if (closest[k].second != rank || gap >= 0. || q < 0 || distance == 0.)
      continue;
    const double k_n = points.weight[q] * stiffness;
    const Vector3d velocity = visitor.velocity + visitor.spin.cross(arm) - points.velocity.col(q);
    const Vector3d force = law.force(gap, -arm / distance, velocity, k_n, 2. * damping * std::sqrt(k_n * visitor.mass));
    elastic += 0.5 * k_n * gap * gap;
    point_force.col(q) -= force;
    loads.col(k).head<3>() += force;
    loads.col(k).tail<3>() += arm.cross(force);
  }
  fem.add_surface_forces(point_force, fem::SurfaceLoad::loose);
  MPI_Allreduce(MPI_IN_PLACE, loads.data(), static_cast<int>(loads.size()), MPI_DOUBLE, MPI_SUM, comm);

  std::unordered_map<int, int> visitor_of;
  for (std::size_t k = 0; k < all.size(); ++k)
    visitor_of[all[k].index] = static_cast<int>(k);
  for (int i = 0; i < particles.n; ++i)
    if (near_surface[particles.index[i]])
    {
      const auto load = loads.col(visitor_of.at(particles.index[i]));
      if (load.isZero(0.))
        continue;
      particles.force.col(i) += load.head<3>();
      particles.torque.col(i) += load.tail<3>();
      work.add(particles, i, load.head<3>(), load.tail<3>());
    }
}
} // namespace kerf
