// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/application/output/run_quality.h"

#include <algorithm>
#include <iomanip>
#include <limits>
#include <sstream>

namespace kerf
{
namespace
{
/// Broken bonds that broke early, or that lie at the border [share of all].
constexpr double most_early = 0.1, most_at_border = 0.05;
/// Damping, kinetic energy at the end [share of the tool's work].
constexpr double most_damping = 0.5, most_kinetic = 0.1;
/// Changes of the energy by conversions [share of the turnover].
constexpr double most_changed = 0.005;

constexpr std::int64_t never = std::numeric_limits<std::int64_t>::max(),
                       long_ago = std::numeric_limits<std::int64_t>::min() / 2;

std::string percent(double share)
{
  std::ostringstream text;
  text << std::setprecision(3) << 100. * share << " %";
  return text.str();
}

std::string share_of_bonds(const DamageCount &count, std::int64_t all)
{
  std::ostringstream text;
  text << std::setprecision(3) << percent(static_cast<double>(count.bonds) / static_cast<double>(all))
       << " of the broken bonds (" << count.bonds << " of " << all << ", around (" << count.place[0] << ", " << count.place[1]
       << ", " << count.place[2] << ") m)";
  return text.str();
}

/// Sums of all ranks; the place becomes the mean.
DamageCount total(const DamageCount &local, MPI_Comm comm)
{
  double sums[] = {static_cast<double>(local.bonds), local.place[0], local.place[1], local.place[2]};
  MPI_Allreduce(MPI_IN_PLACE, sums, 4, MPI_DOUBLE, MPI_SUM, comm);
  DamageCount result;
  result.bonds = static_cast<std::int64_t>(sums[0]);
  if (result.bonds > 0)
    result.place = Eigen::Vector3d(sums[1], sums[2], sums[3]) / sums[0];
  return result;
}
} // namespace

std::vector<std::string> warnings(const RunFigures &figures)
{
  const EnergyLedger &energy = figures.energy;
  const auto exceeds = [](std::int64_t part, double limit, std::int64_t all)
  { return static_cast<double>(part) > limit * static_cast<double>(all); };
  std::vector<std::string> result;
  if (exceeds(figures.early.bonds, most_early, figures.broken))
    result.push_back(share_of_bonds(figures.early, figures.broken) +
                     " broke in the overlap or within a check interval of the activation of their particles, limit " +
                     percent(most_early) + ": rock breaks before it consists of particles");
  if (exceeds(figures.at_border.bonds, most_at_border, figures.broken))
    result.push_back(share_of_bonds(figures.at_border, figures.broken) + " lie in the overlap at the end, limit " +
                     percent(most_at_border) + ": the particle region is smaller than the damage");
  const double work = energy.tool_work;
  if (work > 0.5 * figures.turnover) // else the tool does not rule anything
  {
    if (energy.damping > most_damping * work)
      result.push_back("damping took " + percent(energy.damping / work) + " of the tool's work, limit " +
                       percent(most_damping) + ": damping rules the force");
    if (energy.kinetic > most_kinetic * work)
      result.push_back("kinetic energy is " + percent(energy.kinetic / work) + " of the tool's work at the end, limit " +
                       percent(most_kinetic) + ": inertia rules the force");
  }
  if (energy.changed_by_conversions() > most_changed * figures.turnover)
    result.push_back("conversions changed the energy by " + percent(energy.changed_by_conversions() / figures.turnover) +
                     " of the energy put in, limit " + percent(most_changed) + ": the models differ where cells are converted");
  return result;
}

DamageWatch::DamageWatch(const CoupledModel &model, int check_interval, MPI_Comm comm)
  : model(model), check_interval(check_interval), comm(comm), active_seen(model.dem().n_active())
{
  for (const char active : model.dem().is_active())
    activated_at.push_back(active ? long_ago : never);
}

void DamageWatch::look()
{
  if (model.dem().n_active() != active_seen)
  {
    active_seen = model.dem().n_active();
    for (std::size_t i = 0; i < activated_at.size(); ++i)
      if (activated_at[i] == never && model.dem().is_active()[i])
        activated_at[i] = looked_at; // conversions follow a look
  }
  const Eigen::VectorXd &weight = model.overlap().de_weights();
  const std::vector<dem::BrokenBond> broken = model.dem().broken_bonds();
  for (; n_seen < broken.size(); ++n_seen)
  {
    const dem::BrokenBond &bond = broken[n_seen];
    const std::int64_t latest = std::max(activated_at[bond.first], activated_at[bond.second]);
    if (bond.at_birth || std::min(weight[bond.first], weight[bond.second]) < 1. || bond.step <= latest + check_interval)
    {
      ++early.bonds;
      early.place += bond.position;
    }
  }
  looked_at = model.step();
}

RunFigures DamageWatch::figures() const
{
  RunFigures result;
  result.broken = model.dem().n_bonds_broken();
  result.early = total(early, comm);
  const Eigen::VectorXd &weight = model.overlap().de_weights();
  DamageCount border;
  for (const dem::BrokenBond &bond : model.dem().broken_bonds())
    if (std::min(weight[bond.first], weight[bond.second]) < 1.)
    {
      ++border.bonds;
      border.place += bond.position;
    }
  result.at_border = total(border, comm);
  result.energy = model.energies();
  return result;
}
} // namespace kerf
