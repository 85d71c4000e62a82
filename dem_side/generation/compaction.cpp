// SPDX-License-Identifier: GPL-2.0-or-later
#include "dem_side/generation/compaction.h"

#include "dem_side/engine/liggghts_instance.h"
#include "dem_side/geometry/cell_list.h"

#include <atom.h>
#include <atom_vec.h>
#include <fix_external.h>
#include <modify.h>
#include <stdexcept>
#include <update.h>

namespace kerf::dem
{
namespace
{
constexpr double wall_stiffness = 2.; ///< flattens the sides to a fraction of the overlap between particles
constexpr double anneal_step = 0.3;   ///< central difference is stable to 2/omega = 0.7 at eight contacts
constexpr double largest_fire_step = 0.45;
constexpr double negligible_force = 1e-6; ///< below this, the particles are hardly in contact
constexpr int fire_start = 5;             ///< downhill steps before the time step grows
} // namespace

/// The LIGGGHTS instance computes the contacts. Walls and the damping of the minimisation are added in the hook that LIGGGHTS
/// calls after its forces.
struct Compaction::Engine
{
  const Container &container;
  double unit;                  ///< mean diameter [m]
  Eigen::Vector3d lower, upper; ///< of the container [mean diameters]
  std::unique_ptr<LAMMPS> lmp;
  LAMMPS_NS::FixExternal *hook = nullptr; // owned by LIGGGHTS
  std::vector<double> unscaled_radii;     // by tag - 1, in mean diameters
  double scale = 1.;

  // State of the minimisation.
  bool minimising = false;
  double dt = 0.2, alpha = 0.1;
  int downhill = 0;
  double force_square = 0.;

