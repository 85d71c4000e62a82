// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/method/constraint/corrector/nodal_strain.h"

namespace kerf
{
namespace
{
/// Share of each of @p n values in their mean. The mean of no values is zero.
double share_of(int n)
{
  return n > 0 ? 1. / n : 0.;
}
} // namespace

template <int dim>
void NodalStrain<dim>::assign(const RecoveredGradient &recovered, const ParticleInterpolation &interpolation,
                              const CellBatches<dim> &cells)
{
  middles.clear();
  number_of.clear();
  member.clear();
  end.clear();
  n_cells = cells.cells().size();
  std::size_t k = 0;
  for (const auto &cell : cells.cells())
  {
    const InterpolatedParticle &entry = interpolation.entries()[cells.entry(k, 0)];
    std::vector<int> nodes;
    for (int a = 0; a < entry.n; ++a)
      nodes.push_back(interpolation.window()[entry.node[a]]);
    add_mean(recovered.turning(entry.cell, nodes), recovered, interpolation.columns());
    k = cell.end;
  }
  for (int a = 0; a < interpolation.n_carriers(); ++a)
    add_mean(recovered.counting_around(interpolation.window()[a]), recovered, interpolation.columns());
  of_middle.resize(middles.size());
  mean.resize(end.size());
  of_nodes.assign(interpolation.n_carriers(), Strain{});
}

template <int dim>
void NodalStrain<dim>::add_mean(const std::vector<int> &cells, const RecoveredGradient &recovered,
                                const std::vector<int> &column_of_node)
{
  for (const int cell : cells)
  {
    if (cell >= static_cast<int>(number_of.size()))
      number_of.resize(cell + 1, -1);
    if (number_of[cell] < 0)
    {
      number_of[cell] = static_cast<int>(middles.size());
      const fem::Interpolation &centre = recovered.centre_of(cell);
      Middle middle{};
      middle.node.fill(column_of_node[centre.nodes[0]]);
      for (int a = 0; a < centre.n; ++a)
      {
        middle.node[a] = column_of_node[centre.nodes[a]];
        for (int d = 0; d < dim; ++d)
          middle.share[a][d] = centre.dN(d, a);
      }
      middles.push_back(middle);
    }
    member.push_back(number_of[cell]);
  }
  end.push_back(static_cast<int>(member.size()));
}

template <int dim>
void NodalStrain<dim>::gather(const Eigen::Matrix3Xd &displacement)
{
  using Vectors = PackedVectors<dim>;
  using Components = StrainComponents<dim>;
  for (std::size_t k = 0; k < middles.size(); ++k)
  {
    One along[dim] = {};
    for (int a = 0; a < corners; ++a)
    {
      const One u = Vectors::load_one(displacement.data() + 3 * middles[k].node[a]);
      for (int d = 0; d < dim; ++d)
        along[d] += u * middles[k].share[a][d];
    }
    for (int d = 0; d < dim; ++d)
      of_middle[k][d] = along[d];
  }
  int at = 0;
  for (std::size_t k = 0; k < end.size(); ++k)
  {
    const double share = share_of(end[k] - at);
    One sum[dim] = {};
    for (; at < end[k]; ++at)
      for (int d = 0; d < dim; ++d)
        sum[d] += of_middle[member[at]][d];
    One H[dim];
    for (int d = 0; d < dim; ++d)
    {
      H[d] = share * sum[d];
      mean[k][d] = H[d];
      mean[k][d][d] += 1.;
    }
    if (k < n_cells)
      continue;
    Strain strain = {};
    for (int s = 0; s < Components::n; ++s)
    {
      const auto [p, q] = Components::axes[s];
      double twice = H[p][q] + H[q][p];
      for (int c = 0; c < dim; ++c)
        twice += H[p][c] * H[q][c];
      strain[s] = p == q ? 0.5 * twice : twice;
    }
    of_nodes[k - n_cells] = strain;
  }
  given_to_nodes.assign(of_nodes.size(), Strain{});
  given_to_mean.assign(mean.size(), Gradient{});
}

template <int dim>
void NodalStrain<dim>::scatter(Eigen::Matrix3Xd &force)
{
  using Vectors = PackedVectors<dim>;
  using Components = StrainComponents<dim>;
  given_to_middle.assign(middles.size(), Gradient{});
  int at = 0;
  for (std::size_t k = 0; k < end.size(); ++k)
  {
    const double share = share_of(end[k] - at);
    Gradient given = given_to_mean[k];
    if (k >= n_cells)
      for (int s = 0; s < Components::n; ++s)
      {
        const auto [p, q] = Components::axes[s];
        const double stress = given_to_nodes[k - n_cells][s];
        given[q] += stress * mean[k][p];
        if (p != q)
          given[p] += stress * mean[k][q];
      }
    for (int d = 0; d < dim; ++d)
      given[d] *= share;
    for (; at < end[k]; ++at)
      for (int d = 0; d < dim; ++d)
        given_to_middle[member[at]][d] += given[d];
  }
  for (std::size_t k = 0; k < middles.size(); ++k)
    for (int a = 0; a < corners; ++a)
    {
      double *on_node = force.data() + 3 * middles[k].node[a];
      One sum = Vectors::load_one(on_node);
      for (int d = 0; d < dim; ++d)
        sum += given_to_middle[k][d] * middles[k].share[a][d];
      Vectors::store_one(on_node, sum);
    }
}

template class NodalStrain<2>;
template class NodalStrain<3>;
} // namespace kerf
