// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/method/activation/activation_rule.h"

#include "coupler/base/errors.h"
#include "coupler/base/mpi_helpers.h"
#include "coupler/method/activation/stress_criterion.h"

#include <Eigen/Geometry>
#include <algorithm>

namespace kerf
{
ActivationRule::ActivationRule(const Case &settings, const fem::Mesh &mesh, MPI_Comm comm)
  : settings(settings), mesh(mesh), comm(comm)
{
}

Eigen::VectorXd ActivationRule::measures(const fem::FemSide &fem) const
{
  const fem::CellStress stress = fem.cell_stress();
  Eigen::VectorXd measure = Eigen::VectorXd::Zero(mesh.n_cells());
  for (std::size_t k = 0; k < stress.cell.size(); ++k)
    measure[stress.cell[k]] = stress_measure(settings.activation.criterion, stress.sigma.col(k),
                                             settings.activation.tensile_strength, settings.activation.compressive_strength);
  MPI_Allreduce(MPI_IN_PLACE, measure.data(), mesh.n_cells(), MPI_DOUBLE, MPI_SUM, comm);
  return measure;
}

std::vector<int> ActivationRule::cells_to_convert(const fem::FemSide &fem, const Overlap &overlap) const
{
  const fem::CellStress stress = fem.cell_stress();
  std::vector<int> flagged, following;
  const double quiet = norm_below(settings.activation.event_fraction * settings.activation.sigma_star,
                                  settings.activation.tensile_strength, settings.activation.compressive_strength);
  for (std::size_t k = 0; k < stress.cell.size(); ++k)
  {
    if (!stress.sigma.col(k).allFinite())
      throw UnstableRun("the finite elements became unstable: stress of cell " + std::to_string(stress.cell[k]) +
                        " is not finite");
    const double distance = overlap.distance_of_cell(stress.cell[k]);
    // A cell deep in the overlap waits one event, unless it is a new nucleus away from all particles.
    const bool in_reach = distance <= 0.5 * overlap.width() || distance >= overlap.width();
    if (overlap.is_converted(stress.cell[k]) || !in_reach)
      continue;
    const double squared_norm = stress.sigma.col(k).head<3>().squaredNorm() + 2. * stress.sigma.col(k).tail<3>().squaredNorm();
    if (squared_norm <= quiet * quiet)
      continue; // most of the cells
    const double measure = stress_measure(settings.activation.criterion, stress.sigma.col(k),
                                          settings.activation.tensile_strength, settings.activation.compressive_strength);
    if (measure > settings.activation.sigma_star)
      flagged.push_back(stress.cell[k]);
    else if (measure > settings.activation.event_fraction * settings.activation.sigma_star && distance < overlap.width())
      following.push_back(stress.cell[k]);
  }
  std::vector<int> cells = gather_all(flagged, MPI_INT, comm);
  if (cells.empty())
    return cells;
  following = gather_all(following, MPI_INT, comm);
  cells.insert(cells.end(), following.begin(), following.end());

  std::vector<char> region(mesh.n_cells(), 0);
  for (int cell = 0; cell < mesh.n_cells(); ++cell)
    region[cell] = overlap.is_converted(cell);
  for (const int cell : cells)
    region[cell] = 1;
  const std::vector<int> enclosed = enclose(mesh, region);
  cells.insert(cells.end(), enclosed.begin(), enclosed.end());
  std::sort(cells.begin(), cells.end());
  return cells;
}

std::vector<int> enclose(const fem::Mesh &mesh, std::vector<char> &region)
{
  std::vector<int> cells;
  const auto look_at = [&](int cell)
  {
    if (region[cell])
      return;
    const std::vector<int> &neighbours = mesh.neighbours[cell];
    std::size_t outside = 0;
    for (const int neighbour : neighbours)
      outside += !region[neighbour];
    if (outside <= 1 && neighbours.size() > outside + 1)
    {
      region[cell] = 1;
      cells.push_back(cell);
    }
  };
  for (int cell = 0; cell < mesh.n_cells(); ++cell)
    look_at(cell);
  for (std::size_t k = 0; k < cells.size(); ++k) // they grow
    for (const int neighbour : mesh.neighbours[cells[k]])
      look_at(neighbour);
  return cells;
}

namespace
{
/// Stored particles seen by the finite elements: those that lie in cells of this rank, and the window of the nodes that carry
/// them.
class Probe
{
public:
  Probe(fem::FemSide &fem, const dem::Packing &packing, const std::vector<int> &indices, MPI_Comm comm)
  {
    Eigen::Matrix3Xd points(3, indices.size());
    for (std::size_t k = 0; k < indices.size(); ++k)
      points.col(k) = packing.positions.col(indices[k]);
    found = fem.locate(points);
    int rank = 0;
    MPI_Comm_rank(comm, &rank);
    for (std::size_t k = 0; k < indices.size(); ++k)
    {
      if (found[k].cell < 0)
        throw InputError("stored particle " + std::to_string(indices[k]) + " lies outside the mesh");
      if (fem.mesh().owner[found[k].cell] != rank)
        continue;
      local.push_back(k);
      nodes.insert(nodes.end(), found[k].nodes.begin(), found[k].nodes.begin() + found[k].n);
    }
    std::sort(nodes.begin(), nodes.end());
    nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
    fem.set_window(nodes);
  }

