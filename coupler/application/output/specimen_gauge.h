// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/base/mesh_geometry.h"
#include "coupler/method/coupled_model.h"

#include <functional>
#include <vector>

namespace kerf
{
/// The body that platens load along y.
struct Specimen
{
  enum class Form
  {
    prism, ///< the same cross-section all along y: uniaxial compression or direct tension
    disc,  ///< Brazilian test
    other  ///< no test of a standard
  };
  Form form = Form::prism;
  Box box;                                               ///< around the body [m]
  double section = 0.;                                   ///< area of the cross-section at mid-height [m^2] (2D: its width [m])
  double flat_angle = 0.;                                ///< half angle of the flats of a disc [rad]
  std::function<bool(const Eigen::Vector3d &)> contains; ///< whether a point is inside; empty: the body is its box
};

/// Readings of the press and of the gauges in the middle of a specimen at one time. The sense of the test is positive:
/// compression in a press, tension between platens that pull.
struct SpecimenState
{
  double closing = 0.;        ///< relative displacement of the platens since the start [m]
  double stress = 0.;         ///< force / cross-section; disc: k 2 P/(pi D t), see flattened_disc_factor() [Pa]
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
  SpecimenGauge(const ModelSettings &settings, const Specimen &specimen, const dem::Packing &packing, MPI_Comm comm);

  /// @param force of the rock on the platens [N], positive in compression. Collective.
  SpecimenState read(CoupledModel &model, double force) const;

private:
  double margin(int axis, double share) const;
  bool inside(const Eigen::Vector3d &reference) const;
  void make_window(const Specimen &specimen);
  double window(const Eigen::Vector3d &place) const;
  double virial_stress(const CoupledModel &model) const;

  int dim;
  double sense; // of closing: 1, of pulling: -1
  const dem::Packing &packing;
  MPI_Comm comm;
  Box body;
  double area;            // force / nominal stress [m^2], 2D [m]
  Box window_box;         // the weight of bonds is zero outside
  double window_integral; // over the body [m^3], 2D [m^2]
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

/// The result as one line of text. @param pulls whether the platens pull
std::string specimen_text(const Specimen &specimen, bool pulls, const SpecimenResult &result);
} // namespace kerf
