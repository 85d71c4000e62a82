// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/application/commands/commands.h"
#include "coupler/application/output/conversion_log.h"
#include "coupler/application/output/field_output.h"
#include "coupler/application/output/history.h"
#include "coupler/application/output/results_directory.h"
#include "coupler/application/output/run_quality.h"
#include "coupler/application/output/specimen_gauge.h"
#include "coupler/application/output/written.h"
#include "coupler/application/setup/problem.h"
#include "coupler/application/setup/time_step.h"
#include "coupler/base/errors.h"
#include "coupler/base/mpi_helpers.h"

#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <iomanip>
#include <memory>
#include <sstream>

namespace kerf
{
namespace
{
volatile std::sig_atomic_t caught_signal = 0, n_signals = 0;

/// A terminal and mpirun may both send a signal for one Ctrl-C, so that only the third one does not wait for the output.
void remember_signal(int number)
{
  caught_signal = number;
  n_signals = n_signals + 1;
  if (n_signals > 2)
  {
    std::signal(number, SIG_DFL);
    std::raise(number);
  }
}

/// A number with fixed digits, without the sign of a zero.
std::string fixed_text(double value, int digits)
{
  char text[64];
  std::snprintf(text, sizeof text, "%.*f", digits, value);
  return std::string(text).find_first_of("123456789") == std::string::npos && text[0] == '-' ? text + 1 : text;
}

/// Steps left until the next multiple of @p interval after @p step.
std::int64_t steps_to(std::int64_t step, std::int64_t interval)
{
  return interval - step % interval;
}

class Run
{
public:
  Run(const RunOptions &options, MPI_Comm comm)
    : options(options), comm(comm), rank(rank_of(comm)), console(rank == 0), directory(options.results_directory())
  {
  }

  Ending execute()
  {
    // All input errors are found before the results directory is changed.
    const Case settings = options.read();
    check_results_directory(directory, options.case_directory, options.overwrite);
    mode = options.mode.value_or(settings.mode);
    problem = set_up_problem(settings, mode, console, comm);
    open_results();

    std::string failure;
    try
    {
      start();
      loop();
    }
    catch (const UnstableRun &error)
    {
      failure = error.what();
    }
    catch (const std::exception &error) // the disk is full, for example: the log may still take a line
    {
      console.finish_progress();
      console.note("error: " + error_line(error));
      throw;
    }
    return end(failure);
  }

private:
  /// Makes the model and its output.
  void start()
  {
    model = std::make_unique<CoupledModel>(problem->settings, mode, *problem->fem, problem->packing, problem->dt, comm,
                                           std::move(problem->constraint));
    model->start();
    on_first_rank(comm,
                  [&]
                  {
                    for (const ActivationEvent &event : model->events())
                      activations->add(event);
                  });
    if (problem->settings.tool.kind == ToolKind::platens)
      gauge = std::make_unique<SpecimenGauge>(problem->settings, problem->specimen, problem->packing, comm);
    damage = std::make_unique<DamageWatch>(*model, problem->settings.activation.check_interval, comm);
    fields = std::make_unique<FieldOutput>(directory, *model, comm);
    n_steps = number_of_steps(problem->settings.end_time, problem->dt);
    snapshot_interval = std::max<std::int64_t>(1, n_steps / problem->settings.n_snapshots);
    started = MPI_Wtime();
    cpu_started = std::clock();
    write_row();
    write_fields();
  }

  /// Writes what there is in the end. @param failure why the run stopped; empty: it did not
  Ending end(const std::string &failure)
  {
    console.finish_progress();
    if (fields && failure.empty())
      write_fields();
    on_first_rank(comm, [&] { history->flush(); });
    if (started > 0.)
      summary();
    on_first_rank(comm,
                  [&]
                  {
                    for (const char *name : {"history.csv", "log.txt"})
                      if (const std::string path = directory + "/" + name; !std::filesystem::exists(path))
                        throw InputError(path + ": was removed during the run, results are lost");
                  });
    if (failure.empty())
      return {interrupted ? exit_interrupted : 0, directory, ""};
    const std::string text =
      failure + "; output up to step " + std::to_string(model ? model->step() : 0) + " is kept in " + directory;
    console.note("stopped: " + text);
    return {3, directory, text};
  }