  Engine(const Container &container, double unit)
    : container(container), unit(unit), lower(container.lower() / unit), upper(container.upper() / unit)
  {
  }
  void make_instance(const Eigen::Matrix3Xd &positions);
  void run(int steps) { command(*lmp, "run ", steps, " post no"); }
  void set_time_step(double value);
  void apply_scale();
  void set_velocities(const std::function<double()> &value);
  bool is_far_from_sides(const double *x, double radius) const;
  void add_wall_forces(int n, double **x, double **outer) const;
  void damp(int n, double **outer);
  double mean_overlap() const;
  static void after_forces(void *engine, LAMMPS_NS::bigint step, int n, int *tags, double **x, double **outer);
};

void Compaction::Engine::make_instance(const Eigen::Matrix3Xd &positions)
{
  lmp = make_liggghts(MPI_COMM_SELF);
  const bool flat = container.dim() == 2;
  Eigen::Vector3d low = lower - Eigen::Vector3d::Ones(), high = upper + Eigen::Vector3d::Ones();
  std::array<char, 3> boundary = {{'f', 'f', flat ? 'p' : 'f'}};
  for (int c = 0; c < container.dim(); ++c)
    if (container.is_periodic(c))
    {
      boundary[c] = 'p';
      low[c] = lower[c];
      high[c] = upper[c];
    }
  command(*lmp, "units si");
  command(*lmp, "dimension ", container.dim());
  command(*lmp, "atom_style granular");
  command(*lmp, "atom_modify map array sort 0 0");
  command(*lmp, "boundary ", boundary[0], ' ', boundary[1], ' ', boundary[2]);
  command(*lmp, "newton off");
  command(*lmp, "communicate single vel yes");
  command(*lmp, "region domain block ", low.x(), ' ', high.x(), ' ', low.y(), ' ', high.y(), ' ', low.z(), ' ', high.z(),
          " units box");
  command(*lmp, "create_box 1 domain");
  command(*lmp, "neighbor 0.45 bin"); // with thermal motion thinner lists would last a few steps only
  command(*lmp, "neigh_modify delay 0 every 1 check yes");
  command(*lmp, "pair_style gran model hooke/stiffness tangential off");
  command(*lmp, "pair_coeff * *");
  for (const char *name : {"kn", "kt"})
    command(*lmp, "fix ", name, " all property/global ", name, " peratomtypepair 1 1.");
  for (const char *name : {"gamman", "gammat"})
    command(*lmp, "fix ", name, " all property/global ", name, " peratomtypepair 1 0.");
  command(*lmp, "fix motion all nve");
  command(*lmp, "fix outer all external pf/callback 1 1");
  command(*lmp, "thermo 0");
  hook = dynamic_cast<LAMMPS_NS::FixExternal *>(lmp->modify->fix[lmp->modify->find_fix("outer")]);
  hook->set_callback(&Engine::after_forces, this);

  LAMMPS_NS::Atom &atom = *lmp->atom;
  for (int i = 0; i < positions.cols(); ++i)
  {
    Eigen::Vector3d x = positions.col(i) / unit;
    atom.avec->create_atom(1, x.data());
    atom.tag[i] = i + 1;
    atom.density[i] = 1.;
    for (int f = 0; f < lmp->modify->nfix; ++f)
      if (lmp->modify->fix[f]->create_attribute)
        lmp->modify->fix[f]->set_arrays(i);
  }
  atom.natoms = positions.cols();
  atom.map_init();
  atom.map_set();
}

void Compaction::Engine::set_time_step(double value)
{
  lmp->update->dt = value;
  for (int f = 0; f < lmp->modify->nfix; ++f)
    lmp->modify->fix[f]->reset_dt();
}

/// Takes effect with the next run, which rebuilds the lists.
void Compaction::Engine::apply_scale()
{
  LAMMPS_NS::Atom &atom = *lmp->atom;
  for (int i = 0; i < atom.nlocal; ++i)
  {
    atom.radius[i] = scale * unscaled_radii[atom.tag[i] - 1];
    atom.rmass[i] = 1.; // equal masses, so that one time step is stable for all
  }
}

void Compaction::Engine::set_velocities(const std::function<double()> &value)
{
  LAMMPS_NS::Atom &atom = *lmp->atom;
  for (int i = 0; i < atom.nlocal; ++i)
    for (int c = 0; c < container.dim(); ++c)
      atom.v[i][c] = value();
}

/// A fast test that holds for most particles of a box.
bool Compaction::Engine::is_far_from_sides(const double *x, double radius) const
{
  bool is_far = container.is_box();
  for (int c = 0; c < container.dim(); ++c)
    is_far = is_far && (container.is_periodic(c) || (x[c] - lower[c] > radius && upper[c] - x[c] > radius));
  return is_far;
}

void Compaction::Engine::add_wall_forces(int n, double **x, double **outer) const
{
  const double *radius = lmp->atom->radius;
  for (int i = 0; i < n; ++i)
  {
    for (int c = 0; c < 3; ++c)
      outer[i][c] = 0.;
    if (is_far_from_sides(x[i], radius[i]))
      continue;
    const Eigen::Vector3d centre = unit * Eigen::Map<const Eigen::Vector3d>(x[i]);
    for (const Container::Wall &wall : container.walls(centre, unit * radius[i]))
      for (int c = 0; c < container.dim(); ++c)
        outer[i][c] += wall_stiffness * (radius[i] - wall.distance / unit) * wall.inward[c];
  }
}

void Compaction::Engine::damp(int n, double **outer)
{
  LAMMPS_NS::Atom &atom = *lmp->atom;
  const int dim = container.dim();
  double power = 0., speed_square = 0.;
  force_square = 0.;
  for (int i = 0; i < n; ++i)
    for (int c = 0; c < dim; ++c)
    {
      const double f = atom.f[i][c] + outer[i][c], v = atom.v[i][c];
      power += f * v;
      speed_square += v * v;
      force_square += f * f;
    }
  if (power > 0.)
  {
    const double toward_force = alpha * std::sqrt(speed_square / force_square);
    for (int i = 0; i < n; ++i)
      for (int c = 0; c < dim; ++c)
        atom.v[i][c] = (1. - alpha) * atom.v[i][c] + toward_force * (atom.f[i][c] + outer[i][c]);
    if (++downhill > fire_start)
    {
      dt = std::min(1.1 * dt, largest_fire_step);
      alpha *= 0.99;
    }
  }
  else
  {
    for (int i = 0; i < n; ++i)
      for (int c = 0; c < dim; ++c)
        atom.v[i][c] = 0.;
    dt = std::max(0.5 * dt, 0.05);
    alpha = 0.1;
    downhill = 0;
  }
  set_time_step(dt);
}

void Compaction::Engine::after_forces(void *pointer, LAMMPS_NS::bigint, int n, int *, double **x, double **outer)
{
  auto &engine = *static_cast<Engine *>(pointer);
  engine.add_wall_forces(n, x, outer);
  if (engine.minimising)
    engine.damp(n, outer);
}

double Compaction::Engine::mean_overlap() const
{
  const LAMMPS_NS::Atom &atom = *lmp->atom;
  const Eigen::Matrix3Xd positions = Eigen::Map<const Eigen::Matrix3Xd>(atom.x[0], 3, atom.nlocal);
  Eigen::Vector3d periodic = Eigen::Vector3d::Zero();
  for (int c = 0; c < container.dim(); ++c)
    periodic[c] = container.is_periodic(c) ? upper[c] - lower[c] : 0.;
  double largest = 0., sum = 0.;
  long contacts = 0;
  for (int i = 0; i < atom.nlocal; ++i)
    largest = std::max(largest, atom.radius[i]);
  CellList(positions, 2. * largest, periodic)
    .for_each_pair(
      [&](int i, int j)
      {
        const double overlap =
          atom.radius[i] + atom.radius[j] - shortest_image(positions.col(i) - positions.col(j), periodic).norm();
        if (overlap > 0.)
        {
          sum += overlap;
          ++contacts;
        }
      });
  return contacts ? 2. * sum / double(contacts) : 0.; // diameters to radii
}

Compaction::Compaction(const Container &container, const Eigen::Matrix3Xd &positions, const std::vector<double> &radii,
                       double mean_radius)
  : engine(std::make_unique<Engine>(container, 2. * mean_radius))
{
  if (positions.cols() != static_cast<Eigen::Index>(radii.size()) || radii.empty())
    throw std::logic_error("compaction: there must be one radius for each position");
  for (const double radius : radii)
    engine->unscaled_radii.push_back(radius / engine->unit);
  engine->make_instance(positions);
  engine->apply_scale();
}

Compaction::~Compaction() = default;

void Compaction::set_scale(double scale)
{
  engine->scale = scale;
  engine->apply_scale();
}

double Compaction::scale() const
{
  return engine->scale;
}

void Compaction::anneal(double final_scale, double speed, int steps, std::mt19937_64 &random,
                        const std::function<void(double)> &progress)
{
  Engine &e = *engine;
  const int chunk = 80; // between two chunks the lists are rebuilt for the grown particles
  const double initial_scale = e.scale;
  LAMMPS_NS::Atom &atom = *e.lmp->atom;
  const int dim = e.container.dim();
  e.minimising = false;
  e.set_time_step(anneal_step);
  e.set_velocities([&random] { return uniform(random) - 0.5; });
  for (int step = 0; step < steps; step += chunk)
  {
    const double done = double(step) / steps;
    set_scale(initial_scale + (final_scale - initial_scale) * done);
    double square = 0.;
    for (int i = 0; i < atom.nlocal; ++i)
      for (int c = 0; c < dim; ++c)
        square += atom.v[i][c] * atom.v[i][c];
    const double target = 0.5 * speed * (1. - done); // in diameters
    const double factor = square > 0. ? target / std::sqrt(square / (double(dim) * atom.nlocal)) : 0.;
    for (int i = 0; i < atom.nlocal; ++i)
      for (int c = 0; c < dim; ++c)
        atom.v[i][c] *= factor;
    if (progress)
      progress(done);
    e.run(chunk);
  }
}

int Compaction::minimise(double tolerance, int max_steps, const std::function<void(double)> &progress)
{
  Engine &e = *engine;
  const int chunk = 50;
  e.minimising = true;
  e.dt = 0.2;
  e.alpha = 0.1;
  e.downhill = 0;
  e.set_time_step(e.dt);
  e.set_velocities([] { return 0.; });
  int steps = 0;
  while (steps < max_steps)
  {
    e.run(chunk);
    steps += chunk;
    if (progress)
      progress(double(steps) / max_steps);
    const double mean_force = 0.5 * e.mean_overlap(); // stiffness 1, lengths in diameters
    if (mean_force < negligible_force ||
        e.force_square <= tolerance * tolerance * mean_force * mean_force * e.lmp->atom->nlocal)
      break;
  }
  e.minimising = false;
  if (e.lmp->atom->nlocal != static_cast<int>(e.unscaled_radii.size()))
    throw std::runtime_error("packing: particles were pushed out of the box while they were compacted");
  return steps;
}

double Compaction::mean_overlap() const
{
  return engine->mean_overlap();
}

Eigen::Matrix3Xd Compaction::positions() const
{
  const LAMMPS_NS::Atom &atom = *engine->lmp->atom;
  Eigen::Matrix3Xd result(3, atom.nlocal);
  for (int i = 0; i < atom.nlocal; ++i)
    result.col(atom.tag[i] - 1) = engine->unit * Eigen::Map<const Eigen::Vector3d>(atom.x[i]);
  return result;
}

Eigen::VectorXd Compaction::radii() const
{
  Eigen::VectorXd result(engine->unscaled_radii.size());
  for (int i = 0; i < result.size(); ++i)
    result[i] = engine->scale * engine->unscaled_radii[i] * engine->unit;
  return result;
}
} // namespace kerf::dem