  /// Value and curl of a field of the window at one of the indices.
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

  std::vector<std::size_t> local; ///< places among the indices

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
  const Probe probe(fem, packing, indices, comm);
  Eigen::Matrix3Xd u, v;
  fem.read_window(fem::NodalField::displacement, u);
  fem.read_window(fem::NodalField::velocity, v);

  // Twelve numbers a particle travel between ranks; a list of doubles keeps this one plain gather.
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

ConservedQuantities conserved_quantities(const fem::FemSide &fem, dem::DemSide &dem, const EnergyLedger &energies,
                                         MPI_Comm comm)
{
  using Eigen::Vector3d;
  const bool flat = fem.mesh().dim == 2;
  const dem::Particles particles = dem.particles();
  Eigen::Matrix<double, 7, 1> sums = Eigen::Matrix<double, 7, 1>::Zero(); // mass, momentum, angular momentum
  for (int i = 0; i < particles.n; ++i)
  {
    const Vector3d momentum = particles.mass[i] * particles.velocity.col(i), x = particles.position.col(i);
    const double inertia = (flat ? 0.5 : 0.4) * particles.mass[i] * particles.radius[i] * particles.radius[i];
    sums[0] += particles.mass[i];
    sums.segment<3>(1) += momentum;
    sums.tail<3>() += x.cross(momentum) + inertia * particles.angular_velocity.col(i);
  }
  MPI_Allreduce(MPI_IN_PLACE, sums.data(), 7, MPI_DOUBLE, MPI_SUM, comm);
  if (fem.n_active_cells() > 0)
  {
    const Eigen::Matrix3Xd mass = fem.gather(fem::NodalField::mass), velocity = fem.gather(fem::NodalField::velocity),
                           displacement = fem.gather(fem::NodalField::displacement);
    for (int a = 0; a < fem.mesh().n_nodes(); ++a)
    {
      const Vector3d momentum = mass(0, a) * velocity.col(a), x = fem.mesh().nodes.col(a) + displacement.col(a);
      sums[0] += mass(0, a);
      sums.segment<3>(1) += momentum;
      sums.tail<3>() += x.cross(momentum);
    }
  }
  ConservedQuantities inventory;
  inventory.mass = sums[0];
  inventory.momentum = sums.segment<3>(1);
  inventory.angular_momentum = sums.tail<3>();
  inventory.kinetic = energies.kinetic;
  inventory.elastic = energies.elastic;
  inventory.bonds = dem.n_bonds_intact() + dem.n_bonds_broken();
  return inventory;
}
} // namespace kerf
