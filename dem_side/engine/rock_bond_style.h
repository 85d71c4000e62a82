// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/bond/bond_parameters.h"
#include "dem_side/packing/stored_bonds.h"
#include "dem_side/particle_types.h"

#include <Eigen/Geometry>
#include <cstdint>
#include <granular_pair_style.h>
#include <lammps.h>
#include <neigh_list.h>
#include <pair_gran.h>
#include <set>
#include <vector>

namespace kerf::dem
{
/// State that LIGGGHTS keeps for a pair of near particles, moves between ranks and returns in its neighbour lists. LIGGGHTS
/// reverses the vector for the other particle of the pair.
struct PairHistory
{
  double state;       ///< one of the values below
  double rest_length; ///< stored distance of a bond; else largest length of the contact, 0: sum of the radii [m]
  double vector[3];   ///< intact: reference normal of the bond; else: tangential spring of the contact [m]

  static constexpr double unbonded = 0., intact = 1., broken = 2.;
};
constexpr int pair_history_size = 5;
static_assert(sizeof(PairHistory) == pair_history_size * sizeof(double));

/// Energies dissipated or released since the start on this rank [J]; a pair across ranks counts half on either.
struct Dissipation
{
  double damping = 0., friction = 0., released = 0.;
  double left = 0.; ///< energy of the particles that left the domain
};

struct RockBondParameters
{
  const Packing *packing = nullptr;
  const StoredBonds *stored_bonds = nullptr;
  BondParameters bond;
  double time_step = 0.;     // [s]
  double local_damping = 0.; // [-]
};

/// Largest distance / sum of radii at which a bonded pair must stay in the neighbour lists.
double list_reach(const Packing &packing, const BondParameters &bond);

/// Additional reach of the lists, so that they stay valid for some steps [m].
inline double list_skin(const Packing &packing)
{
  return 0.25 * packing.mean_diameter;
}

/// Elastic energy of a pair and its force on the first particle at the last force computation, weighted.
struct LoadedPair
{
  int i, j; ///< local; j may be a ghost
  double energy;
  Eigen::Vector3d force;
};

/// The rock bond as a granular pair style of LIGGGHTS: all pair forces of a step, then the force hook. RockBondLoop has the
/// parts that depend on the dimension. Particles are those of the packing by tag = index + 1; particles with larger tags have
/// no bonds.
class RockBondStyle : public LIGGGHTS::PairStyles::IGranularPairStyle
{
public:
  const ForceHook *hook = nullptr;  ///< called in every force computation
  std::vector<char> added;          ///< by index: inserted, its bonds are not created yet. Empty: nothing to create
  std::set<StoredPair> born_broken; ///< stored bonds of added particles that are not created
  std::int64_t bond_ends_made = 0;  ///< by the last creation, over all ranks: twice the number of bonds
  std::int64_t n_particles = 0;     ///< over all ranks that the next list build will find if none leaves the domain
  std::int64_t steps = 0;           ///< since the start
  std::uint64_t order = 0;          ///< see Particles::order
  bool overstretched = false;       ///< an intact bond is longer than the neighbour lists reach
  bool constants_changed = false;   ///< weights or masses have changed since the lists were built
  Dissipation dissipation;
  std::vector<BrokenBond> broken; ///< since the start

  /// To be set before the first force computation. Packing and stored bonds are kept alive by the caller.
  void set_parameters(const RockBondParameters &new_parameters) { parameters = new_parameters; }

  Particles particles();
  void initialise(int local, double weight, const Eigen::Quaterniond &rotation); ///< a particle just made
  void send_to_ghosts();                                                         ///< rotations and weights
  void set_weight(int local, double weight);
  double broken_count(int local) const;  ///< bonds of a particle that broke
  std::int64_t intact_bond_ends() const; ///< of this rank: 2 for a bond inside, 1 for one across ranks
  virtual std::vector<ActiveBond> bonds(const std::vector<char> &target) = 0; ///< see DemSide::bonds()
  virtual double elastic_energy() = 0;                                        ///< of this rank [J]
  /// All pairs with a bond or a contact, as listed; one across ranks is there on both.
  virtual std::vector<LoadedPair> loaded_pairs() = 0;
  /// See DemSide::prepare_weights(). @param leaves a flag for each particle of the packing
  virtual void prepare_weights(const Eigen::VectorXd &new_weights, const std::vector<char> &leaves) = 0;
  Energies energies(); ///< of all ranks. Collective

