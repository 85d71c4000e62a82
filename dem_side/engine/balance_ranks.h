// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <Eigen/Core>
#include <lammps.h>
#include <vector>

namespace kerf::dem
{
/// Moves the borders between the ranks so that all ranks have equal numbers of particles, the new ones included: a newly
/// activated region is small and far from the middle of the domain. Collective.
/// @param new_positions of particles that will be created, the same on every rank [m]
/// @param thinnest segment of an axis that a rank may own [m]
/// @param at_once false: no existing particle moves further than to a neighbouring rank, which is the limit of LIGGGHTS'
/// exchange in its next setup
void balance_ranks(LAMMPS_NS::LAMMPS &lmp, const std::vector<Eigen::Vector3d> &new_positions, double thinnest, bool at_once);
} // namespace kerf::dem
