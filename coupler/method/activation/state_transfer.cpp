// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/method/activation/state_transfer.h"

#include "coupler/base/mpi_helpers.h"

#include <Eigen/Geometry>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <array>
#include <stdexcept>

namespace kerf
{
using Eigen::Vector3d;
namespace
{
/// Interpolates fields of the finite elements at stored particles in cells of this rank. Sets the nodal window to the nodes of
/// these cells.
class Probe
{
public:
  Probe(fem::FemSide &fem, const dem::Packing &packing, const std::vector<int> &indices, MPI_Comm comm)
  {
    Eigen::Matrix3Xd points(3, indices.size());
    for (std::size_t k = 0; k < indices.size(); ++k)
      points.col(k) = packing.positions.col(indices[k]);
    found = fem.locate(points);
    const int rank = rank_of(comm);
    for (std::size_t k = 0; k < indices.size(); ++k)
    {
      if (found[k].cell < 0)
        throw std::logic_error("stored particle " + std::to_string(indices[k]) + " lies outside the mesh");
      if (fem.mesh().owner[found[k].cell] != rank)
        continue;
      local.push_back(k);
      nodes.insert(nodes.end(), found[k].nodes.begin(), found[k].nodes.begin() + found[k].n);
    }
    std::sort(nodes.begin(), nodes.end());
    nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
    fem.set_window(nodes);
  }

