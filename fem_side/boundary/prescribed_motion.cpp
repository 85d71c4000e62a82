// SPDX-License-Identifier: GPL-2.0-or-later
#include "fem_side/boundary/prescribed_motion.h"

#include "fem_side/mesh/face_geometry.h"

#include <map>
#include <set>
#include <stdexcept>

namespace kerf::fem
{
namespace
{
void check_kinds(const std::vector<BoundaryCondition> &conditions)
{
  std::set<std::pair<std::string, BoundaryKind>> used;
  for (const BoundaryCondition &condition : conditions)
    if (!used.insert({condition.name(), condition.kind}).second)
      throw std::invalid_argument("boundary condition: " + condition.name() + " is given twice");
}

/// The axis that all normals of the face are parallel to.
template <int dim>
int roller_direction(const Mesh &mesh, const BoundaryFace &face, const BoundaryCondition &condition)
{
  const auto X = face_positions<dim>(mesh, face);
  int direction = 0;
  for (int point = 0; point < q1::n_nodes<dim - 1>; ++point)
  {
    const q1::Point<dim> normal = q1::area_vector<dim>(X, q1::gauss_point<dim - 1>(point)).normalized();
    if (normal.cwiseAbs().maxCoeff(&direction) < 1. - 1e-8)
      throw std::invalid_argument("boundary condition: roller on " + condition.name() +
                                  ", which has faces that are not parallel to the axes");
  }
  return direction;
}
} // namespace

template <int dim>
std::vector<PrescribedDof> prescribed_dofs(const NodalSpace<dim> &space, const std::vector<BoundaryCondition> &conditions)
{
  check_kinds(conditions);
  std::map<int, PrescribedDof> result;
  const auto prescribe = [&](const BoundaryCondition &condition, const BoundaryFace &face, const int first, const int last)
  {
    for (int a = 0; a < q1::n_nodes<dim - 1>; ++a)
      if (space.owns(face.nodes[a]) && !space.is_slave(face.nodes[a])) // the masters of a slave lie on the same side
        for (int c = first; c < last; ++c)
        {
          const int dof = space.local_dof(face.nodes[a]) + c;
          result.insert({dof, {dof, c, condition.kind == BoundaryKind::velocity ? &condition : nullptr}});
        }
  };
  std::vector<std::vector<char>> selected;
  for (const BoundaryCondition &condition : conditions)
    selected.push_back(selected_faces(space.mesh, condition));
  // The first entry of a component stays.
  for (const BoundaryKind kind : {BoundaryKind::fixed, BoundaryKind::velocity, BoundaryKind::roller})
    for (std::size_t k = 0; k < conditions.size(); ++k)
      if (conditions[k].kind == kind)
        for (std::size_t f = 0; f < space.mesh.boundary.size(); ++f)
          if (selected[k][f])
          {
            const BoundaryFace &face = space.mesh.boundary[f];
            const int direction = kind == BoundaryKind::roller ? roller_direction<dim>(space.mesh, face, conditions[k]) : -1;
            prescribe(conditions[k], face, direction < 0 ? 0 : direction, direction < 0 ? dim : direction + 1);
          }

  std::vector<PrescribedDof> dofs;
  for (const auto &entry : result)
    dofs.push_back(entry.second);
  return dofs;
}

template std::vector<PrescribedDof> prescribed_dofs<2>(const NodalSpace<2> &, const std::vector<BoundaryCondition> &);
template std::vector<PrescribedDof> prescribed_dofs<3>(const NodalSpace<3> &, const std::vector<BoundaryCondition> &);
} // namespace kerf::fem
