// SPDX-License-Identifier: GPL-2.0-or-later
#include "fem_side/prescribed_motion.h"

#include <map>
#include <set>
#include <sstream>
#include <stdexcept>

namespace kerf::fem
{
namespace
{
void check_ids(const Mesh &mesh, const std::vector<BoundaryCondition> &conditions)
{
  std::set<int> in_mesh, used;
  for (const BoundaryFace &face : mesh.boundary)
    in_mesh.insert(face.id);
  for (const BoundaryCondition &condition : conditions)
  {
    std::ostringstream message;
    if (!used.insert(condition.id).second)
      message << "boundary condition: id " << condition.id << " is given twice";
    else if (!in_mesh.count(condition.id))
    {
      message << "boundary condition: the mesh has no boundary id " << condition.id << ", it has";
      for (const int id : in_mesh)
        message << ' ' << id;
      if ((mesh.period.array() > 0.).any())
        message << " (periodic sides are no boundary)";
    }
    if (!message.str().empty())
      throw std::runtime_error(message.str());
  }
}

/// The axis that all normals of the face are parallel to.
template <int dim>
int roller_direction(const Mesh &mesh, const BoundaryFace &face)
{
  const auto X = face_positions<dim>(mesh, face);
  int direction = 0;
  for (int point = 0; point < q1::n_nodes<dim - 1>; ++point)
  {
    const q1::Point<dim> normal = q1::area_vector<dim>(X, q1::gauss_point<dim - 1>(point)).normalized();
    if (normal.cwiseAbs().maxCoeff(&direction) < 1. - 1e-8)
      throw std::runtime_error("boundary condition: roller on id " + std::to_string(face.id) +
                               ", which has faces that are not parallel to the axes");
  }
  return direction;
}
} // namespace

template <int dim>
std::vector<PrescribedDof> prescribed_dofs(const NodalSpace<dim> &space, const std::vector<BoundaryCondition> &conditions)
{
  check_ids(space.mesh, conditions);
  std::map<int, PrescribedDof> result;
  const auto prescribe = [&](const BoundaryCondition &condition, const BoundaryFace &face, const int first, const int last)
  {
    for (int a = 0; a < q1::n_nodes<dim - 1>; ++a)
      if (space.owns(face.nodes[a]))
        for (int c = first; c < last; ++c)
        {
          const int dof = space.local_dof(face.nodes[a]) + c;
          result.insert({dof, {dof, c, condition.kind == BoundaryKind::velocity ? &condition : nullptr}});
        }
  };
  // The first entry of a component stays.
  for (const BoundaryKind kind : {BoundaryKind::fixed, BoundaryKind::velocity, BoundaryKind::roller})
    for (const BoundaryCondition &condition : conditions)
      if (condition.kind == kind)
        for (const BoundaryFace &face : space.mesh.boundary)
          if (face.id == condition.id)
          {
            const int direction = kind == BoundaryKind::roller ? roller_direction<dim>(space.mesh, face) : -1;
            prescribe(condition, face, direction < 0 ? 0 : direction, direction < 0 ? dim : direction + 1);
          }

  std::vector<PrescribedDof> dofs;
  for (const auto &entry : result)
    dofs.push_back(entry.second);
  return dofs;
}

template std::vector<PrescribedDof> prescribed_dofs<2>(const NodalSpace<2> &, const std::vector<BoundaryCondition> &);
template std::vector<PrescribedDof> prescribed_dofs<3>(const NodalSpace<3> &, const std::vector<BoundaryCondition> &);
} // namespace kerf::fem
