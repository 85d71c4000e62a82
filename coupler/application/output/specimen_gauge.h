// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/base/mesh_geometry.h"
#include "coupler/method/coupled_model.h"

#include <vector>

namespace kerf
{
/// Readings of the press and of the gauges in the middle of a specimen at one time. The sense of the test is positive:
/// compression in a press, tension between platens that pull.
struct SpecimenState
{
  double closing = 0.;        ///< relative displacement of the platens since the start [m]
  double stress = 0.;         ///< box: force / cross-section; disc: k 2 P/(pi D t), see flattened_disc_factor() [Pa]
  double middle_stress = 0.;  ///< stress along y in the middle of a body of particles, by the virial of its bonds [Pa]
  double axial_strain = 0.;   ///< shortening (pulled: lengthening) along y of the middle [-]
  double lateral_strain = 0.; ///< expansion (pulled: contraction) across y, mean of x and z in three dimensions [-]
  std::int64_t broken_bonds = 0;
};

/// Measures a loaded specimen. The nominal stress is the force of the platens over the area. Strains follow from a
/// least-squares linear fit of the displacements of particles and nodes in the middle half of the body, away from the contact
/// layer and the end friction of the platens. The middle stress differs from the nominal stress when the packing is less dense
/// at a free side than inside.
class SpecimenGauge
{
public:
  SpecimenGauge(const ModelSettings &settings, const fem::Mesh &mesh, const dem::Packing &packing, MPI_Comm comm);

  /// @param force of the rock on the platens [N], positive in compression. Collective.
  SpecimenState read(CoupledModel &model, double force) const;

private:
  double margin(int axis, double share) const;
  bool inside(const Eigen::Vector3d &reference) const;
  double virial_stress(const CoupledModel &model) const;

  int dim;
  double sense; // of closing: 1, of pulling: -1
  const dem::Packing &packing;
  MPI_Comm comm;
  Box body;
  double area; // force / nominal stress [m^2], 2D [m]
};

/// Results of a test in a press.
struct SpecimenResult
{
  double strength = 0.; ///< largest nominal stress: UCS or direct tensile strength of a box, Brazilian strength of a disc [Pa]
  double peak_strain = 0.; ///< axial strain of the middle at that time [-]
  double young = 0.; ///< Young's modulus of the middle: slope between 20 % and 50 % of the peak, for plane strain in 2D [Pa]
  double nominal_young = 0.; ///< Young's modulus by the nominal stress [Pa]
  double poisson = 0.;       ///< Poisson's ratio from the same part of the curve [-]; box only
  double linear_broken = 0.; ///< fraction of the broken bonds that broke before 70 % of the peak [-]
  bool peak_passed = false;  ///< the stress has fallen below 0.9 of the peak
};

/// Factor k of a flattened Brazilian disc, whose tensile strength is k 2 P/(pi D t): Griffith's equivalent stress at its centre
/// over 2 P/(pi D t) (Wang, Jia, Kou, Zhang & Lindqvist 2004). @param half_angle of the flats, seen from the centre [rad]; 0:
/// k = 1. Theory (11.15).
double flattened_disc_factor(double half_angle);

/// Whether the test is a Brazilian test, which splits a disc. Any other body is compressed.
bool is_brazilian(const ModelSettings &settings);

/// The record of one test.
class SpecimenRecord
{
public:
  void add(const SpecimenState &state) { states.push_back(state); }
  /// Whether bonds have broken and the stress is below @p fraction of its peak. Zero: never.
  bool fell_below(double fraction) const;
  SpecimenResult result(int dim) const;

private:
  std::vector<SpecimenState> states;
};

/// The result as one line of text.
std::string specimen_text(const ModelSettings &settings, const SpecimenResult &result);
} // namespace kerf
