// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/application/calibration/calibrate_case.h"
#include "coupler/application/calibration/ratio_search.h"

#include "coupler/application/output/specimen_gauge.h"
#include "coupler/application/setup/problem.h"
#include "coupler/base/errors.h"
#include "coupler/base/mpi_helpers.h"

#include <cmath>
#include <filesystem>
#include <iomanip>
#include <limits>
#include <sstream>

namespace kerf
{
namespace
{
/// Half angle of the flats of discs in the Brazilian test. On a round disc a platen touches a single particle. On narrow flats
/// the rock below is crushed before the disc splits. From this angle on the cracks start along the loaded diameter.
constexpr double flat_angle = 15. * M_PI / 180.;

enum class Test
{
  compression,
  tension,  ///< direct, of the specimens of the compression
  brazilian ///< flattened disc
};
constexpr int n_tests = 3;

/// Longest duration of a test, relative to the loading time up to the target strength. A disc deforms strongly under the flats,
/// most of all in three dimensions.
double longest(Test test)
{
  return test == Test::brazilian ? 10. : 4.;
}

/// Results of the tests on all packings for one set of bond strengths.
struct Attempt
{
  dem::BondParameters bond;
  Measured compressive, tensile, brazilian, young, poisson;
  bool complete = true; ///< every test passed its peak

  double ratio() const { return compressive.mean / tensile.mean; }
};

/// Specimens of the case's rock, tested in the press of `kerf run` in mode dem.
class Press
{
public:
  Press(const Case &rock, MPI_Comm comm) : rock(rock), comm(comm)
  {
    rank = rank_of(comm);
    MPI_Comm_size(comm, &n_ranks);
  }

  /// Runs all tests, which are distributed over the ranks. Collective.
  Attempt test(const dem::BondParameters &bond)
  {
    const int n = rock.calibration.n_packings;
    // One column for each packing. Rows: UCS, tensile and Brazilian strength, E, nu, tests that did not pass their peak.
    Eigen::MatrixXd values = Eigen::MatrixXd::Zero(6, n);
    make_packings(bond);
    std::string error;
    try
    {
      for (int job = rank; job < n_tests * n; job += n_ranks)
      {
        const auto kind = static_cast<Test>(job / n);
        const int packing = job % n;
        const SpecimenResult result = run(specimen(packing, kind, bond), kind);
        values(job / n, packing) = result.strength;
        if (kind == Test::compression)
          values.block<2, 1>(3, packing) << result.young, result.poisson;
        values(5, packing) += !result.peak_passed;
      }
    }
    catch (const std::exception &exception)
    {
      error = error_line(exception);
    }
    share_error(error);
    MPI_Allreduce(MPI_IN_PLACE, values.data(), static_cast<int>(values.size()), MPI_DOUBLE, MPI_SUM, comm);

    Attempt attempt;
    attempt.bond = bond;
    attempt.complete = values.row(5).sum() == 0.;
    const auto mean = [&](int row)
    {
      const double value = values.row(row).mean();
      return Measured{value, n > 1 ? std::sqrt((values.row(row).array() - value).square().sum() / (n - 1)) : 0.};
    };
    attempt.compressive = mean(0);
    attempt.tensile = mean(1);
    attempt.brazilian = mean(2);
    attempt.young = mean(3);
    attempt.poisson = mean(4);
    return attempt;
  }

private:
  /// Case of one specimen. @param packing number of the specimen; its seed differs from that of the case's own store. The
  /// stiffnesses of a compressed specimen follow from its own elastic calibration. A disc is too small for this calibration and
  /// uses those of @p bond; strengths do not depend on them.
  Case specimen(int packing, Test test, const dem::BondParameters &bond) const
  {
    const bool brazilian = test == Test::brazilian;
    Case result = rock;
    const double d = rock.packing.mean_diameter, width = rock.calibration.specimen_width;
    result.body.mesh = fem::MeshSettings();
    result.body.mesh.shape = brazilian ? fem::MeshShape::disc : fem::MeshShape::box;
    result.body.mesh.cell_size = std::max(4. * d, 0.1 * width);
    result.body.mesh.flat_angle = flat_angle;
    result.body.mesh.upper =
      brazilian ? Eigen::Vector3d(1.25 * width, 1.25 * width, width) : Eigen::Vector3d(width, 2. * width, width);
    if (rock.dim() == 2)
      result.body.mesh.upper[2] = 0.;
    result.body.boundary_conditions.clear();
    result.packing.seed = rock.packing.seed + 1 + packing;
    const std::string folder = rock.directory + "/specimens";
    std::filesystem::create_directories(folder);
    std::ostringstream name;
    name << folder << (brazilian ? "/disc_" : "/box_") << rock.packing.kind << '_' << rock.dim() << "d_" << std::lround(1e6 * d)
         << "um_" << std::lround(width / d) << "d_seed" << result.packing.seed << ".h5";
    result.packing_file = name.str();
    result.given_stiffness = brazilian;
    result.bond = bond;

    // The target strain is reached after the prescribed duration. The ends of a disc deform by several times its mean strain.
    // A bar in tension fails suddenly, so it takes no longer than its loading.
    const double speed_p = rock.body.material.speed_p();
    const double duration = rock.calibration.transits * result.body.mesh.upper[1] / speed_p;
    const double stress = test == Test::compression ? rock.activation.compressive_strength
                          : test == Test::tension   ? -rock.activation.tensile_strength
                                                    : 5. * rock.activation.tensile_strength;
    const double strain = stress / rock.body.material.young;
    result.tool = ToolSettings();
    result.tool.kind = ToolKind::platens;
    result.tool.closing_speed = strain * result.body.mesh.upper[1] / duration;
    result.tool.smoothing_time = 0.1 * duration;
    result.tool.damping = 0.1;
    result.end_time = longest(test) * duration;
    result.time_step = 0.;
    result.stop_below = brazilian ? 0.35 : 0.6; // contacts below the platens may fail before the disc does
    return result;
  }