  /// Counts the energy of the particles that are outside of the domain, as the energies of the last step have it. Collective.
  /// @param moved the step has moved the particles already: positions are those of the next step, velocities of the half step
  /// Theory (10.11)
  void book_leavers(bool moved);

  /// Local damping, which acts on the sum of all forces: after everything else that changes forces.
  void damp_all(bool step);

  // Called by LIGGGHTS.
  void settings(int n_words, char **words, LIGGGHTS::IContactHistorySetup *history) override;
  void init_granular() override {}
  void write_restart_settings(FILE *) override;
  void read_restart_settings(FILE *, std::int64_t) override {}
  void compute_force(LAMMPS_NS::PairGran *pair, int eflag, int vflag, int addflag) override;
  int get_history_offset(const std::string) override { return -1; }
  double stressStrainExponent() override { return 1.; }
  std::int64_t hashcode() override { return hash; }
  bool contact_match(const std::string, const std::string) override { return false; }

protected:
  RockBondStyle(LAMMPS_NS::LAMMPS &lmp, LAMMPS_NS::PairGran &gran, std::int64_t hash);

  /// Pair forces into LIGGGHTS' arrays. @param step false: forces at the present state, nothing rotates, slides or breaks.
  virtual void pair_forces(bool step) = 0;
  /// Adds local damping and counts the energy that damping dissipates, at the velocity at the end of the step.
  virtual void damp(bool step) = 0;
  /// Called after bonds were created.
  virtual void check_created_bonds() const {}
  /// False when something else calls damp_all(), because other forces follow the hook.
  virtual bool damps_after_hook() const { return true; }

  /// Calls visit(i, j, history, flag) for every listed pair. j is a ghost when it is not below the number of local particles;
  /// the pair is then in the list of another rank, too.
  template <typename Visit>
  void for_each_pair(const Visit &visit) const;
  void record_break(int i, int j, bool shear, const Eigen::Vector3d &position);
  double *rotation() const; ///< quaternions of local and ghost particles
  const double *weight() const;

  /// The part of dissipation.damping that belongs to the half step after the last one, by the trapezoidal rule (10.4) [J].
  double damping_ahead = 0.;

  LAMMPS_NS::LAMMPS &lmp;
  LAMMPS_NS::PairGran &gran;
  const std::int64_t hash;
  RockBondParameters parameters;

private:
  void tally(int eflag, int vflag);
  void refuse_lists_of_contacts(bool list_asked_for) const;
  void refresh_ghosts();
  void check_intact_bonds();
  void create_bonds();
  void record_born_broken();

  LAMMPS_NS::FixPropertyAtom *rotations, *weights, *broken_counts;
  bool is_outside(const double *position) const;
  double inertia(int local) const;           ///< moment of inertia [kg m^2]
  double kinetic(int local) const;           ///< see Energies::kinetic
  double finite_step(int local) const;       ///< see Energies::finite_step
  double kinetic_over_step(int local) const; ///< the sum of both at the last step, from the velocity half a step later

  std::vector<int> index;              ///< in the packing, of the local particles
  std::set<int> leavers;               ///< tags of all particles that left, over all ranks
  std::int64_t bond_ends_at_build = 0; ///< of intact bonds over all ranks
  std::int64_t bond_ends_failed = 0;   ///< of this rank, since the lists were built
};

template <typename Visit>
void RockBondStyle::for_each_pair(const Visit &visit) const
{
  const LAMMPS_NS::NeighList &list = *gran.list;
  for (int k = 0; k < list.inum; ++k)
  {
    const int i = list.ilist[k];
    const int n_pairs = list.numneigh[i];
    const int *others = list.firstneigh[i];
    int *flags = gran.listgranhistory->firstneigh[i];
    auto *histories = reinterpret_cast<PairHistory *>(gran.listgranhistory->firstdouble[i]);
    for (int n = 0; n < n_pairs; ++n)
      visit(i, others[n] & NEIGHMASK, histories[n], flags[n]);
  }
}
} // namespace kerf::dem
