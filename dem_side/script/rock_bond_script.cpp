// SPDX-License-Identifier: GPL-2.0-or-later
// What the rock bond needs when a script names it: settings from the line and the store.
#include "dem_side/engine/rock_bond_style.h"
#include "dem_side/script/rock_bond_line.h"

#include <algorithm>
#include <atom.h>
#include <contact_interface.h>
#include <domain.h>
#include <neighbor.h>
#include <sstream>
#include <stdexcept>
#include <update.h>

namespace kerf::dem
{
double list_reach(const Packing &packing, const BondParameters &bond)
{
  // What an intact bond can be stretched, with room; unbreakable bonds of tests get a share of the diameter.
  const double stretch = std::clamp(1.5 * bond.R_n / bond.k_n, 0.03 * packing.mean_diameter, 0.2 * packing.mean_diameter);
  double reach = 1.03;
  for (const auto &[a, b] : packing.bonds)
    reach = std::max(reach, (packing.branch(a, b).norm() + stretch) / (packing.radii[a] + packing.radii[b]));
  return reach;
}

void RockBondStyle::settings(int n_words, char **words, LIGGGHTS::IContactHistorySetup *history)
{
  if (parameters.packing == nullptr)
  {
    const RockBondLine line = parse_rock_bond_line(n_words, words);
    parameters.bond = line.bond;
    parameters.local_damping = line.local_damping;
    take_store(line.store);
  }
  history->add_history_value("state", "0");
  history->add_history_value("rest_length", "0");
  for (const char *component : {"x", "y", "z"})
    history->add_history_value(component, "1");
}

/// The store of a script; its bonds are created in the first force computation.
void RockBondStyle::take_store(const std::string &path)
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
  own_store = std::make_unique<OwnStore>(std::move(packing));
  parameters.packing = &own_store->packing;
  parameters.stored_bonds = &own_store->bonds;
  added.assign(own_store->packing.bonds.empty() ? 0 : own_store->packing.size(), 1);
  own_store->reach = own_store->packing.bonds.empty() ? 1. : list_reach(own_store->packing, parameters.bond);
  double &factor = lmp.neighbor->contactDistanceFactor;
  factor = std::max(factor, own_store->reach);
}

void RockBondStyle::init_granular()
{
  if (own_store == nullptr)
    return;
  parameters.time_step = lmp.update->dt;
  if (lmp.neighbor->contactDistanceFactor < own_store->reach)
  {
    std::ostringstream text;
    text << "neigh_modify contact_distance_factor " << lmp.neighbor->contactDistanceFactor
         << " would lose bonds of kerf_rock_bond, give at least " << own_store->reach << " or leave it out";
    throw std::invalid_argument(text.str());
  }
}

void RockBondStyle::write_restart_settings(FILE *)
{
  throw std::invalid_argument("write_restart: the state of kerf_rock_bond cannot be written to a restart file");
}

/// All bonds of the store between particles that exist must have been made.
void RockBondStyle::check_bonds_of_script() const
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
} // namespace kerf::dem