  /// Generates and calibrates the packings that are missing, shared by the ranks: two tests use a box. Collective.
  void make_packings(const dem::BondParameters &bond) const
  {
    std::string error;
    try
    {
      for (int job = rank; job < 2 * rock.calibration.n_packings; job += n_ranks)
      {
        const Case settings = specimen(job / 2, job % 2 == 0 ? Test::compression : Test::brazilian, bond);
        Console silent(false);
        dem::Packing packing;
        build_packing(settings, *build_fem(settings, MPI_COMM_SELF), packing, StoreUse::recalibrated, silent, MPI_COMM_SELF);
      }
    }
    catch (const std::exception &exception)
    {
      error = error_line(exception);
    }
    share_error(error);
  }

  /// Throws the error of any rank on all of them. Collective.
  void share_error(const std::string &error) const
  {
    int failed = !error.empty();
    MPI_Allreduce(MPI_IN_PLACE, &failed, 1, MPI_INT, MPI_SUM, comm);
    if (failed)
      throw InputError(error.empty() ? "calibration: a test failed on another rank" : error);
  }

  SpecimenResult run(const Case &settings, Test test) const
  {
    Console silent(false);
    const auto problem = set_up_problem(settings, Mode::dem, silent, MPI_COMM_SELF);
    CoupledModel model(problem->settings, Mode::dem, *problem->fem, problem->packing, problem->dt, MPI_COMM_SELF);
    model.start();
    const SpecimenGauge gauge(problem->settings, problem->specimen, problem->packing, MPI_COMM_SELF);
    SpecimenRecord record;
    const int interval = std::max(1, static_cast<int>(settings.end_time / (200. * longest(test)) / problem->dt));
    while (model.time() < settings.end_time && !record.fell_below(settings.stop_below))
    {
      model.advance(interval);
      record.add(gauge.read(model, model.take_tool_force().mean[1]));
    }
    return record.result(settings.dim());
  }

  const Case &rock;
  MPI_Comm comm;
  int rank = 0, n_ranks = 1;
};

/// Both strengths are proportional to R_n at constant R_t/R_n, since bonds are linear up to failure. Their ratio UCS/BTS
/// depends on R_t/R_n only.
class StrengthSearch
{
public:
  StrengthSearch(const Case &rock, Press &press, Console &console) : rock(rock), press(press), console(console) {}

