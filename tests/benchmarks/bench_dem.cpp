// SPDX-License-Identifier: GPL-2.0-or-later
// Particle-steps per second of the particle side, of a plain bond loop and of LIGGGHTS' own contacts on the same packing.
// Under mpirun the steps of the whole job count, in wall time; the plain loop has no ranks and is left out.
#include "tests/benchmarks/fcc_block.h"
#include "tests/benchmarks/plain_bond_loop.h"
#include "tests/benchmarks/stock_contacts.h"
#include "tests/support/dem_test_packings.h"

#include <benchmark/benchmark.h>
#include <string>

using namespace kerf::dem;
using namespace kerf::dem::benchmarks;

namespace
{
int n_ranks = 1, rank = 0;

/// Bonds that are checked but do not fail under the shaking below.
Settings settings_of(const Packing &packing, double damping, double local_damping)
{
  Settings s = test::settings(packing);
  s.bond.R_n = s.bond.R_t = 0.1 * packing.mean_diameter * s.bond.k_n;
  s.bond.damping = damping;
  s.local_damping = local_damping;
  return s;
}

double perturb(int particle, int component)
{
  return 0.1 * test::noise(3 * static_cast<std::uint64_t>(particle) + component); // [m/s]
}

/// Runs @p advance(steps) and reports what it does in a second. The number of rounds is fixed: ranks must agree.
template <typename Advance>
void measure(benchmark::State &state, const Packing &packing, const Advance &advance)
{
  const int steps = std::max(1, 200000 / packing.size());
  advance(steps); // caches, first touch
  for (auto _ : state)
    advance(steps);
  const double done = static_cast<double>(state.iterations()) * steps;
  state.counters["particle_steps_per_second"] = benchmark::Counter(done * packing.size(), benchmark::Counter::kIsRate);
  state.counters["seconds_per_step"] = benchmark::Counter(done, benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
  state.counters["particles"] = packing.size();
  state.counters["bonds_per_particle"] = 2. * static_cast<double>(packing.bonds.size()) / packing.size();
  state.counters["ranks"] = n_ranks;
}

void rock_bond(benchmark::State &state, const Packing &packing, double damping, double local_damping)
{
  DemSide dem(settings_of(packing, damping, local_damping));
  auto particles = test::all_particles(packing);
  for (NewParticle &p : particles)
    for (int c = 0; c < packing.dim; ++c)
      p.velocity[c] = perturb(p.index, c);
  test::start(dem, packing, particles);
  measure(state, packing, [&](int steps) { dem.advance(steps, {}); });
  if (dem.n_bonds_intact() != static_cast<std::int64_t>(packing.bonds.size()))
    state.SkipWithError("bonds failed");
}

void plain_loop(benchmark::State &state, const Packing &packing, double damping)
{
  const Settings s = settings_of(packing, damping, 0.);
  PlainBondLoop plain(packing, s.bond, s.density, s.time_step);
  for (int i = 0; i < packing.size(); ++i)
    for (int c = 0; c < 3; ++c)
      plain.particles[i].v[c] = perturb(i, c);
  measure(state, packing, [&](int steps) { plain.advance(steps); });
  if (plain.n_broken() > 0)
    state.SkipWithError("bonds failed");
}

void stock_contacts(benchmark::State &state, const Packing &packing)
{
  // Steps so small that the block, which is under pressure, stays in contact.
  StockContacts stock(packing, 2700., 1e-12, 1e-3, MPI_COMM_WORLD);
  measure(state, packing, [&](int steps) { stock.advance(steps); });
  if (!(stock.force_on(0) > 0.))
    state.SkipWithError("there are no contacts");
}

struct SilentReporter : benchmark::BenchmarkReporter
{
  bool ReportContext(const Context &) override { return true; }
  void ReportRuns(const std::vector<Run> &) override {}
};
} // namespace

int main(int argc, char **argv)
{
  MPI_Init(&argc, &argv);
  MPI_Comm_size(MPI_COMM_WORLD, &n_ranks);
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv))
    return 2;

  struct Body
  {
    std::string name;
    Packing packing;
  };
  const Body bodies[] = {{"fcc_10976", fcc_block(14, 5e-4)},
                         {"fcc_48668", fcc_block(23, 5e-4)},
                         {"triangular_15000", test::triangular_lattice(120, 125, 5e-4)}};
  const auto add = [](const std::string &name, auto function)
  {
    auto *bench = benchmark::RegisterBenchmark(name.c_str(), function);
    bench->Iterations(20)->Unit(benchmark::kMillisecond);
    if (n_ranks > 1)
      bench->UseRealTime();
  };
  for (const Body &body : bodies)
  {
    const Packing &packing = body.packing;
    for (const auto &[kind, damping, local] :
         {std::tuple<const char *, double, double>{"damped", 0.1, 0.}, {"undamped", 0., 0.}, {"local_damping", 0., 0.1}})
    {
      const double xi = damping, alpha = local; // structured bindings are not captured
      const std::string of = body.name + "/" + kind;
      add("rock_bond/" + of, [&packing, xi, alpha](benchmark::State &state) { rock_bond(state, packing, xi, alpha); });
      if (packing.dim == 3 && alpha == 0. && n_ranks == 1)
        add("plain_loop/" + of, [&packing, xi](benchmark::State &state) { plain_loop(state, packing, xi); });
    }
    if (packing.dim == 3)
      add("stock_liggghts/" + body.name, [&packing](benchmark::State &state) { stock_contacts(state, packing); });
  }

  if (rank == 0)
    benchmark::RunSpecifiedBenchmarks();
  else
  {
    SilentReporter silent;
    benchmark::RunSpecifiedBenchmarks(&silent);
  }
  benchmark::Shutdown();
  MPI_Finalize();
  return 0;
}
