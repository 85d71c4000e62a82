// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/application/output/specimen_gauge.h"

#include "coupler/base/mpi_helpers.h"
#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <iomanip>
#include <sstream>

namespace kerf
{
using Eigen::Vector3d;

double flattened_disc_factor(double half_angle)
{
  if (half_angle == 0.)
    return 1.;
  const double cosine = std::cos(half_angle), spread = std::sin(half_angle) / half_angle;
  const double tension = std::pow(cosine, 3), compression = tension + cosine + spread; // at the centre, times spread
  return std::pow(tension + compression, 2) / (8. * (compression - tension) * spread);
}

SpecimenGauge::SpecimenGauge(const ModelSettings &settings, const Specimen &specimen, const dem::Packing &packing,
                             MPI_Comm comm)
  : dim(settings.body.dim), sense(settings.tool.pulls() ? -1. : 1.), packing(packing), comm(comm), body(specimen.box),
    area(specimen.section)
{
  if (specimen.form == Specimen::Form::disc)
    area *= 0.5 * M_PI / flattened_disc_factor(specimen.flat_angle);
  make_window(specimen);
}

/// Margin that is left out at either side [m]. It is at least three diameters, where a packing is less dense than inside. The
/// static solution for the elastic moduli leaves out the same margin.
double SpecimenGauge::margin(int axis, double share) const
{
  const double extent = body.upper[axis] - body.lower[axis];
  return std::min(0.3 * extent, std::max(share * extent, 3. * packing.mean_diameter));
}

/// Whether a point is in the middle of the specimen: the middle half along y, without a margin at the free sides.
bool SpecimenGauge::inside(const Vector3d &reference) const
{
  for (int c = 0; c < dim; ++c)
  {
    const double margin = this->margin(c, c == 1 ? 0.25 : 0.1);
    if (reference[c] < body.lower[c] + margin || reference[c] > body.upper[c] - margin)
      return false;
  }
  return true;
}

/// The weight decreases to zero over a quarter of the width at the borders, so the stress depends little on bonds that cross
/// them.
void SpecimenGauge::make_window(const Specimen &specimen)
{
  window_box = body;
  window_integral = 1.;
  for (int c = 0; c < dim; ++c)
  {
    const double margin = this->margin(c, c == 1 ? 0.2 : 0.08);
    window_box.lower[c] += margin;
    window_box.upper[c] -= margin;
    window_integral *= 0.75 * (window_box.upper[c] - window_box.lower[c]);
  }
  if (!specimen.contains)
    return;
  // Of a body that does not fill its box, the part of the window that is inside, by the midpoints of equal cells.
  const int n = dim == 2 ? 200 : 50;
  double inside = 0., all = 0.;
  for (int z = 0; z < (dim == 3 ? n : 1); ++z)
    for (int y = 0; y < n; ++y)
      for (int x = 0; x < n; ++x)
      {
        const Vector3d share((x + 0.5) / n, (y + 0.5) / n, dim == 3 ? (z + 0.5) / n : 0.);
        const Vector3d place = window_box.lower + share.cwiseProduct(window_box.upper - window_box.lower);
        const double weight = window(place);
        all += weight;
        inside += specimen.contains(place) ? weight : 0.;
      }
  window_integral *= inside / all;
}

double SpecimenGauge::window(const Vector3d &place) const
{
  double value = 1.;
  for (int c = 0; c < dim; ++c)
    value *= std::clamp(std::min(place[c] - window_box.lower[c], window_box.upper[c] - place[c]) /
                          (0.25 * (window_box.upper[c] - window_box.lower[c])),
                        0., 1.);
  return value;
}

/// Weighted mean of f (x) l over the middle of the specimen.
double SpecimenGauge::virial_stress(const CoupledModel &model) const
{
  double sum = 0.;
  for (const dem::ActiveBond &bond : model.dem().bonds())
    if (const double weight = window(0.5 * (bond.a + bond.b)); weight > 0.)
      sum += weight * bond.force[1] * (bond.b[1] - bond.a[1]);
  MPI_Allreduce(MPI_IN_PLACE, &sum, 1, MPI_DOUBLE, MPI_SUM, comm);
  return -sense * sum / window_integral;
}

SpecimenState SpecimenGauge::read(CoupledModel &model, double force) const
{
  SpecimenState state;
  const std::array<double, 2> platens = model.tool().platens();
  state.closing = sense * (body.upper[1] - body.lower[1] - (platens[1] - platens[0]));
  state.stress = sense * force / area;
  state.middle_stress = model.fem().n_active_cells() > 0 ? state.stress : virial_stress(model);
  state.broken_bonds = model.dem().n_bonds_broken();

  // Weighted least squares of u = c + G (X - X_middle): 4 x 4 normal matrix, one right-hand side for each component.
  Eigen::Matrix<double, 4, 4> normal = Eigen::Matrix<double, 4, 4>::Zero();
  Eigen::Matrix<double, 4, 3> right = Eigen::Matrix<double, 4, 3>::Zero();
  const Vector3d middle = 0.5 * (body.lower + body.upper), scale = body.upper - body.lower;
  const auto add = [&](const Vector3d &reference, const Vector3d &displacement, double mass)
  {
    if (!(mass > 0.) || !inside(reference))
      return;
    Eigen::Vector4d row(1., 0., 0., 0.);
    for (int c = 0; c < dim; ++c)
      row[1 + c] = (reference[c] - middle[c]) / scale[c];
    normal += mass * row * row.transpose();
    right += mass * row * displacement.transpose();
  };
  const dem::Particles particles = model.dem().particles();
  for (int i = 0; i < particles.n; ++i)
  {
    const Vector3d reference = packing.positions.col(particles.index[i]);
    add(reference, particles.position.col(i) - reference, particles.mass[i]);
  }
  if (model.fem().n_active_cells() > 0)
  {
    const Eigen::Matrix3Xd displacement = model.fem().gather(fem::NodalField::displacement);
    const Eigen::Matrix3Xd mass = model.fem().gather(fem::NodalField::mass);
    const int rank = rank_of(comm);
    if (rank == 0) // gathered fields contain all nodes
      for (int n = 0; n < model.fem().mesh().n_nodes(); ++n)
        add(model.fem().mesh().nodes.col(n), displacement.col(n), mass(0, n));
  }
  MPI_Allreduce(MPI_IN_PLACE, normal.data(), 16, MPI_DOUBLE, MPI_SUM, comm);
  MPI_Allreduce(MPI_IN_PLACE, right.data(), 12, MPI_DOUBLE, MPI_SUM, comm);
  const Eigen::Matrix<double, Eigen::Dynamic, 3> fit =
    normal.topLeftCorner(dim + 1, dim + 1).ldlt().solve(right.topRows(dim + 1));
  state.axial_strain = -sense * fit(2, 1) / scale[1];
  state.lateral_strain = sense * (dim == 2 ? fit(1, 0) / scale[0] : 0.5 * (fit(1, 0) / scale[0] + fit(3, 2) / scale[2]));
  return state;
}

bool SpecimenRecord::fell_below(double fraction) const
{
  if (fraction <= 0.)
    return false; // halves that swing back change the sign of the stress
  double peak = 0.;
  for (const SpecimenState &state : states)
    peak = std::max(peak, state.stress);
  return !states.empty() && states.back().broken_bonds > 0 && states.back().stress < fraction * peak;
}

SpecimenResult SpecimenRecord::result(int dim) const
{
  SpecimenResult result;
  std::size_t at_peak = 0;
  for (std::size_t k = 0; k < states.size(); ++k)
    if (states[k].stress > states[at_peak].stress)
      at_peak = k;
  if (states.empty() || !(states[at_peak].stress > 0.))
    return result;
  result.strength = states[at_peak].stress;
  result.peak_strain = states[at_peak].axial_strain;
  result.peak_passed = std::any_of(states.begin() + at_peak, states.end(),
                                   [&](const SpecimenState &s) { return s.stress < 0.9 * result.strength; });

  // Linear regression in the loading part: stress and lateral strain over axial strain.
  double n = 0., x = 0., xx = 0., broken = 0.;
  Eigen::Vector3d y = Eigen::Vector3d::Zero(), xy = Eigen::Vector3d::Zero(); // nominal stress, middle stress, lateral strain
  for (std::size_t k = 0; k < at_peak; ++k)
  {
    const SpecimenState &s = states[k];
    if (s.stress > 0.7 * result.strength)
      break;
    broken = static_cast<double>(s.broken_bonds);
    if (s.stress < 0.2 * result.strength || s.stress > 0.5 * result.strength)
      continue;
    n += 1.;
    x += s.axial_strain, xx += s.axial_strain * s.axial_strain;
    const Eigen::Vector3d values(s.middle_stress, s.stress, s.lateral_strain);
    y += values, xy += s.axial_strain * values;
  }
  result.linear_broken = broken / std::max(1., static_cast<double>(states.back().broken_bonds));
  const double spread = n * xx - x * x;
  if (n < 2. || !(spread > 0.))
    return result;
  const Eigen::Vector3d slopes = (n * xy - x * y) / spread;
  const double ratio = slopes[2];
  // Plane strain: modulus = E/(1 - nu^2), lateral/axial = nu/(1 - nu).
  result.poisson = dim == 2 ? ratio / (1. + ratio) : ratio;
  const double from_plane_strain = dim == 2 ? 1. - result.poisson * result.poisson : 1.;
  result.young = slopes[0] * from_plane_strain;
  result.nominal_young = slopes[1] * from_plane_strain;
  return result;
}

std::string specimen_text(const Specimen &specimen, bool pulls, const SpecimenResult &result)
{
  std::ostringstream text;
  text << std::setprecision(4);
  if (specimen.form == Specimen::Form::other)
    text << "body between platens, no prism and no disc of Mesh/Shape: " << result.strength / 1e6
         << " MPa at the peak by force and cross-section at mid-height, " << specimen.section
         << "; this is no strength of the rock";
  else if (specimen.form == Specimen::Form::disc)
    text << "Brazilian test: k 2 P/(pi D t) = " << result.strength / 1e6
         << " MPa at the peak, k = " << flattened_disc_factor(specimen.flat_angle) << " for its flats";
  else
    text << (pulls ? "direct tension" : "uniaxial compression") << ": E = " << result.young / 1e9 << " GPa in the middle, "
         << result.nominal_young / 1e9 << " GPa by force and cross-section, nu = " << result.poisson << ", peak "
         << result.strength / 1e6 << " MPa at a strain of " << result.peak_strain;
  text << "; " << 100. * result.linear_broken << " % of the broken bonds broke before 70 % of the peak"
       << (result.peak_passed ? "" : "; the peak is not passed yet");
  return text.str();
}
} // namespace kerf
