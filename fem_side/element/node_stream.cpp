// SPDX-License-Identifier: GPL-2.0-or-later
#include "fem_side/element/node_stream.h"

namespace kerf::fem
{
template <int dim>
void NodeStream<dim>::plan(const std::vector<Part> &batches, const std::vector<int> &node_dofs)
{
  if (direct)
  {
    for (const Part &batch : batches)
      for (int k = 0; k < batch.count; ++k)
        batch.nodes[k] = node_dofs[batch.nodes[k]];
    return;
  }
  std::vector<int> last_batch(node_dofs.size(), -1), place(node_dofs.size(), -1), vacant;
  for (std::size_t b = 0; b < batches.size(); ++b)
    for (int k = 0; k < batches[b].count; ++k)
      last_batch[batches[b].nodes[k]] = static_cast<int>(b);

  reads = {{}, {0}};
  writes = {{}, {0}};
  int n_places = 0;
  for (std::size_t b = 0; b < batches.size(); ++b)
  {
    const Part &batch = batches[b];
    for (int k = 0; k < batch.count; ++k)
    {
      const int node = batch.nodes[k];
      if (place[node] >= 0)
        continue;
      if (vacant.empty())
        vacant.push_back(node_stride<dim> * n_places++);
      place[node] = vacant.back();
      vacant.pop_back();
      reads.transfers.push_back({node_dofs[node], place[node]});
    }
    for (int k = 0; k < batch.count; ++k)
    {
      const int node = batch.nodes[k];
      batch.nodes[k] = place[node];
      if (last_batch[node] != static_cast<int>(b))
        continue; // lanes may share nodes
      last_batch[node] = -1;
      writes.transfers.push_back({node_dofs[node], place[node]});
      vacant.push_back(place[node]);
    }
    reads.begin.push_back(static_cast<int>(reads.transfers.size()));
    writes.begin.push_back(static_cast<int>(writes.transfers.size()));
  }
  values.assign(node_stride<dim> * n_places, 0.);
}

template class NodeStream<2>;
template class NodeStream<3>;
} // namespace kerf::fem
