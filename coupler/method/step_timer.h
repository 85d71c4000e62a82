// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <array>
#include <mpi.h>
#include <optional>

namespace kerf
{
/// Wall time of the parts of a step on this rank.
enum class Part
{
  fem,
  dem,
  exchange,
  tool,
  activation,
  output
};
constexpr int n_parts = 6;
constexpr std::array<const char *, n_parts> part_names = {
  {"FEM (deal.II side)", "DEM (LIGGGHTS side)", "exchange", "tool contact", "activation", "output"}};

class StepTimer
{
public:
  /// Adds the time since the last call of lap(), for any part, to @p part. A sequence of laps reads the clock once for each
  /// part.
  void lap(Part part)
  {
    const double now = MPI_Wtime();
    seconds[static_cast<int>(whole.value_or(part))] += now - last;
    last = now;
  }
  /// Assigns every lap until end_whole() to @p part, regardless of the part that it names. For a part that calls the others.
  void begin_whole(Part part)
  {
    restart();
    whole = part;
  }
  void end_whole()
  {
    lap(*whole);
    whole.reset();
  }
  void restart() { last = MPI_Wtime(); }
  double of(Part part) const { return seconds[static_cast<int>(part)]; }

private:
  std::array<double, n_parts> seconds = {};
  std::optional<Part> whole;
  double last = 0.;
};
} // namespace kerf