  /// Value and curl of a nodal-window field at particle @p k of the indices.
  std::array<Eigen::Vector3d, 2> at(std::size_t k, const Eigen::Matrix3Xd &field) const
  {
    std::array<Eigen::Vector3d, 2> result{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
    for (int a = 0; a < found[k].n; ++a)
    {
      const auto column = std::lower_bound(nodes.begin(), nodes.end(), found[k].nodes[a]) - nodes.begin();
      const Eigen::Vector3d value = field.col(column), gradient = found[k].dN.col(a);
      result[0] += found[k].N[a] * value;
      result[1] += gradient.cross(value);
    }
    return result;
  }

  std::vector<std::size_t> local; ///< positions in the list of indices, of particles in cells of this rank

private:
  std::vector<fem::Interpolation> found;
  std::vector<int> nodes;
};
} // namespace

std::vector<dem::NewParticle> project(fem::FemSide &fem, const Overlap &overlap, const dem::Packing &packing,
                                      const std::vector<char> &taken, MPI_Comm comm)
{
  std::vector<int> indices;
  for (int i = 0; i < packing.size(); ++i)
    if (!taken[i] && overlap.needs_particle(i))
      indices.push_back(i);
  return states_by_field(fem, packing, indices, comm);
}

std::vector<dem::NewParticle> states_by_field(fem::FemSide &fem, const dem::Packing &packing, const std::vector<int> &indices,
                                              MPI_Comm comm)
{
  const Probe probe(fem, packing, indices, comm);
  Eigen::Matrix3Xd u, v;
  fem.read_window(fem::NodalField::displacement, u);
  fem.read_window(fem::NodalField::velocity, v);

  // Index and twelve numbers of each particle, gathered as one list of doubles.
  constexpr int record = 13;
  std::vector<double> values;
  for (const std::size_t k : probe.local)
  {
    const auto [displacement, curl_u] = probe.at(k, u);
    const auto [velocity, curl_v] = probe.at(k, v);
    values.push_back(indices[k]);
    for (const Eigen::Vector3d &part : {displacement, velocity, Eigen::Vector3d(0.5 * curl_u), Eigen::Vector3d(0.5 * curl_v)})
      values.insert(values.end(), part.data(), part.data() + 3);
  }
  values = gather_all(values, MPI_DOUBLE, comm);

  std::vector<dem::NewParticle> particles(values.size() / record);
  for (std::size_t k = 0; k < particles.size(); ++k)
  {
    const double *value = values.data() + k * record;
    particles[k].index = static_cast<int>(value[0]);
    particles[k].displacement = Eigen::Map<const Eigen::Vector3d>(value + 1);
    particles[k].velocity = Eigen::Map<const Eigen::Vector3d>(value + 4);
    particles[k].rotation = Eigen::Map<const Eigen::Vector3d>(value + 7);
    particles[k].angular_velocity = Eigen::Map<const Eigen::Vector3d>(value + 10);
  }
  std::sort(particles.begin(), particles.end(),
            [](const dem::NewParticle &a, const dem::NewParticle &b) { return a.index < b.index; });
  return particles;
}

std::vector<dem::StoredPair> broken_at_birth(const std::vector<dem::NewParticle> &particles, fem::FemSide &fem,
                                             const dem::DemSide &dem, const dem::Packing &packing,
                                             const dem::StoredBonds &bonds, MPI_Comm comm)
{
  std::vector<int> partners;
  for (const dem::NewParticle &particle : particles)
    for (const int partner : bonds.partners_of(particle.index))
      if (dem.is_active()[partner])
        partners.push_back(partner);
  std::sort(partners.begin(), partners.end());
  partners.erase(std::unique(partners.begin(), partners.end()), partners.end());
  std::unordered_map<int, dem::NewParticle> expected;
  for (const dem::NewParticle &partner : states_by_field(fem, packing, partners, comm))
    expected[partner.index] = partner;
  std::vector<int> ends;
  for (const dem::StoredPair &pair : dem.misfitting_bonds(particles, expected))
    ends.insert(ends.end(), pair.begin(), pair.end());
  ends = gather_all(ends, MPI_INT, comm);
  std::vector<dem::StoredPair> broken;
  for (std::size_t k = 0; k < ends.size(); k += 2)
    broken.push_back({ends[k], ends[k + 1]});
  return broken;
}

void take_momentum_of_growth(const std::vector<dem::NewParticle> &added, const std::function<bool(int, int)> &is_held,
                             fem::FemSide &fem, dem::DemSide &dem, const dem::Packing &packing, const Overlap &overlap,
                             MPI_Comm comm)
{
  dem::Particles particles = dem.particles();
  const std::vector<double> masses = dem.masses_with(added, overlap.de_weights());
  std::unordered_map<int, int> place; // of the growing particles of this rank, by index in the packing
  std::vector<int> growing;
  for (int i = 0; i < particles.n; ++i)
    if (masses[i] > particles.mass[i])
    {
      place[particles.index[i]] = i;
      growing.push_back(particles.index[i]);
    }
  growing = gather_all(growing, MPI_INT, comm);
  std::sort(growing.begin(), growing.end());
  for (const dem::NewParticle &field : states_by_field(fem, packing, growing, comm))
    if (const auto found = place.find(field.index); found != place.end())
    {
      const int i = found->second;
      const double share = 1. - particles.mass[i] / masses[i];
      for (int c = 0; c < 3; ++c)
        if (!is_held(field.index, c))
          particles.velocity(c, i) += share * (field.velocity[c] - particles.velocity(c, i));
      particles.angular_velocity.col(i) += share * (field.angular_velocity - particles.angular_velocity.col(i));
    }
}

std::unordered_map<int, Eigen::Vector3d> project_accelerations(fem::FemSide &fem, const dem::Packing &packing,
                                                               const std::vector<int> &indices, MPI_Comm comm)
{
  const Probe probe(fem, packing, indices, comm);
  Eigen::Matrix3Xd force, inverse_mass;
  fem.read_window(fem::NodalField::force, force);
  fem.read_window(fem::NodalField::inverse_mass, inverse_mass);
  const Eigen::Matrix3Xd acceleration = force.cwiseProduct(inverse_mass);
  constexpr int record = 4;
  std::vector<double> values;
  for (const std::size_t k : probe.local)
  {
    const Eigen::Vector3d a = probe.at(k, acceleration)[0];
    values.push_back(indices[k]);
    values.insert(values.end(), a.data(), a.data() + 3);
  }
  values = gather_all(values, MPI_DOUBLE, comm);
  std::unordered_map<int, Eigen::Vector3d> result;
  for (std::size_t k = 0; k < values.size(); k += record)
    result[static_cast<int>(values[k])] = Eigen::Map<const Eigen::Vector3d>(&values[k + 1]);
  return result;
}

NodalState recover_nodes(const fem::FemSide &fem, dem::DemSide &dem, const dem::Packing &packing, const std::vector<int> &cells,
                         const Eigen::Matrix3Xd &mass_before, MPI_Comm comm)
{
  constexpr int record = 8; // index, mass of the particle, displacement, velocity
  const dem::Particles particles = dem.particles();
  std::vector<char> target(fem.mesh().n_cells(), 0);
  for (const int cell : cells)
    target[cell] = 1;
  Eigen::Matrix3Xd places(3, particles.n);
  for (int i = 0; i < particles.n; ++i)
    places.col(i) = packing.positions.col(particles.index[i]);
  const std::vector<fem::Interpolation> local = fem.locate(places);
  std::vector<double> values;
  for (int i = 0; i < particles.n; ++i)
    if (local[i].cell >= 0 && target[local[i].cell])
    {
      const Vector3d u = packing.displacement(particles.index[i], particles.position.col(i)), v = particles.velocity.col(i);
      values.insert(values.end(), {double(particles.index[i]), packing.volume(particles.index[i])});
      for (const Vector3d &field : {u, v})
        values.insert(values.end(), field.data(), field.data() + 3);
    }
  values = gather_all(values, MPI_DOUBLE, comm);
  std::vector<const double *> rows;
  for (std::size_t k = 0; k < values.size(); k += record)
    rows.push_back(&values[k]);
  std::sort(rows.begin(), rows.end(), [](const double *a, const double *b) { return a[0] < b[0]; });
  places.resize(3, rows.size());
  for (std::size_t k = 0; k < rows.size(); ++k)
    places.col(k) = packing.positions.col(static_cast<int>(rows[k][0]));
  const std::vector<fem::Interpolation> found = fem.locate(places);

  NodalState state{fem.gather(fem::NodalField::displacement), fem.gather(fem::NodalField::velocity)};
  const Eigen::Matrix3Xd inverse_mass = fem.gather(fem::NodalField::inverse_mass);
  for (int c = 0; c < fem.mesh().dim; ++c)
  {
    std::vector<int> number(fem.mesh().n_nodes(), -1), nodes;
    for (const fem::Interpolation &point : found)
      for (int a = 0; a < point.n; ++a)
        if (const int node = point.nodes[a]; number[node] < 0 && mass_before(0, node) == 0. && inverse_mass(c, node) > 0.)
        {
          number[node] = static_cast<int>(nodes.size());
          nodes.push_back(node);
        }
    if (nodes.empty())
      continue;
    std::vector<Eigen::Triplet<double>> entries;
    Eigen::MatrixX2d right = Eigen::MatrixX2d::Zero(nodes.size(), 2);
    for (std::size_t k = 0; k < found.size(); ++k)
    {
      const fem::Interpolation &point = found[k];
      Eigen::RowVector2d rest(rows[k][2 + c], rows[k][5 + c]);
      for (int a = 0; a < point.n; ++a)
        if (number[point.nodes[a]] < 0)
          rest -= point.N[a] * Eigen::RowVector2d(state.displacement(c, point.nodes[a]), state.velocity(c, point.nodes[a]));
      for (int a = 0; a < point.n; ++a)
        if (const int i = number[point.nodes[a]]; i >= 0)
        {
          const double weight = rows[k][1] * point.N[a];
          right.row(i) += weight * rest;
          for (int b = 0; b < point.n; ++b)
            if (const int j = number[point.nodes[b]]; j >= 0)
              entries.emplace_back(i, j, weight * point.N[b]);
        }
    }
    Eigen::SparseMatrix<double> matrix(nodes.size(), nodes.size());
    matrix.setFromTriplets(entries.begin(), entries.end());
    // A node with hardly any particles in its support would make the matrix singular. The small diagonal term keeps it
    // definite.
    constexpr double trace = 1e-10;
    for (std::size_t i = 0; i < nodes.size(); ++i)
      matrix.coeffRef(i, i) *= 1. + trace;
    const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(matrix);
    const Eigen::MatrixX2d solution = solver.solve(right);
    for (std::size_t i = 0; i < nodes.size(); ++i)
    {
      state.displacement(c, nodes[i]) = solution(i, 0);
      state.velocity(c, nodes[i]) = solution(i, 1);
    }
  }
  return state;
}
} // namespace kerf
