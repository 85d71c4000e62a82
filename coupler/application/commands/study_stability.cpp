// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/application/commands/commands.h"
#include "coupler/application/output/results_directory.h"
#include "coupler/application/output/written.h"
#include "coupler/application/setup/problem.h"
#include "coupler/base/errors.h"
#include "coupler/base/mpi_helpers.h"
#include "coupler/base/noise.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>
#include <iomanip>
#include <limits>
#include <sstream>

namespace kerf
{
namespace
{
/// Parameters of one run of a map.
struct Point
{
  std::vector<Override> overrides;
  double step = 0.8;   ///< time step, relative to the smaller stable step of both sides [-]
  double speed = 1e-6; ///< speed of the noise, relative to that of the P wave [-]
};

/// A map over two parameters.
struct Map
{
  std::string name, x_name, y_name;
  std::vector<std::string> x, y;
  std::function<Point(const std::string &x, const std::string &y)> point;
};

const std::vector<std::string> methods = {"penalty", "penalty_mass_scaled", "weak_multipliers", "lumped_multipliers"};

/// The penalty ratio has a different meaning in each method, so each method has its own value in a comparison.
std::vector<Override> method_overrides(const std::string &method)
{
  const std::string ratio = method == "penalty" ? "0.1" : method == "lumped_multipliers" ? "0.02" : "0.25";
  return {"Coupling/Method=" + method, "Coupling/Penalty ratio=" + ratio};
}

std::vector<Override> joined(std::vector<Override> list, const std::vector<Override> &more)
{
  list.insert(list.end(), more.begin(), more.end());
  return list;
}

std::vector<Map> make_maps(double diameter)
{
  std::vector<Map> maps;
  for (const std::string method : {"penalty", "penalty_mass_scaled"})
    maps.push_back({"step_" + method,
                    "Coupling/Penalty ratio",
                    "time step / stable step of the sides",
                    {"0.05", "0.1", "0.25", "0.5", "1", "1.5", "4"},
                    {"0.4", "0.5", "0.6", "0.7", "0.8", "0.9", "0.98"},
                    [method](const std::string &x, const std::string &y) {
                      return Point{{"Coupling/Method=" + method, "Coupling/Penalty ratio=" + x}, std::stod(y)};
                    }});
  std::vector<std::string> weights;
  for (const std::string &method : methods)
    for (const std::string weight : {"linear", "cubic", "constant"})
      weights.push_back(method + " " + weight);
  maps.push_back({"overlap_weight",
                  "Coupling/Overlap width [d]",
                  "method and Coupling/Weight function",
                  {"3", "4", "6", "8", "12"},
                  weights,
                  [](const std::string &x, const std::string &y)
                  {
                    const std::size_t gap = y.find(' ');
                    return Point{joined(method_overrides(y.substr(0, gap)),
                                        {"Coupling/Overlap width=" + x, "Coupling/Weight function=" + y.substr(gap + 1)})};
                  }});
  maps.push_back({"cell_size",
                  "Mesh/Cell size [d]",
                  "Coupling/Method",
                  {"1", "2", "3", "4", "6", "8"},
                  methods,
                  [diameter](const std::string &x, const std::string &y)
                  {
                    std::ostringstream size;
                    size << std::setprecision(12) << std::stod(x) * diameter;
                    return Point{joined(method_overrides(y), {"Mesh/Cell size=" + size.str()})};
                  }});
  maps.push_back(
    {"interface_damping",
     "Coupling/Interface damping",
     "time step / stable step of the sides",
     {"0", "0.05", "0.1", "0.2", "0.5", "1"},
     {"0.6", "0.7", "0.8", "0.9", "0.98"},
     [](const std::string &x, const std::string &y) {
       return Point{joined(method_overrides("penalty_mass_scaled"), {"Coupling/Interface damping=" + x}), std::stod(y)};
     }});
  maps.push_back(
    {"fluctuation_relaxation",
     "Coupling/Fluctuation relaxation",
     "time step / stable step of the sides",
     {"0", "0.01", "0.02", "0.05", "0.1", "0.2", "0.5"},
     {"0.6", "0.7", "0.8", "0.9", "0.98"},
     [](const std::string &x, const std::string &y) {
       return Point{joined(method_overrides("weak_multipliers"), {"Coupling/Fluctuation relaxation=" + x}), std::stod(y)};
     }});
  maps.push_back({"local_damping",
                  "Bond/Local damping",
                  "Coupling/Method",
                  {"0", "0.1", "0.3", "0.6", "0.9"},
                  methods,
                  [](const std::string &x, const std::string &y)
                  { return Point{joined(method_overrides(y), {"Bond/Local damping=" + x})}; }});
  maps.push_back({"impact_speed",
                  "speed / speed of the P wave",
                  "Coupling/Method",
                  {"1e-6", "1e-4", "1e-3", "1e-2", "3e-2", "0.1"},
                  methods,
                  [](const std::string &x, const std::string &y) {
                    return Point{method_overrides(y), 0.8, std::stod(x)};
                  }});
  maps.push_back({"poisson",
                  "Rock/Poisson ratio of the finite elements",
                  "Mesh/Integration and Mesh/Strain",
                  {"0.1", "0.2", "0.3", "0.4", "0.45", "0.49", "0.499"},
                  {"full finite", "selective finite", "one_point finite", "full small", "selective small", "one_point small"},
                  [](const std::string &x, const std::string &y)
                  {
                    const std::size_t gap = y.find(' ');
                    return Point{{"Rock/Poisson ratio=" + x, "Finite elements/Integration=" + y.substr(0, gap),
                                  "Finite elements/Strain=" + y.substr(gap + 1)}};
                  }});
  return maps;
}

struct Outcome
{
  std::string verdict; ///< stable, dissipative, unstable, or refused before the run
  double step = 0.;    ///< [s]
  double limit = 0.;   ///< predicted stable step of sides and overlap [s]
  double energy = 0.;  ///< energy at the end / energy at the start [-]
  double lost = 0.;    ///< energy lost at the interface / energy at the start [-]
  double residual = 0.;
};

class StabilityStudy
{
public:
  StabilityStudy(const RunOptions &options, MPI_Comm comm) : options(options), comm(comm) { rank = rank_of(comm); }

