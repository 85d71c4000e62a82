// SPDX-License-Identifier: GPL-2.0-or-later
#include "fem_side/fem_side.h"

#include <algorithm>
#include <muParser.h>
#include <set>
#include <sstream>
#include <stdexcept>

namespace kerf::fem
{
namespace
{
std::vector<char> faces_with_id(const Mesh &mesh, const int id)
{
  std::vector<char> selected;
  std::set<int> ids;
  for (const BoundaryFace &face : mesh.boundary)
  {
    selected.push_back(face.id == id);
    ids.insert(face.id);
  }
  if (!ids.count(id))
  {
    std::ostringstream message;
    message << "boundary condition: the mesh has no boundary id " << id << ", it has";
    for (const int other : ids)
      message << ' ' << other;
    if ((mesh.period.array() > 0.).any())
      message << " (periodic sides are no boundary)";
    throw std::invalid_argument(message.str());
  }
  return selected;
}

std::vector<char> faces_where(const Mesh &mesh, const std::string &expression)
{
  Eigen::Vector3d centre;
  mu::Parser fulfilled;
  fulfilled.DefineVar("x", &centre[0]);
  fulfilled.DefineVar("y", &centre[1]);
  fulfilled.DefineVar("z", &centre[2]); // zero in two dimensions
  std::vector<char> selected;
  const int n = 1 << (mesh.dim - 1);
  try
  {
    fulfilled.SetExpr(expression);
    for (const BoundaryFace &face : mesh.boundary)
    {
      centre.setZero();
      for (int a = 0; a < n; ++a)
        centre += mesh.nodes.col(face.nodes[a]) / n;
      selected.push_back(fulfilled.Eval() != 0.);
    }
  }
  catch (const mu::Parser::exception_type &)
  {
    throw std::invalid_argument("boundary condition: '" + expression +
                                "' is no expression of x, y and z such as 'y < 1e-6 && x > 0.1'");
  }
  if (std::none_of(selected.begin(), selected.end(), [](const char yes) { return yes; }))
    throw std::invalid_argument("boundary condition: no boundary face has its centre where '" + expression + "'");
  return selected;
}
} // namespace

std::vector<char> selected_faces(const Mesh &mesh, const BoundaryCondition &condition)
{
  return condition.where.empty() ? faces_with_id(mesh, condition.id) : faces_where(mesh, condition.where);
}
} // namespace kerf::fem