  void open_results()
  {
    prepare_results_directory(directory, options.case_directory, options.overwrite, comm);
    console.log_to(rank == 0 ? directory + "/log.txt" : "");
    on_first_rank(comm,
                  [&]
                  {
                    history = std::make_unique<History>(directory);
                    activations = std::make_unique<ConversionLog>(directory, problem->settings.dim() == 2);
                    std::ofstream echo(directory + "/case.prm");
                    check_written(echo << problem->settings.used_parameters, directory + "/case.prm");
                  });
    int n_ranks = 1;
    MPI_Comm_size(comm, &n_ranks);
    const Case &settings = problem->settings;
    std::ostringstream text;
    text << version_text() << "\ncase " << problem->settings.name << ", mode " << name_of(mode) << ", " << n_ranks
         << (n_ranks == 1 ? " rank" : " ranks") << ", results in " << directory << "\n"
         << (mode == Mode::fem ? "" : packing_summary(problem->packing) + "\n" + settings.strength_summary + "\n")
         << problem->fem->mesh().n_cells() << " cells; stable step: finite elements " << problem->stable.fem << " s, particles "
         << problem->stable.dem << " s; time step " << problem->dt << " s";
    console.message(text.str());
  }

  void loop()
  {
    caught_signal = n_signals = 0;
    for (const int number :
         {SIGINT, SIGTERM, SIGUSR1}) // they stay caught until the output is written; mpirun passes on the last
      std::signal(number, remember_signal);
    while (model->step() < n_steps)
    {
      std::int64_t chunk = n_steps - model->step();
      chunk = std::min(chunk, steps_to(model->step(), problem->settings.history_interval));
      chunk = std::min(chunk, steps_to(model->step(), snapshot_interval));
      if (mode == Mode::adaptive)
        chunk = std::min(chunk, steps_to(model->step(), problem->settings.activation.check_interval));
      model->advance(static_cast<int>(std::min<std::int64_t>(chunk, 500)));
      report_leavers();
      damage->look();

      if (mode == Mode::adaptive && model->step() % problem->settings.activation.check_interval == 0)
        if (model->adapt())
        {
          report_event();
          check_conversions();
        }
      if (model->step() % problem->settings.history_interval == 0 || model->step() == n_steps)
        write_row();
      if (model->step() % snapshot_interval == 0)
        write_fields();
      if (gauge && record.fell_below(problem->settings.stop_below))
      {
        console.message("the platens' force has fallen below Time/Stop below of its peak: end of the test");
        break;
      }

      interrupted = caught_signal;
      MPI_Allreduce(MPI_IN_PLACE, &interrupted, 1, MPI_INT, MPI_MAX, comm);
      if (interrupted)
      {
        console.message("interrupted at step " + std::to_string(model->step()) + ", writing what there is");
        if (model->step() % problem->settings.history_interval != 0)
          write_row();
        break;
      }
    }
  }

  void report_event()
  {
    const ActivationEvent &event = model->events().back();
    on_first_rank(comm, [&] { activations->add(event); });
    if (rank != 0)
      return;
    std::ostringstream text;
    text << std::setprecision(4) << "t = " << 1e3 * event.time << " ms: " << std::abs(event.cells)
         << (event.cells < 0 ? " cells returned to the continuum, " : " cells converted, ") << std::abs(event.particles)
         << (event.cells < 0 ? " particles removed" : " particles activated") << "; mass " << event.before.mass << " -> "
         << event.after.mass << " kg, momentum (" << event.before.momentum.head<2>().transpose() << ") -> ("
         << event.after.momentum.head<2>().transpose() << ") N s";
    if (event.bonds_born_broken > 0)
      text << "; " << event.bonds_born_broken << " of " << event.bonds_stored << " bonds born broken";
    console.note(text.str());
  }

  /// Reports the particles that left the domain, which are removed from the run.
  void report_leavers()
  {
    const std::vector<int> &left = model->dem().left_domain();
    if (left.size() == n_left)
      return;
    std::ostringstream text;
    text << std::setprecision(4) << "t = " << 1e3 * model->time() << " ms: particles that left the domain:";
    for (std::size_t k = n_left; k < left.size(); ++k)
      text << ' ' << left[k];
    n_left = left.size();
    console.note(text.str());
  }

