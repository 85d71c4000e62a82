// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

namespace dealii::Utilities::MPI
{
class Partitioner;
}

namespace kerf::fem
{
/// Exchange of nodal components between the rank that owns them and the ranks that hold copies. Components have global numbers
/// and local positions: owned components come first, copies follow in the order of their global numbers.
class NodalExchange
{
public:
  explicit NodalExchange(std::shared_ptr<const dealii::Utilities::MPI::Partitioner> partitioner);
  /// The same owners, copies of @p components instead. Components may be repeated and may be owned by this rank. Collective.
  NodalExchange(const NodalExchange &owners, std::vector<std::uint64_t> components);

  int n_owned() const { return owned_size; }
  int n_copies() const { return copied_size; }
  /// Is @p component owned by this rank or one of its copies?
  bool has(std::uint64_t component) const;
  /// Local position of a component for which has() is true.
  int position(std::uint64_t component) const;

  /// Copies get the values of their owners. Collective.
  void update_copies(const double *owned, double *copies) const;
  /// The transpose: adds the copies to their owners. Copies are zero afterwards. Collective.
  void add_copies(double *copies, double *owned) const;

  /// For files that work with deal.II's vectors.
  const std::shared_ptr<const dealii::Utilities::MPI::Partitioner> &library_partitioner() const { return partitioner; }

private:
  std::shared_ptr<const dealii::Utilities::MPI::Partitioner> partitioner;
  int owned_size = 0, copied_size = 0;
  mutable std::vector<double> buffer; ///< of messages
};
} // namespace kerf::fem
