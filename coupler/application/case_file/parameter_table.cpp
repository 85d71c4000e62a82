// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/application/case_file/parameter_table.h"

#include "coupler/method/constraint/make_constraint.h"

#include <sstream>

namespace kerf
{
namespace
{
namespace P = dealii::Patterns;

/// A pattern and its description.
struct Allowed
{
  std::shared_ptr<P::PatternBase> pattern;
  std::string text;
};

constexpr double tiny = 1e-300, huge = 1e300;

std::string number_text(double value)
{
  std::ostringstream text;
  text << value;
  return text.str();
}

Allowed number()
{
  return {std::make_shared<P::Double>(), "a number"};
}
Allowed positive()
{
  return {std::make_shared<P::Double>(tiny, huge), "a number > 0"};
}
Allowed not_negative()
{
  return {std::make_shared<P::Double>(0., huge), "a number >= 0"};
}
Allowed between(double lower, double upper)
{
  return {std::make_shared<P::Double>(lower, upper), "a number in [" + number_text(lower) + ", " + number_text(upper) + "]"};
}
Allowed whole_number(int lower, int upper)
{
  return {std::make_shared<P::Integer>(lower, upper),
          "a whole number in [" + std::to_string(lower) + ", " + std::to_string(upper) + "]"};
}
Allowed one_of(const std::string &choices)
{
  std::string text = "one of " + choices;
  for (std::size_t bar = text.find('|'); bar != std::string::npos; bar = text.find('|'))
    text.replace(bar, 1, ", ");
  return {std::make_shared<P::Selection>(choices), text};
}
Allowed flag()
{
  return {std::make_shared<P::Bool>(), "true or false"};
}
Allowed text()
{
  return {std::make_shared<P::Anything>(), "text"};
}
Allowed point()
{
  return {std::make_shared<P::List>(P::Double(), 2, 3, ","), "2 or 3 numbers separated by commas"};
}

std::string names_of_constraint_methods()
{
  std::string names;
  for (const ConstraintMethod &method : constraint_methods())
    names += (names.empty() ? "" : "|") + method.name;
  return names;
}

Parameter entry(const std::string &section, const std::string &key, const std::string &default_value, const Allowed &allowed,
                const std::string &unit, const std::string &meaning, const std::string &source)
{
  return {section, key, default_value, allowed.pattern, allowed.text, unit, meaning, source};
}
} // namespace

const std::vector<Parameter> &parameter_table()
{
  static const std::vector<Parameter> table = {
    entry("Run", "Mode", "adaptive", one_of("adaptive|fixed|dem|fem"), "-", "mode of `kerf run`; --mode overrides it", ""),

    entry("Rock", "Density", "2650", positive(), "kg/m^3", "density of the rock", ""),
    entry("Rock", "Young modulus", "40e9", positive(), "Pa",
          "Young's modulus of the finite elements and, by calibration, of the packing", ""),
    entry("Rock", "Poisson ratio", "0.2", between(0., 0.499), "-", "Poisson's ratio, plane strain in 2D", ""),
    entry("Rock", "Tensile strength", "10e6", positive(), "Pa",
          "f_t, target of `kerf calibrate` (direct tension); used by the Mohr-Coulomb and Drucker-Prager criteria and for "
          "sigma*, unless Bond/Strength = calibrated: then they take the measured strength",
          ""),
    entry(
      "Rock", "Compressive strength", "100e6", positive(), "Pa",
      "f_c, target of `kerf calibrate` (uniaxial compression); used by the Mohr-Coulomb and Drucker-Prager criteria, unless "
      "Bond/Strength = calibrated: then they take the measured strength",
      ""),

    entry("Mesh", "Dimension", "2", whole_number(2, 3), "-", "2: plane strain, per metre of thickness; 3: y is up", ""),
    entry("Mesh", "File", "", text(), "-", "gmsh .msh file of quadrilaterals or hexahedra; empty: the mesh is made by Shape",
          ""),
    entry("Mesh", "Shape", "box", one_of("box|disc"), "-",
          "structured box between the corners, or the disc inscribed in it (3D: a cylinder along z)", ""),
    entry("Mesh", "Flat angle", "0", between(0., 30.), "degrees",
          "half angle of the flats at the top and bottom of a disc, where the platens act (flattened Brazilian disc)", ""),
    entry("Mesh", "Lower corner", "0, 0", point(), "m", "corner of the structured box", ""),
    entry("Mesh", "Upper corner", "0.1, 0.05", point(), "m", "opposite corner of the structured box", ""),
    entry("Mesh", "Cell size", "4e-3", positive(), "m", "cell size of the structured box, in the fine zone if there is one",
          ""),
    entry("Mesh", "Periodic", "none", one_of("none|y|z|yz"), "-",
          "axes along which rock and packing are periodic. Opposite sides of the box are connected and are no boundary, for "
          "example in a strip that represents an infinite body",
          ""),
    entry("Mesh", "Fine zone lower corner", "0, 0", point(), "m", "corner of the fine zone; equal corners: uniform mesh", ""),
    entry("Mesh", "Fine zone upper corner", "0, 0", point(), "m", "opposite corner of the fine zone", ""),
    entry("Mesh", "Growth ratio", "1.2", between(1., 3.), "-", "ratio of neighbouring cell sizes outside the fine zone", ""),
    entry("Mesh", "Largest cell size", "0", not_negative(), "m", "upper bound of the graded cell size; 0: none", ""),

    entry("Mesh", "Refine", "", text(), "m",
          "local refinement: boxes 'x0 y0 x1 y1 n' (3D: 'x0 y0 z0 x1 y1 z1 n') separated by ';'. Cells that "
          "intersect a box are halved n times; the transition to coarser cells has hanging nodes",
          ""),

    entry("Finite elements", "Strain", "finite", one_of("finite|small"), "-",
          "finite: Green's strain, for any rotation; small: linear strain, cheaper, for rotations and strains far below one",
          "St. Venant-Kirchhoff; Hooke"),
    entry("Finite elements", "Integration", "full", one_of("full|selective|one_point"), "-",
          "full: all Gauss points; selective: all Gauss points with the mean volumetric strain of the cell (B-bar), for nearly "
          "incompressible rock; one_point: mean gradient with elastic hourglass control, the cheapest, accurate in bending",
          "Hughes 1980; Flanagan & Belytschko 1981, Belytschko & Bindeman 1993"),

    entry(
      "Boundary", "Conditions", "left: roller; right: roller; bottom: fixed", text(), "-",
      "list 'where: kind' separated by ';'. where: number of a boundary, or left, right, bottom, top (3D: back, front) of the "
      "box, or an expression of x, y, z [m] for the centres of faces, such as y < 1e-6 && x > 0.1. kind: free, fixed, roller, "
      "absorbing, in_situ (the traction that holds Loads/Initial stress), velocity VX VY [VZ] ramp T [m/s, s], traction TX TY "
      "[TZ] ramp T [Pa, s]. The conditions act on particles at the boundary as well",
      "absorbing: Lysmer & Kuhlemeyer 1969"),

    entry("Loads", "Gravity", "0, 0", point(), "m/s^2", "acceleration of gravity, on the whole rock", ""),
    entry("Loads", "Gravity ramp", "0", not_negative(), "s",
          "gravity increases to its value over a half cosine of this duration", ""),
    entry("Loads", "Initial stress", "", text(), "Pa",
          "in-situ stress 'xx yy xy' (3D: 'xx yy zz yz xz xy'), tension positive: both models start with the homogeneous "
          "deformation of this stress. Sides of kind in_situ, absorbing, fixed and roller support it. Empty: none",
          ""),

    entry("Packing", "File", "", text(), "-",
          "HDF5 store of the particles; empty: packing_KIND_DIAMETER_SEED.h5 in the case directory. It is generated if missing",
          ""),
    entry("Packing", "Kind", "random", one_of("random|triangular|fcc|hcp"), "-",
          "dense random packing, or a lattice: triangular in 2D, fcc or hcp in 3D", ""),
    entry("Packing", "Surface", "", text(), "-",
          "3D: STL file (ASCII or binary) of a closed surface inside the mesh; the packing fills it. Empty: the whole mesh",
          ""),
    entry("Packing", "Mean diameter", "1e-3", positive(), "m", "mean particle diameter d", ""),
    entry("Packing", "Radius spread", "0.4", between(0., 0.8), "-", "radii are uniform in (1 - s, 1 + s) d/2", ""),
    entry("Packing", "Gap tolerance", "0.1", between(0., 1.), "-", "pairs with a gap below this times d/2 are bonded",
          "Labra 2012"),
    entry("Packing", "Lattice rows", "x", one_of("x|y"), "-",
          "direction of the rows of touching particles in the triangular lattice; y: particles of a row have the same x", ""),
    entry("Packing", "Lattice plane", "", text(), "m",
          "x of a lattice plane; the packing contains the particles with centres at lower <= x < upper of the box. Empty: the "
          "lattice is centred, and all particles are inside the box",
          ""),
    entry("Packing", "Seed", "1", whole_number(0, 2147483647), "-", "seed of the random packing", ""),

    entry("Bond", "Strength", "given", one_of("given|calibrated"), "-",
          "given: the two strengths below; calibrated: those in strengths.txt beside the case, which `kerf calibrate` writes. "
          "They hold for every seed and mean diameter",
          ""),
    entry("Bond", "Tensile strength", "10e3", positive(), "N (2D: N/m)", "R_n, normal force at which a bond fails",
          "Onate & Rojek 2004"),
    entry("Bond", "Shear strength", "30e3", positive(), "N (2D: N/m)", "R_t, tangential force at which a bond fails",
          "Onate & Rojek 2004"),
    entry("Bond", "Shear strength friction", "0", not_negative(), "-",
          "mu_b: a bond under compression F_c fails at the shear force R_t + mu_b F_c; 0: always at R_t",
          "Mohr-Coulomb at the bond, law KDEM of CIMNE"),
    entry("Bond", "Friction", "0.5", not_negative(), "-", "Coulomb coefficient of contacts without bond", ""),
    entry("Bond", "Damping ratio", "0.1", between(0., 1.), "-", "contact damping as a fraction of critical damping", ""),
    entry("Bond", "Local damping", "0", between(0., 0.95), "-", "Cundall's non-viscous damping of particles", ""),

    entry("Calibration", "Packings", "3", whole_number(1, 100), "-",
          "number of specimens of each test, each with its own packing", ""),
    entry(
      "Calibration", "Specimen width", "0", not_negative(), "particle diameters d",
      "width of the specimen in compression; its height is twice this, the diameter of the Brazilian disc 1.25 times this. 0: "
      "40 in 2D, 16 in 3D",
      ""),
    entry(
      "Calibration", "Transits", "40", positive(), "-",
      "duration of the loading up to the target strength, in transit times of a P wave through the specimen; a longer loading "
      "is closer to a static test",
      ""),

    entry(
      "Coupling", "Method", "weak_multipliers", one_of(names_of_constraint_methods()), "-",
      "constraint of particles in the overlap to the finite-element field. penalty: constant stiffness k_DF (Labra et al.); "
      "penalty_mass_scaled: k_i = beta mu_i/dt^2; weak_multipliers: multipliers on the nodes, which constrain weighted means "
      "and leave the fluctuations of particles free; lumped_multipliers: multipliers on the particles with a lumped matrix",
      "penalty: Labra, Rojek & Onate, eq. (4); lumped: Xiao & Belytschko 2004"),
    entry("Coupling", "Overlap width", "16", positive(), "particle diameters d", "width L_o of the overlap zone", ""),
    entry("Coupling", "Overlap cells", "0", not_negative(), "cells",
          "width L_o in units of Mesh/Cell size, of a mesh from a file in median edges of its cells; 0: L_o is Overlap width",
          ""),
    entry("Coupling", "Weight function", "linear", one_of("linear|cubic|constant"), "-",
          "finite-element weight alpha at the relative distance s through the overlap: s, 3 s^2 - 2 s^3, or 1/2",
          "Xiao & Belytschko 2004; Bauman et al. 2008"),
    entry("Coupling", "Penalty ratio", "0.5", positive(), "-",
          "penalty_mass_scaled: beta, below 2; it adds at most this to omega^2 dt^2, whose limit is 4. penalty: k_DF/k_n. "
          "lumped_multipliers: fraction of the gap that is removed in a step, below 2",
          ""),
    entry("Coupling", "Interface damping", "0", between(0., 1.), "-",
          "damping of the penalty springs, fraction of critical damping", ""),
    entry(
      "Coupling", "Corrector", "none", one_of("none|weak"), "-",
      "weak: the penalties constrain a particle to the field plus its fluctuation for the strain of the field, from a static "
      "solution of the packing with fixed means around nodes",
      ""),
    entry(
      "Coupling", "Breaking weight", "0", between(0., 1.), "-",
      "bonds with a smaller weight do not break. At such a weight the finite elements, which are elastic, carry most of the "
      "stress",
      ""),
    entry(
      "Coupling", "Fluctuation relaxation", "0.05", between(0., 0.5), "-",
      "weak_multipliers: fraction of the particles' velocity relative to the finite-element field that is removed in a step",
      ""),

    entry(
      "Adaptivity", "Criterion", "mohr_coulomb", one_of("maximum_principal|von_mises|mohr_coulomb|drucker_prager"), "-",
      "stress measure sigma of a cell; mohr_coulomb: sigma_1 - sigma_3 f_t/f_c; drucker_prager: the cone through f_t and f_c",
      "Labra, Rojek & Onate, eq. (5)"),
    entry("Adaptivity", "Sigma star", "0", not_negative(), "Pa",
          "a cell is converted to particles when sigma > sigma*; 0: Sigma star fraction x tensile strength",
          "Labra, Rojek & Onate, eq. (5)"),
    entry("Adaptivity", "Sigma star fraction", "0.5", between(0.01, 1.), "tensile strength",
          "sigma*, if Sigma star is 0, as a fraction of the measured direct tensile strength; of Rock/Tensile strength when "
          "Bond/Strength = given",
          ""),
    entry("Adaptivity", "Contact activation", "true", flag(), "-",
          "cells that are too coarse for their contact with a round tool are converted before the tool touches them; platens "
          "convert none. false: by sigma* only",
          ""),
    entry("Adaptivity", "Check interval", "20", whole_number(1, 1000000), "steps", "steps between two checks of sigma", ""),
    entry("Adaptivity", "Relaxation steps", "10", whole_number(0, 1000), "-",
          "iterations that move new particles to equilibrium at constant time; 0: the particles stay as projected", ""),
    entry(
      "Adaptivity", "Event fraction", "1", between(0., 1.), "sigma*",
      "when a cell exceeds sigma*, cells next to the particles with a stress above this are converted too. Smaller values give "
      "fewer and larger events",
      ""),
    entry(
      "Adaptivity", "Return fraction", "0", between(0., 1.), "sigma*",
      "particle cells without broken bonds return to the continuum when their stress has stayed below this for Return time; "
      "0: never",
      ""),
    entry("Adaptivity", "Return time", "2e-4", positive(), "s", "time for which the stress must stay below Return fraction",
          ""),

    entry("Fixed", "Region", "", text(), "m",
          "mode fixed: boxes 'x0 y0 x1 y1' (3D: 'x0 y0 z0 x1 y1 z1') separated by ';'. Cells with their centre inside "
          "are particles from the start",
          ""),

    entry("Tool", "Kind", "disc", one_of("disc|platens|none"), "-",
          "disc: rigid disc cutter with its axis along z; platens: two rigid platens of a press, which close along y; none: no "
          "tool",
          ""),
    entry("Tool", "Radius", "0.025", positive(), "m", "radius of the disc", ""),
    entry("Tool", "Width", "0", not_negative(), "m",
          "3D: width of the disc along its axis, the rim is a half circle; 0: an infinite cylinder", ""),
    entry("Tool", "Middle", "0", number(), "m", "z of the disc's middle plane", ""),
    entry("Tool", "Path", "", text(), "s, m",
          "way points 't x y' of the disc centre separated by ';', with linear interpolation", ""),
    entry("Tool", "Smoothing time", "1e-4", not_negative(), "s",
          "the path is averaged over this time, and platens reach their speed in it, so that the velocity has no jumps", ""),
    entry("Tool", "Rolling", "true", flag(), "-", "the disc rolls without slip on its path; false: it does not rotate", ""),
    entry(
      "Tool", "Closing speed", "0.1", number(), "m/s",
      "relative speed of the platens; each moves at half of it. Negative: they pull. Each holds the rock that touches it at "
      "the start and lets it contract laterally: direct tension",
      ""),
    entry("Tool", "Stiffness ratio", "0", not_negative(), "-",
          "contact stiffness between tool and particle / bond stiffness k_n, which lowers the stable step; 0: as stiff as the "
          "time step allows, at least about 5 k_n at Time/Safety = 0.7 (mode fem: 25)",
          ""),
    entry("Tool", "Friction", "0.3", not_negative(), "-", "Coulomb coefficient between tool and rock", ""),
    entry("Tool", "Damping ratio", "0.1", between(0., 1.), "-", "tool contact damping / critical damping", ""),

    entry("Time", "End time", "1e-3", positive(), "s", "end of the run", ""),
    entry("Time", "Stop below", "0", between(0., 0.99), "-",
          "the run ends when bonds have broken and the tool's force is below this fraction of its peak; 0: never", ""),
    entry("Time", "Time step", "0", not_negative(), "s", "time step of both sides; 0: Safety x stable step", ""),
    entry("Time", "Safety", "0.7", between(0.01, 0.99), "-", "time step / stable step, if Time step is 0", ""),
    entry(
      "Time", "Energy tolerance", "0.05", between(0., 1.), "-",
      "the run stops with exit code 3 when the error of the energy balance exceeds this fraction of the energy put in; 0: when "
      "it exceeds all of it",
      ""),

    entry("Output", "History interval", "50", whole_number(1, 100000000), "steps",
          "steps between rows of history.csv; forces in a row are means since the previous row", ""),
    entry("Output", "Snapshots", "20", whole_number(1, 100000), "-", "number of fields written over the run", ""),
  };
  return table;
}

const std::vector<Renamed> &renamed_parameters()
{
  static const std::vector<Renamed> table = {{"Coupling", "Method", "multipliers", "weak_multipliers"},
                                             {"Coupling", "Method", "multipliers_diagonal", "lumped_multipliers"},
                                             {"Packing", "Rows along", "", "Lattice rows"},
                                             {"Packing", "Plane at", "", "Lattice plane"}};
  return table;
}
} // namespace kerf