  int execute()
  {
    Console console(rank == 0);
    const std::string directory = options.results_directory();
    Case settings = options.read(overrides_of({}));
    check_results_directory(directory, options.case_directory, options.overwrite);
    if (settings.mode == Mode::fem || settings.mode == Mode::dem)
      settings.mode = Mode::fixed;
    const auto base = set_up_problem(settings, Mode::fixed, console, comm);
    bond = base->settings.bond;
    prepare_results_directory(directory, options.case_directory, options.overwrite, comm);

    const std::string path = directory + "/stability.csv";
    std::ofstream table; // of the first rank
    on_first_rank(comm,
                  [&]
                  {
                    table.open(path);
                    table << "map,x_name,y_name,x,y,verdict,step,predicted_limit,energy_ratio,interface_loss,residual\n";
                    check_written(table, path);
                  });
    const std::vector<Map> maps = make_maps(settings.packing.mean_diameter);
    std::size_t total = 0, done = 0;
    for (const Map &map : maps)
      total += map.x.size() * map.y.size();
    for (const Map &map : maps)
      for (const std::string &y : map.y)
        for (const std::string &x : map.x)
        {
          console.progress(static_cast<double>(done) / static_cast<double>(total), map.name + ": " + x + ", " + y);
          ++done;
          const Outcome outcome = run(map.point(x, y));
          on_first_rank(comm,
                        [&]
                        {
                          table << map.name << ',' << map.x_name << ',' << map.y_name << ',' << x << ',' << y << ','
                                << outcome.verdict << ',' << outcome.step << ',' << outcome.limit << ',' << outcome.energy
                                << ',' << outcome.lost << ',' << outcome.residual << '\n';
                          check_written(table, path);
                        });
        }
    console.finish_progress();
    console.message("stability of " + std::to_string(done) + " settings in " + path + ", maps in " + directory + "/figures");
    return 0;
  }

private:
  /// Overrides of the case that remove tool and damping, which would hide a slow growth.
  std::vector<Override> overrides_of(const std::vector<Override> &more) const
  {
    std::vector<Override> all = options.overrides;
    all.insert(all.end(), {"Tool/Kind=none", "Bond/Local damping=0", "Bond/Damping ratio=0"});
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }

  Outcome run(const Point &point)
  {
    Outcome outcome;
    try
    {
      Case settings = options.read(overrides_of(point.overrides));
      const double damping = settings.bond.damping;
      settings.given_stiffness = true;
      settings.bond = bond;
      settings.bond.damping = damping;
      settings.bond.R_n = settings.bond.R_t = 1e30; // no bond breaks
      settings.time_step = 0.;
      Console silent(false);
      const auto problem = set_up_problem(settings, Mode::fixed, silent, comm);
      outcome.step = point.step * std::min(problem->stable.fem, problem->stable.dem);
      outcome.limit = problem->stable.coupled;
      perturb(*problem, point, outcome);
    }
    catch (const InputError &)
    {
      outcome.verdict = "refused";
    }
    return outcome;
  }

  /// Applies noise to all nodes and particles, which excites every mode, and runs some hundred steps.
  void perturb(Problem &problem, const Point &point, Outcome &outcome)
  {
    constexpr int steps = 600;
    constexpr double grown = 1.05, taken = 0.05; // limits relative to the energy at the start
    CoupledModel model(problem.settings, Mode::fixed, *problem.fem, problem.packing, outcome.step, comm,
                       std::move(problem.constraint));
    const double speed = point.speed * problem.settings.body.material.speed_p();
    const int dim = problem.settings.dim(), n_nodes = problem.fem->mesh().n_nodes();
    Eigen::Matrix3Xd velocity = Eigen::Matrix3Xd::Zero(3, n_nodes);
    for (int i = 0; i < n_nodes; ++i)
      for (int c = 0; c < dim; ++c)
        velocity(c, i) = speed * scattered(3 * i + c);
    problem.fem->set_state(Eigen::Matrix3Xd::Zero(3, n_nodes), velocity);
    try
    {
      model.start();
      dem::Particles particles = model.dem().particles();
      for (int i = 0; i < particles.n; ++i)
        for (int c = 0; c < dim; ++c)
          particles.velocity(c, i) += speed * scattered(3 * (n_nodes + particles.index[i]) + c);
      const EnergyLedger start = model.energies();
      const double before = start.held();
      model.advance(steps);
      const EnergyLedger after = model.energies();
      outcome.energy = after.held() / before;
      outcome.lost = after.interface / before;
      outcome.residual = (after.residual() - start.residual()) / before;
    }
    catch (const UnstableRun &)
    {
      outcome.energy = std::numeric_limits<double>::infinity();
    }
    // An error of the balance also marks an unstable motion whose growth damping conceals.
    if (!(outcome.energy < grown) || !(std::abs(outcome.residual) < taken))
      outcome.verdict = "unstable";
    else
      outcome.verdict = outcome.lost > taken ? "dissipative" : "stable";
  }

  const RunOptions &options;
  MPI_Comm comm;
  int rank = 0;
  dem::BondParameters bond;
};
} // namespace

int study_stability(const RunOptions &options, MPI_Comm comm)
{
  return StabilityStudy(options, comm).execute();
}
} // namespace kerf