  void write_row()
  {
    HistoryRow row;
    row.step = model->step();
    row.time = model->time();
    row.wall_time = MPI_Wtime() - started;
    row.cpu_time = static_cast<double>(std::clock() - cpu_started) / CLOCKS_PER_SEC;
    row.tool_force = model->take_tool_force().mean;
    row.active_particles = model->dem().n_active();
    row.overlap_particles = model->n_overlap_particles();
    row.converted_cells = model->overlap().n_converted();
    row.intact_bonds = model->dem().n_bonds_intact();
    row.broken_bonds = model->dem().n_bonds_broken();
    row.energy = model->energies();
    if (gauge)
    {
      row.specimen = gauge->read(*model, row.tool_force[1]);
      record.add(row.specimen);
    }
    on_first_rank(comm, [&] { history->add(row); });

    check_balance(row);

    std::ostringstream text;
    text << "t " << fixed_text(1e3 * row.time, 3) << " ms, " << row.active_particles << " particles, " << row.converted_cells
         << " cells converted, " << row.broken_bonds << " bonds broken, normal force "
         << fixed_text(1e-3 * row.tool_force[1], 1) << " k" << force_unit();
    console.progress(static_cast<double>(row.step) / static_cast<double>(n_steps), text.str());
  }

  /// Largest amount of energy that may come from nowhere [J]. Theory (10.8). Errors below a hundredth of the elastic energy of
  /// one particle at the tensile strength are ignored, since the energy put in is small at the first contact of the tool.
  double largest_error(const EnergyLedger &energy)
  {
    turnover = std::max(turnover, energy.turnover());
    const double tolerance = problem->settings.energy_tolerance > 0. ? problem->settings.energy_tolerance : 1.;
    const Case &settings = problem->settings;
    const double floor = 0.01 * 0.5 * std::pow(settings.activation.tensile_strength, 2) / settings.body.material.young *
                         std::pow(settings.packing.mean_diameter, settings.dim());
    return tolerance * turnover + floor;
  }

  /// Throws UnstableRun when conversions have created too much energy. The balance counts it as put in, so its residual does
  /// not show it. Theory (10.10).
  void check_conversions()
  {
    const EnergyLedger energy = model->energies();
    if (energy.conversion_gain <= largest_error(energy))
      return;
    const auto gain = [](const ActivationEvent &event) { return event.held_after - event.held_before; };
    const auto &events = model->events();
    const ActivationEvent &worst = *std::max_element(
      events.begin(), events.end(), [&](const ActivationEvent &a, const ActivationEvent &b) { return gain(a) < gain(b); });
    std::ostringstream text;
    text << "conversions created energy before t = " << model->time() << " s: " << energy.conversion_gain << " J against "
         << turnover << " J put in (Time/Energy tolerance = " << problem->settings.energy_tolerance
         << "); most at t = " << worst.time << " s around (" << worst.place[0] << ", " << worst.place[1] << ", "
         << worst.place[2] << ") m: " << gain(worst) << " J in " << std::abs(worst.cells) << " cells";
    throw UnstableRun(text.str());
  }

  /// Throws UnstableRun when the energy balance does not close.
  void check_balance(const HistoryRow &row)
  {
    const EnergyLedger &energy = row.energy;
    if (std::isfinite(energy.residual()) && std::abs(energy.residual()) <= largest_error(energy))
    {
      last_energy = energy;
      return;
    }
    std::ostringstream text;
    text << "the energy balance failed before t = " << row.time << " s: residual " << energy.residual() << " J against "
         << turnover << " J put in (Time/Energy tolerance = " << problem->settings.energy_tolerance << "); "
         << energy.fastest_growing(last_energy);
    throw UnstableRun(text.str());
  }

  void write_fields()
  {
    model->timer().restart();
    fields->write(*model);
    on_first_rank(comm, [&] { history->flush(); });
    model->timer().lap(Part::output);
  }

