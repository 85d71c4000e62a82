// SPDX-License-Identifier: GPL-2.0-or-later
#include "dem_side/engine/fix_styles.h"

#include <map>
#include <modify.h>

namespace kerf::dem
{
namespace
{
// LIGGGHTS' table of fix styles is filled when the library is built, and it is private. The language exempts explicit
// instantiations from access control. This is the one way to add a style without rebuilding the library.
using FixTable = std::map<std::string, FixMaker>;
FixTable *&fix_table_of(LAMMPS_NS::Modify &modify);
template <FixTable *LAMMPS_NS::Modify::*table>
struct FixTableAccess
{
  friend FixTable *&fix_table_of(LAMMPS_NS::Modify &modify) { return modify.*table; }
};
template struct FixTableAccess<&LAMMPS_NS::Modify::fix_map>;
} // namespace

void register_fix(LAMMPS_NS::LAMMPS &lmp, const std::string &style, FixMaker maker)
{
  (*fix_table_of(*lmp.modify))[style] = maker;
}
} // namespace kerf::dem
