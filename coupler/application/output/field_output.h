// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/method/coupled_model.h"

#include <array>
#include <string>
#include <utility>
#include <vector>

namespace kerf
{
/// All particles and bonds of the model at one time. Empty except on the first rank.
struct ParticleFields
{
  std::vector<int> index;
  Eigen::Matrix3Xd position, velocity;
  Eigen::VectorXd radius, weight, damage;

  std::vector<dem::ActiveBond> bonds;
  std::vector<dem::BrokenBond> broken;
};

/// Gathers the fields on the first rank. Collective.
ParticleFields gather_particles(CoupledModel &model, MPI_Comm comm);

/// Writes fem.pvd, particles.pvd, bonds.pvd and tool.pvd with the same time stamps for ParaView, and one HDF5 file for each
/// time stamp for figures and scripts.
class FieldOutput
{
public:
  FieldOutput(const std::string &directory, CoupledModel &model, MPI_Comm comm);

  /// Writes the present state. Collective.
  void write(CoupledModel &model);

private:
  void write_particles(const ParticleFields &fields, const std::string &stamp) const;
  void write_bonds(const ParticleFields &fields, const std::string &stamp) const;
  void write_disc(const Disc &disc, const std::string &stamp) const;
  void write_platens(const std::array<double, 2> &faces, const Box &body, const std::string &stamp) const;
  void write_pvd(const std::string &name) const;
  void write_mesh(const fem::Mesh &mesh) const;
  void write_snapshot(CoupledModel &model, const std::string &stamp, const ParticleFields &fields,
                      const Eigen::Matrix3Xd &displacement, const Eigen::VectorXd &alpha, const Eigen::VectorXd &measure) const;

  std::string directory;
  MPI_Comm comm;
  int dim;
  std::vector<std::pair<double, std::string>> stamps; // time, text in file names
};
} // namespace kerf