  void summary()
  {
    const double wall = MPI_Wtime() - started;
    double sum = 0.;
    for (int p = 0; p < n_parts; ++p)
      sum += model->timer().of(static_cast<Part>(p));
    const auto steps = static_cast<double>(std::max<std::int64_t>(1, model->step()));
    std::ostringstream text;
    text << "wall time " << clock_text(wall) << ", " << model->step() << " steps\n";
    for (int p = 0; p < n_parts; ++p)
    {
      const double seconds = model->timer().of(static_cast<Part>(p));
      char line[128];
      std::snprintf(line, sizeof line, "  %-22s %9.2f s %6.1f %% %9.2f us/step\n", part_names[p], seconds,
                    100. * seconds / std::max(sum, 1e-12), 1e6 * seconds / steps);
      text << line;
    }
    std::int64_t born_broken = 0;
    for (const ActivationEvent &event : model->events())
      born_broken += event.bonds_born_broken;
    text << "particles " << model->dem().n_active() << " active, " << model->dem().left_domain().size()
         << " left the domain; bonds " << model->dem().n_bonds_intact() << " intact, " << model->dem().n_bonds_broken()
         << " broken (" << born_broken << " born broken); cells converted " << model->overlap().n_converted();
    if (gauge)
      text << '\n' << specimen_text(problem->specimen, problem->settings.tool.pulls(), record.result(problem->settings.dim()));
    RunFigures figures = damage->figures();
    figures.turnover = turnover;
    const EnergyLedger &energy = figures.energy;
    const std::string unit = problem->settings.dim() == 2 ? " J/m" : " J";
    text << "\nenergy balance: work of tool and boundary " << energy.work() << unit << ", conversions " << energy.conversion
         << unit << " (" << energy.conversion_gain << unit << " created), interface " << energy.interface << unit
         << ", residual " << energy.residual() << unit;
    for (const std::string &warning : warnings(figures))
      text << "\nwarning: " << warning;
    if (history && model->tool().present())
      for (const int axis : {1, 0})
        if (axis == 1 || model->tool().disc())
          text << '\n' << force_text(axis);
    text << "\nresults in " << directory << ": history.csv, fields for ParaView (*.pvd), log.txt; pictures in " << directory
         << "/figures";
    console.message(text.str());
  }

  std::string force_unit() const { return problem->settings.dim() == 2 ? "N/m" : "N"; }

  /// Mean and peak of the tool's force, as in the figures.
  std::string force_text(int axis) const
  {
    const ForceSummary force = summarise_force(history->rows(), axis);
    std::ostringstream text;
    text << std::setprecision(4) << (axis == 1 ? "normal" : "tangential") << " force: mean " << 1e-3 * force.mean << " k"
         << force_unit() << " from " << 1e3 * force.start << " to " << 1e3 * force.end << " ms, peak " << 1e-3 * force.peak
         << " k" << force_unit() << " at " << 1e3 * force.peak_time << " ms";
    return text.str();
  }

  static constexpr int exit_interrupted = 130;
  const RunOptions &options;
  MPI_Comm comm;
  int rank;
  Console console;
  std::string directory;
  std::unique_ptr<Problem> problem;
  std::unique_ptr<CoupledModel> model;
  std::unique_ptr<History> history;
  std::unique_ptr<ConversionLog> activations;
  std::unique_ptr<FieldOutput> fields;
  std::unique_ptr<DamageWatch> damage;
  std::unique_ptr<SpecimenGauge> gauge; // of a specimen between platens
  SpecimenRecord record;
  Mode mode = Mode::adaptive;
  std::int64_t n_steps = 0, snapshot_interval = 1;
  EnergyLedger last_energy; // at the last row
  double started = 0., turnover = 0.;
  std::clock_t cpu_started = 0;
  std::size_t n_left = 0; // number of particles reported by report_leavers()
  int interrupted = 0;
};
} // namespace

std::string RunOptions::results_directory() const
{
  if (!output.empty())
    return output;
  const Case settings = read_case(case_directory, overrides);
  const bool other = mode.value_or(settings.mode) != settings.mode;
  return "results/" + settings.name + (other ? "_" + name_of(*mode) : "");
}

Ending run_case(const RunOptions &options, MPI_Comm comm)
{
  return Run(options, comm).execute();
}
} // namespace kerf
