// SPDX-License-Identifier: GPL-2.0-or-later
#include "dem_side/engine/install_rock_bond.h"

#include "dem_side/engine/fix_styles.h"
#include "dem_side/engine/liggghts_instance.h"
#include "dem_side/engine/rock_bond_loop.h"

// contact_models.h uses declarations of comm.h.
#include <comm.h>

#include <contact_models.h>
#include <domain.h>
#include <force.h>
#include <iterator>
#include <modify.h>
#include <pair_gran_proxy.h>
#include <sstream>
#include <stdexcept>
#include <vector>

namespace kerf::dem
{
namespace
{
using LIGGGHTS::PairStyles::IGranularPairStyle;

constexpr const char *model_name = "kerf_embedded_rock_bond"; // scripts have a model of their own
constexpr int model_id = 43;

// The pair style of LIGGGHTS hides the model that it runs. The language exempts explicit instantiations from access control.
IGranularPairStyle *model_of(LAMMPS_NS::PairGranProxy &pair);
template <IGranularPairStyle *LAMMPS_NS::PairGranProxy::*model>
struct ModelAccess
{
  friend IGranularPairStyle *model_of(LAMMPS_NS::PairGranProxy &pair) { return pair.*model; }
};
template struct ModelAccess<&LAMMPS_NS::PairGranProxy::impl>;

/// Before LIGGGHTS exchanges particles between ranks, which deletes those outside of the domain.
class LeaversFix : public LAMMPS_NS::Fix
{
public:
  using Fix::Fix;
  int setmask() override { return LAMMPS_NS::FixConst::PRE_EXCHANGE; }
  void setup_pre_exchange() override { find_rock_bond(*lmp)->book_leavers(false); }
  void pre_exchange() override { find_rock_bond(*lmp)->book_leavers(true); }
};

IGranularPairStyle *create(LAMMPS_NS::LAMMPS *lmp, LAMMPS_NS::PairGran *gran, std::int64_t hash)
{
  add_particle_properties(*lmp);
  if (lmp->domain->dimension == 2)
    return new RockBondLoop<2>(*lmp, *gran, hash);
  return new RockBondLoop<3>(*lmp, *gran, hash);
}
} // namespace

RockBondStyle &install_rock_bond(LAMMPS_NS::LAMMPS &lmp, const RockBondParameters &parameters)
{
  static const bool registered = (register_rock_bond(model_name, model_id, &create), true);
  (void)registered;
  command(lmp, "pair_style gran model ", model_name);
  RockBondStyle *style = find_rock_bond(lmp);
  if (style == nullptr)
    throw std::logic_error("LIGGGHTS did not create the rock bond");
  style->set_parameters(parameters);
  command(lmp, "pair_coeff * *");
  register_fix(lmp, "kerf/leavers", &make_fix<LeaversFix>);
  add_fix(lmp, "kerf_leavers all kerf/leavers");
  return *style;
}

RockBondStyle *find_rock_bond(LAMMPS_NS::LAMMPS &lmp)
{
  auto *pair = dynamic_cast<LAMMPS_NS::PairGranProxy *>(lmp.force->pair);
  return pair != nullptr ? dynamic_cast<RockBondStyle *>(model_of(*pair)) : nullptr;
}

void register_rock_bond(const char *name, int id,
                        IGranularPairStyle *(*create)(LAMMPS_NS::LAMMPS *, LAMMPS_NS::PairGran *, std::int64_t hash))
{
  LIGGGHTS::ContactModels::Factory::instance().addNormalModel(name, id);
  const std::int64_t hash =
    LIGGGHTS::Utils::generate_gran_hashcode(id, LIGGGHTS::ContactModels::TANGENTIAL_OFF, LIGGGHTS::ContactModels::COHESION_OFF,
                                            LIGGGHTS::ContactModels::ROLLING_OFF, LIGGGHTS::ContactModels::SURFACE_DEFAULT);
  LIGGGHTS::PairStyles::Factory::instance().addStyle("gran", static_cast<int>(hash), create);
}

bool add_particle_properties(LAMMPS_NS::LAMMPS &lmp)
{
  if (lmp.modify->find_fix("kerf_rotation") >= 0)
    return false;
  // All move with the particles. The first two are sent to ghosts, too (RockBondStyle::send_to_ghosts()).
  add_fix(lmp, "kerf_rotation all property/atom kerf_rotation vector no yes no 1. 0. 0. 0.");
  add_fix(lmp, "kerf_weight all property/atom kerf_weight scalar no yes no 1.");
  add_fix(lmp, "kerf_broken all property/atom kerf_broken scalar no no no 0.");
  return true;
}

void add_fix(LAMMPS_NS::LAMMPS &lmp, const std::string &line)
{
  std::istringstream stream(line);
  std::vector<std::string> words{std::istream_iterator<std::string>(stream), {}};
  std::vector<char *> pointers;
  for (std::string &word : words)
    pointers.push_back(word.data());
  lmp.modify->add_fix(static_cast<int>(pointers.size()), pointers.data());
}
} // namespace kerf::dem
