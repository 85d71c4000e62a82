// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/method/constraint/exchange/couple_on_nodes.h"

#include "coupler/method/constraint/exchange/simd.h"

#include <Eigen/Dense>

namespace kerf
{
void CoupleOnNodes::renew(const fem::Mesh &mesh, const std::vector<int> &nodes, const Eigen::Matrix3Xd &inverse_mass)
{
  const Eigen::Index n = static_cast<Eigen::Index>(nodes.size());
  flat = mesh.dim == 2;
  places.resize(3, n);
  mass.setZero(n);
  for (Eigen::Index a = 0; a < n; ++a)
  {
    places.col(a) = mesh.nodes.col(nodes[a]);
    if (inverse_mass.col(a).head(mesh.dim).minCoeff() > 0.)
      mass[a] = 1. / inverse_mass(0, a);
  }
  total_mass = mass.sum();
  if (total_mass > 0.)
    places.colwise() -= Eigen::Vector3d(places * mass / total_mass); // avoids cancellation in the second moments
}

void CoupleOnNodes::add(const Eigen::Vector3d &couple, const Eigen::Matrix3Xd &displacement, Eigen::Matrix3Xd &force) const
{
  if (total_mass == 0. || couple.isZero(0.))
    return;
  if (flat)
    return add_in_plane(couple[2], displacement, force);
  using Eigen::Matrix3d, Eigen::Vector3d;
  using Vectors = PackedVectors<3>;
  const auto place = [&](Eigen::Index a) -> Vectors::One
  { return Vectors::load_one(places.data() + 3 * a) + Vectors::load_one(displacement.data() + 3 * a); };
  const auto next = [](const Vectors::One &v) -> Vectors::One { return __builtin_shufflevector(v, v, 1, 2, 0, 3); };
  Vectors::One sum = {}, squares = {}, products = {}; // x y, y z, z x
  for (Eigen::Index a = 0; a < mass.size(); ++a)
  {
    const Vectors::One x = place(a), moment = mass[a] * x;
    sum += moment;
    squares += moment * x;
    products += moment * next(x);
  }
  const Vector3d first(sum[0], sum[1], sum[2]);
  Matrix3d second;
  second << squares[0], products[0], products[2], products[0], squares[1], products[1], products[2], products[1], squares[2];
  second -= first * first.transpose() / total_mass;
  const double trace = second.trace();
  if (!(trace > 0.))
    return;                      // a single node
  constexpr double line = 1e-14; // nodes on a line have no inertia about it
  const Matrix3d inertia = (1. + line) * trace * Matrix3d::Identity() - second;
  const Vector3d centre = first / total_mass, turn = inertia.ldlt().solve(couple);
  const Vectors::One middle = Vectors::load_one(centre.data()), about = Vectors::load_one(turn.data());
  for (Eigen::Index a = 0; a < mass.size(); ++a)
  {
    const Vectors::One arm = mass[a] * (place(a) - middle);
    double *on_node = force.data() + 3 * a;
    Vectors::store_one(on_node, Vectors::load_one(on_node) + next(about * next(arm) - next(about) * arm)); // rotation x arm
  }
}

void CoupleOnNodes::add_in_plane(double couple, const Eigen::Matrix3Xd &displacement, Eigen::Matrix3Xd &force) const
{
  const auto place = [&](Eigen::Index a) -> Eigen::Vector2d { return places.col(a).head<2>() + displacement.col(a).head<2>(); };
  Eigen::Vector2d first = Eigen::Vector2d::Zero();
  double second = 0.;
  for (Eigen::Index a = 0; a < mass.size(); ++a)
  {
    const Eigen::Vector2d x = place(a);
    first += mass[a] * x;
    second += mass[a] * x.squaredNorm();
  }
  const double inertia = second - first.squaredNorm() / total_mass;
  if (!(inertia > 0.))
    return; // a single node
  const double turn = couple / inertia;
  const Eigen::Vector2d centre = first / total_mass;
  for (Eigen::Index a = 0; a < mass.size(); ++a)
  {
    const Eigen::Vector2d arm = turn * mass[a] * (place(a) - centre);
    force(0, a) -= arm[1];
    force(1, a) += arm[0];
  }
}
} // namespace kerf
