// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/dem_side.h"
#include "dem_side/packing/stored_bonds.h"

#include <Eigen/Geometry>
#include <granular_pair_style.h>
#include <lammps.h>
#include <pair_gran.h>

namespace kerf::dem
{
/// What LIGGGHTS keeps for a pair of near particles, moves between ranks and hands back in its neighbour lists. LIGGGHTS turns
/// the sign of the vector for the other particle of the pair.
struct PairHistory
{
  double state;       ///< one of the values below
  double rest_length; ///< stored distance of a bond, intact or broken; 0: never bonded [m]
  double vector[3];   ///< intact: reference normal of the bond; else: tangential spring of the contact [m]

  static constexpr double unbonded = 0., intact = 1., broken = 2.;
};
constexpr int pair_history_size = 5;
static_assert(sizeof(PairHistory) == pair_history_size * sizeof(double));

/// Energies taken out since the start on this rank [J]; a pair across ranks counts half on either.
struct Dissipation
{
  double damping = 0., friction = 0., released = 0.;
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

/// How much further the lists reach than that [m].
inline double list_skin(const Packing &packing)
{
  return 0.25 * packing.mean_diameter;
}

/// The rock bond as a granular pair style of LIGGGHTS: all pair forces of a step, then the force hook. The parts that depend on
/// the dimension are in RockBondLoop. A script names it and gives its parameters (parse_rock_bond_line()); its particles are
/// those of the store by tag = index + 1, others have no bonds.
class RockBondStyle : public LIGGGHTS::PairStyles::IGranularPairStyle
{
public:
  /// Makes the rock bond the pair style of @p lmp, whose box exists already.
  static RockBondStyle *install(LAMMPS_NS::LAMMPS &lmp, const RockBondParameters &parameters);
  /// Makes the model and the fixes it needs known to LIGGGHTS; done by install().
  static void register_with(LAMMPS_NS::LAMMPS &lmp);
  /// The rock bond of @p lmp, or nullptr when its script uses none.
  static RockBondStyle *of(LAMMPS_NS::LAMMPS &lmp);

  const ForceHook *hook = nullptr; ///< called in every force computation
  std::vector<char> added;         ///< by index: inserted, its bonds are not created yet. Empty: nothing to create
  std::int64_t bond_ends_made = 0; ///< by the last creation, over all ranks: twice the number of bonds
  std::int64_t n_particles = 0;    ///< over all ranks that the next list build will find if none leaves the domain
  std::int64_t steps = 0;          ///< since the start
  std::uint64_t order = 0;         ///< see Particles::order
  bool overstretched = false;      ///< an intact bond is longer than the neighbour lists reach
  bool constants_changed = false;  ///< weights or masses are others than when the lists were built
  Dissipation dissipation;
  std::vector<BrokenBond> broken; ///< since the start

  Particles particles();
  void initialise(int local, double weight, const Eigen::Quaterniond &rotation); ///< a particle just made
  void send_to_ghosts();                                                         ///< rotations and weights
  void set_weight(int local, double weight);
  double broken_count(int local) const;  ///< bonds of a particle that broke
  std::int64_t intact_bond_ends() const; ///< of this rank: 2 for a bond inside, 1 for one across ranks
  virtual std::vector<ActiveBond> bonds(const std::vector<char> &target) = 0; ///< see DemSide::bonds()
  virtual double elastic_energy() = 0;                                        ///< of this rank [J]
  Energies energies();                                                        ///< of all ranks. Collective

  /// Local damping acts on the sum of all forces: in a script after the last fix that changes forces.
  void damp_all(bool step);

  // What LIGGGHTS calls.
  void settings(int n_words, char **words, LIGGGHTS::IContactHistorySetup *history) override;
  void init_granular() override;
  void write_restart_settings(FILE *) override;
  void read_restart_settings(FILE *, std::int64_t) override {}
  void compute_force(LAMMPS_NS::PairGran *pair, int eflag, int vflag, int addflag) override;
  int get_history_offset(const std::string) override { return -1; }
  double stressStrainExponent() override { return 1.; }
  std::int64_t hashcode() override { return hash; }
  bool contact_match(const std::string, const std::string) override { return false; }

protected:
  RockBondStyle(LAMMPS_NS::LAMMPS &lmp, LAMMPS_NS::PairGran &gran, std::int64_t hash, const RockBondParameters &parameters);
  ~RockBondStyle() override;

  /// Pair forces into LIGGGHTS' arrays. @param step false: forces at the present state, nothing turns, slides or breaks.
  virtual void pair_forces(bool step) = 0;
  /// Adds local damping and counts what damping takes out, at the velocity the step ends with.
  virtual void damp(bool step) = 0;

  /// Calls visit(i, j, history, flag) for every listed pair; j is a ghost when it is not below the number of local particles,
  /// and then the pair is in the list of another rank, too.
  template <typename Visit>
  void for_each_pair(const Visit &visit) const;
  void record_break(int i, int j, bool shear, const Eigen::Vector3d &position);
  double *rotation() const; ///< quaternions of local and ghost particles
  const double *weight() const;

  LAMMPS_NS::LAMMPS &lmp;
  LAMMPS_NS::PairGran &gran;
  const std::int64_t hash;
  RockBondParameters parameters;

private:
  /// The store of a script.
  struct OwnStore
  {
    explicit OwnStore(Packing all) : packing(std::move(all)), bonds(packing) {}
    const Packing packing;
    const StoredBonds bonds;
    double reach = 0.; // list_reach()
  };

  static LIGGGHTS::PairStyles::IGranularPairStyle *create(LAMMPS_NS::LAMMPS *, LAMMPS_NS::PairGran *, std::int64_t hash);
  void refresh_ghosts();
  void check_intact_bonds();
  void create_bonds();
  void take_store(const std::string &path);
  void check_bonds_of_script() const;

  std::unique_ptr<OwnStore> own_store; // only in a script
  LAMMPS_NS::FixPropertyAtom *rotations, *weights, *broken_counts;
  std::vector<int> index;              ///< in the packing, of the local particles
  std::int64_t bond_ends_at_build = 0; ///< of intact bonds over all ranks
  double damping_ahead = 0.;           ///< counted in dissipation for the way to the next positions [J]
  std::int64_t bond_ends_failed = 0;   ///< of this rank, since the lists were built
};
} // namespace kerf::dem
