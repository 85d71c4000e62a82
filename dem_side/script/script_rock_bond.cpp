// SPDX-License-Identifier: GPL-2.0-or-later
#include "dem_side/script/script_rock_bond.h"

#include "dem_side/bond/bond_kinematics.h"
#include "dem_side/bond/rock_bond_law.h"
#include "dem_side/bond_network/bond_network.h"
#include "dem_side/engine/install_rock_bond.h"
#include "dem_side/script/rock_bond_line.h"

#include <algorithm>
#include <atom.h>
#include <cmath>
#include <domain.h>
#include <fix_property_atom.h>
#include <limits>
#include <modify.h>
#include <neighbor.h>
#include <sstream>
#include <stdexcept>
#include <update.h>

namespace kerf::dem
{
template <int dim>
void ScriptRockBond<dim>::settings(int n_words, char **words, LIGGGHTS::IContactHistorySetup *history)
{
  const RockBondLine line = parse_rock_bond_line(n_words, words);
  parameters.bond = line.bond;
  parameters.local_damping = line.local_damping;
  read_store(line.store);
  RockBondLoop<dim>::settings(0, nullptr, history);
}

/// Reads the stored packing. Its bonds are created in the first force computation.
template <int dim>
void ScriptRockBond<dim>::read_store(const std::string &path)
{
  Packing packing;
  std::string wrong;
  if (!path.empty())
  {
    try
    {
      packing = load_packing(path);
      if (packing.dim != lmp.domain->dimension)
        wrong = path + " holds a packing of dimension " + std::to_string(packing.dim) + ", the script has dimension " +
                std::to_string(lmp.domain->dimension);
    }
    catch (const std::exception &error)
    {
      wrong = error.what();
    }
  }
  int failed = !wrong.empty(), failed_anywhere = 0;
  MPI_Allreduce(&failed, &failed_anywhere, 1, MPI_INT, MPI_MAX, lmp.world);
  if (failed_anywhere)
    throw std::invalid_argument("pair_style gran model kerf_rock_bond: store: " +
                                (wrong.empty() ? path + " could not be read on another rank" : wrong));
  store = std::make_unique<Store>(std::move(packing));
  parameters.packing = &store->packing;
  parameters.stored_bonds = &store->bonds;
  added.assign(store->packing.bonds.empty() ? 0 : store->packing.size(), 1);
  store->reach = store->packing.bonds.empty() ? 1. : list_reach(store->packing, parameters.bond);
  double &factor = lmp.neighbor->contactDistanceFactor;
  factor = std::max(factor, store->reach);
}

template <int dim>
void ScriptRockBond<dim>::init_granular()
{
  parameters.time_step = lmp.update->dt;
  if (lmp.neighbor->contactDistanceFactor < store->reach)
  {
    std::ostringstream text;
    text << "neigh_modify contact_distance_factor " << lmp.neighbor->contactDistanceFactor
         << " would lose bonds of kerf_rock_bond, give at least " << store->reach << " or leave it out";
    throw std::invalid_argument(text.str());
  }
  check_tags();
  check_step();
}

/// Bonds and their history know particles by their tags. delete_atoms numbers the particles again unless told not to.
template <int dim>
void ScriptRockBond<dim>::check_tags() const
{
  const LAMMPS_NS::Atom &atom = *lmp.atom;
  double *known = tags().vector_atom;
  int changed = 0;
  for (int i = 0; i < atom.nlocal; ++i)
  {
    changed = changed || (known[i] != 0. && known[i] != atom.tag[i]);
    known[i] = atom.tag[i];
  }
  MPI_Allreduce(MPI_IN_PLACE, &changed, 1, MPI_INT, MPI_MAX, lmp.world);
  if (changed)
    throw std::invalid_argument("the particles of kerf_rock_bond have been numbered again, which scrambles their bonds: give "
                                "delete_atoms ... compress no, and no reset_ids");
}

template <int dim>
LAMMPS_NS::FixPropertyAtom &ScriptRockBond<dim>::tags() const
{
  auto &property = dynamic_cast<LAMMPS_NS::FixPropertyAtom &>(*lmp.modify->fix[lmp.modify->find_fix("kerf_tag")]);
  property.just_created = 0; // else the first setup would overwrite the values with the default
  return property;
}

/// Throws std::invalid_argument when the bonds of the store, or two touching particles, are unstable at the step. The smallest
/// density of the particles counts. Collective. Theory (8.1), (8.11).
template <int dim>
void ScriptRockBond<dim>::check_step() const
{
  const Packing &packing = store->packing;
  const LAMMPS_NS::Atom &atom = *lmp.atom;
  constexpr double none = std::numeric_limits<double>::infinity();
  double smallest[] = {none, none}; // density of the stored particles [kg/m^3], mass of all [kg]
  for (int i = 0; i < atom.nlocal; ++i)
  {
    if (const int particle = atom.tag[i] - 1; particle < packing.size())
      smallest[0] = std::min(smallest[0], atom.rmass[i] / packing.volume(particle));
    smallest[1] = std::min(smallest[1], atom.rmass[i]);
  }
  MPI_Allreduce(MPI_IN_PLACE, smallest, 2, MPI_DOUBLE, MPI_MIN, lmp.world);
  if (std::isinf(smallest[1]))
    return;
  const BondParameters &bond = parameters.bond;
  const double limit = 4. / (1. + parameters.local_damping), dt = parameters.time_step;
  const double of_bonds = std::isinf(smallest[0]) ? none
                                                  : largest_step(packing, {bond.k_n, bond.k_t, smallest[0], bond.damping}, {},
                                                                 [limit](double) { return limit; });
  // Two particles of the smallest mass that touch: springs and dashpots along the normal, and across it with rotations.
  const double c = law::viscosity(bond.damping, smallest[1], smallest[1], bond.k_n), turning = 1. + 1. / inertia_factor(dim);
  const double normal = dt * dt * bond.k_n + 2. * dt * c;
  const double across = turning * (dt * dt * bond.k_t + 2. * dt * c * std::sqrt(bond.k_t / bond.k_n));
  const bool pair_unstable = 2. / smallest[1] * std::max(normal, across) > limit;
  if (dt <= of_bonds && !pair_unstable)
    return;
  std::ostringstream text;
  text << "timestep " << dt << " s is unstable: ";
  if (dt > of_bonds)
    text << "the bonds of kerf_rock_bond allow at most " << of_bonds << " s";
  else
    text << "it is too large for two particles of the smallest mass, " << smallest[1] << " kg, in a contact of kerf_rock_bond";
  text << " with these k_n, k_t, damping, local_damping and masses";
  throw std::invalid_argument(text.str());
}

/// All bonds of the store between existing particles must have been created.
template <int dim>
void ScriptRockBond<dim>::check_created_bonds() const
{
  const Packing &packing = *parameters.packing;
  std::vector<char> here(packing.size(), 0), exists(packing.size(), 0);
  for (int i = 0; i < lmp.atom->nlocal; ++i)
    if (lmp.atom->tag[i] <= packing.size())
      here[lmp.atom->tag[i] - 1] = 1;
  MPI_Allreduce(here.data(), exists.data(), packing.size(), MPI_CHAR, MPI_MAX, lmp.world);
  std::int64_t expected = 0;
  for (const auto &[a, b] : packing.bonds)
    expected += exists[a] && exists[b];
  if (bond_ends_made != 2 * expected)
    throw std::invalid_argument("pair_style gran model kerf_rock_bond: only " + std::to_string(bond_ends_made / 2) + " of " +
                                std::to_string(expected) +
                                " bonds of the store could be made: the particles of the script are not at their places in the "
                                "store (tag = index + 1)");
}

template class ScriptRockBond<2>;
template class ScriptRockBond<3>;

namespace
{
LIGGGHTS::PairStyles::IGranularPairStyle *create(LAMMPS_NS::LAMMPS *lmp, LAMMPS_NS::PairGran *gran, std::int64_t hash)
{
  if (lmp->domain->box_exist == 0)
    throw std::invalid_argument("pair_style gran model kerf_rock_bond must come after the box (read_data or create_box)");
  if (add_particle_properties(*lmp))
  {
    add_fix(*lmp, "kerf_tag all property/atom kerf_tag scalar no no no 0.");
    add_fix(*lmp, "rock_bond all kerf/rock_bond");
  }
  if (lmp->domain->dimension == 2)
    return new ScriptRockBond<2>(*lmp, *gran, hash);
  return new ScriptRockBond<3>(*lmp, *gran, hash);
}
} // namespace

void register_script_rock_bond()
{
  static const bool registered = (register_rock_bond("kerf_rock_bond", 42, &create), true);
  (void)registered;
}
} // namespace kerf::dem