  Attempt find(dem::BondParameters bond)
  {
    const double target = rock.activation.compressive_strength / rock.activation.tensile_strength;
    constexpr double tolerance = 0.02, accepted = 0.05;
    const double d = rock.packing.mean_diameter;
    bond.R_n = 2. * rock.activation.tensile_strength * (rock.dim() == 2 ? d : d * d);
    double q = 1.5; // R_t/R_n
    RatioSearch ratios;
    Attempt best;
    double best_error = std::numeric_limits<double>::max();
    for (int iteration = 0; iteration < 12; ++iteration)
    {
      bond.R_t = q * bond.R_n;
      const Attempt attempt = evaluate(bond);
      const double error = worst_error(attempt);
      if (attempt.complete && error < best_error)
      {
        best = attempt;
        best_error = error;
      }
      if (attempt.complete && error < tolerance)
        break;
      bond.R_n *= std::sqrt(rock.activation.tensile_strength / attempt.tensile.mean * rock.activation.compressive_strength /
                            attempt.compressive.mean);
      const double off = std::log(attempt.ratio() / target);
      // Strains and the contact area of the platens grow with the strengths, which changes the ratio slightly. So the magnitude
      // is adjusted first.
      if (std::abs(off) < 0.5 * tolerance || (iteration == 0 && error > 0.1))
        continue;
      ratios.add(q, off);
      q = ratios.next();
      if (q == 0. && (ratios.bracketed() || best_error < accepted))
        break;
      if (q == 0.)
        throw InputError(rock.directory + "/case.prm: Rock/Compressive strength / Tensile strength = " + text(target) +
                         " is out of reach, the packings give " + text(attempt.ratio()) +
                         " at R_t/R_n = " + text(attempt.bond.R_t / attempt.bond.R_n) +
                         (off < 0. ? "; a larger Packing/Gap tolerance, Bond/Friction or Bond/Shear strength friction raises it"
                                   : "; a smaller Packing/Gap tolerance lowers it"));
    }
    if (best_error > accepted)
      throw InputError(rock.directory + "/case.prm: the strength calibration has not converged, best error " +
                       text(100. * best_error) + " %; use more Calibration/Packings or a larger Calibration/Specimen width");
    return best;
  }

private:
  static std::string text(double value)
  {
    std::ostringstream stream;
    stream << std::setprecision(4) << value;
    return stream.str();
  }
  double worst_error(const Attempt &attempt) const
  {
    return std::max(std::abs(attempt.tensile.mean / rock.activation.tensile_strength - 1.),
                    std::abs(attempt.compressive.mean / rock.activation.compressive_strength - 1.));
  }
  Attempt evaluate(const dem::BondParameters &bond)
  {
    const Attempt attempt = press.test(bond);
    std::ostringstream line;
    line << std::setprecision(4) << "R_n = " << bond.R_n << ", R_t/R_n = " << bond.R_t / bond.R_n << ": uniaxial "
         << attempt.compressive.mean / 1e6 << " +- " << attempt.compressive.scatter / 1e6 << " MPa, direct tension "
         << attempt.tensile.mean / 1e6 << " +- " << attempt.tensile.scatter / 1e6 << " MPa, Brazilian "
         << attempt.brazilian.mean / 1e6 << " +- " << attempt.brazilian.scatter / 1e6 << " MPa, ratio " << attempt.ratio()
         << (attempt.complete ? "" : " (not all tests passed their peak)");
    console.message(line.str());
    return attempt;
  }

  const Case &rock;
  Press &press;
  Console &console;
};

std::string report(const Case &rock, const Attempt &found)
{
  std::ostringstream text;
  text << std::setprecision(4) << "calibrated with " << rock.calibration.n_packings << " packings, mean +- standard deviation\n"
       << "  k_n = " << found.bond.k_n << ", k_t = " << found.bond.k_t << " N/m, R_n = " << found.bond.R_n
       << ", R_t = " << found.bond.R_t << " N" << (rock.dim() == 2 ? "/m" : "") << ", shear strength friction "
       << found.bond.shear_friction << ", friction " << found.bond.friction << '\n';
  const auto line = [&](const char *name, double target, const Measured &value, double unit, const char *unit_name)
  {
    text << "  " << std::left << std::setw(22) << name << " target " << std::setw(7) << target / unit << " reached "
         << value.mean / unit << " +- " << value.scatter / unit << ' ' << unit_name << '\n';
  };
  line("E of the specimens", rock.body.material.young, found.young, 1e9, "GPa");
  line("nu of the specimens", rock.body.material.poisson, found.poisson, 1., "");
  line("uniaxial compression", rock.activation.compressive_strength, found.compressive, 1e6, "MPa");
  line("direct tension", rock.activation.tensile_strength, found.tensile, 1e6, "MPa");
  text << "  Brazilian strength " << found.brazilian.mean / 1e6 << " +- " << found.brazilian.scatter / 1e6 << " MPa\n";
  return text.str();
}
} // namespace

int calibrate_case(const RunOptions &options, MPI_Comm comm)
{
  const int rank = rank_of(comm);
  Console console(rank == 0);
  std::vector<Override> overrides = options.overrides;
  overrides.push_back("Bond/Strength=given"); // the strengths are searched here
  const Case settings = options.read(overrides);
  const std::unique_ptr<fem::FemSide> fem = build_fem(settings, comm);
  dem::Packing store;
  build_packing(settings, *fem, store, StoreUse::recalibrated, console, comm);
  console.message(packing_summary(store));

  Press press(settings, comm);
  dem::BondParameters bond = settings.bond;
  bond.k_n = store.calibration.k_n;
  bond.k_t = store.calibration.k_t;
  const Attempt found = StrengthSearch(settings, press, console).find(bond);

  Strengths strengths = strengths_wanted(settings);
  strengths.bond = found.bond;
  strengths.n_packings = settings.calibration.n_packings;
  strengths.tensile = found.tensile;
  strengths.compressive = found.compressive;
  strengths.brazilian = found.brazilian;
  strengths.specimen_young = found.young;
  strengths.specimen_poisson = found.poisson;
  on_first_rank(comm, [&] { save_strengths(strengths, settings.directory); });
  console.message(report(settings, found) + "written into " + strengths_file(settings.directory) +
                  "; used with Bond/Strength = calibrated");
  return 0;
}
} // namespace kerf
