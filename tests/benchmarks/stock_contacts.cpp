// SPDX-License-Identifier: GPL-2.0-or-later
#include "tests/benchmarks/stock_contacts.h"

#include "dem_side/engine/liggghts_instance.h"

#include <atom.h>
#include <atom_vec.h>
#include <domain.h>
#include <fix.h>
#include <integrate.h>
#include <modify.h>
#include <update.h>

namespace kerf::dem::benchmarks
{
struct StockContacts::Engine
{
  std::unique_ptr<LAMMPS> lmp;
};

StockContacts::StockContacts(const Packing &packing, double density, double time_step, double overlap, MPI_Comm comm)
  : engine(std::make_unique<Engine>())
{
  engine->lmp = make_liggghts(comm);
  LAMMPS &lmp = *engine->lmp;
  const double d = packing.mean_diameter;
  const Eigen::Vector3d lower = packing.lower.array() - 3. * d, upper = packing.upper.array() + 3. * d;
  command(lmp, "units si");
  command(lmp, "atom_style granular");
  command(lmp, "atom_modify map array");
  command(lmp, "boundary f f f");
  command(lmp, "newton off");
  command(lmp, "communicate single vel yes");
  command(lmp, "region domain block ", lower.x(), ' ', upper.x(), ' ', lower.y(), ' ', upper.y(), ' ', lower.z(), ' ',
          upper.z(), " units box");
  command(lmp, "create_box 1 domain");
  command(lmp, "neighbor ", 0.25 * d, " bin");
  command(lmp, "neigh_modify delay 0");
  command(lmp, "fix young all property/global youngsModulus peratomtype 1e9");
  command(lmp, "fix poisson all property/global poissonsRatio peratomtype 0.25");
  command(lmp, "fix restitution all property/global coefficientRestitution peratomtypepair 1 0.7");
  command(lmp, "fix friction all property/global coefficientFriction peratomtypepair 1 0.5");
  command(lmp, "fix velocity all property/global characteristicVelocity scalar 1.");
  command(lmp, "pair_style gran model hooke tangential history");
  command(lmp, "pair_coeff * *");
  command(lmp, "timestep ", time_step);
  command(lmp, "fix motion all nve/sphere");
  command(lmp, "thermo 0");

  LAMMPS_NS::Atom &atom = *lmp.atom;
  for (int i = 0; i < packing.size(); ++i)
  {
    Eigen::Vector3d x = (1. - overlap) * packing.positions.col(i);
    const double *from = lmp.domain->sublo, *to = lmp.domain->subhi;
    if ((x.array() < Eigen::Map<const Eigen::Array3d>(from)).any() || (x.array() >= Eigen::Map<const Eigen::Array3d>(to)).any())
      continue;
    atom.avec->create_atom(1, x.data());
    const int local = atom.nlocal - 1;
    atom.tag[local] = i + 1;
    atom.radius[local] = packing.radii[i];
    atom.density[local] = density;
    atom.rmass[local] = density * packing.volume(i);
    for (int f = 0; f < lmp.modify->nfix; ++f)
      if (lmp.modify->fix[f]->create_attribute)
        lmp.modify->fix[f]->set_arrays(local);
  }
  atom.natoms = packing.size();
  atom.map_init();
  atom.map_set();
  lmp.update->whichflag = 1;
  lmp.update->firststep = lmp.update->beginstep = 0;
  lmp.update->laststep = lmp.update->endstep = std::int64_t(1) << 60;
  lmp.init();
  lmp.update->integrate->setup();
}

StockContacts::~StockContacts() = default;

void StockContacts::advance(int steps)
{
  engine->lmp->update->integrate->run(steps);
}

double StockContacts::force_on(int local) const
{
  return Eigen::Map<const Eigen::Vector3d>(engine->lmp->atom->f[local]).norm();
}
} // namespace kerf::dem::benchmarks
