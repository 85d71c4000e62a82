// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/parameter_table.h"

namespace kerf
{
namespace
{
namespace P = dealii::Patterns;

template <typename Pattern, typename... Args>
std::shared_ptr<P::PatternBase> allow(Args &&...args)
{
  return std::make_shared<Pattern>(std::forward<Args>(args)...);
}

constexpr double tiny = 1e-300, huge = 1e300;

std::shared_ptr<P::PatternBase> positive()
{
  return allow<P::Double>(tiny, huge);
}
std::shared_ptr<P::PatternBase> not_negative()
{
  return allow<P::Double>(0., huge);
}
std::shared_ptr<P::PatternBase> text()
{
  return allow<P::Anything>();
}
std::shared_ptr<P::PatternBase> point()
{
  return allow<P::List>(P::Double(), 2, 3, ",");
}
} // namespace

const std::vector<Parameter> &parameter_table()
{
  static const std::vector<Parameter> table = {
    {"Rock", "Density", "2650", positive(), "kg/m^3", "density of the rock", ""},
    {"Rock", "Young modulus", "40e9", positive(), "Pa",
     "Young's modulus of finite elements and, by calibration, of the relaxed packing", ""},
    {"Rock", "Poisson ratio", "0.2", allow<P::Double>(0., 0.499), "-", "Poisson's ratio, plane strain in 2D", ""},
    {"Rock", "Tensile strength", "10e6", positive(), "Pa", "f_t, used by the Mohr-Coulomb activation measure only", ""},
    {"Rock", "Compressive strength", "100e6", positive(), "Pa", "f_c, used by the Mohr-Coulomb activation measure only", ""},

    {"Mesh", "File", "", text(), "-", "gmsh .msh file of quadrilaterals; empty: structured box", ""},
    {"Mesh", "Lower corner", "0, 0", point(), "m", "corner of the structured box", ""},
    {"Mesh", "Upper corner", "0.1, 0.05", point(), "m", "opposite corner of the structured box", ""},
    {"Mesh", "Cell size", "4e-3", positive(), "m", "cell size of the structured box, in the fine zone if there is one", ""},
    {"Mesh", "Fine zone lower corner", "0, 0", point(), "m", "fine zone; equal corners: uniform mesh", ""},
    {"Mesh", "Fine zone upper corner", "0, 0", point(), "m", "opposite corner of the fine zone", ""},
    {"Mesh", "Growth ratio", "1.2", allow<P::Double>(1., 3.), "-", "ratio of neighbouring cell sizes outside the fine zone",
     ""},
    {"Mesh", "Largest cell size", "0", not_negative(), "m", "upper bound of the graded size; 0: none", ""},

    {"Boundary", "Conditions", "left: roller; right: roller; bottom: fixed", text(), "-",
     "list 'id: kind' separated by ';'. id: number, or left, right, bottom, top of the box. kind: free, fixed, roller, "
     "absorbing, velocity VX VY ramp T [m/s, s]. Particles next to a boundary follow it too",
     "absorbing: Lysmer & Kuhlemeyer 1969"},

    {"Packing", "File", "", text(), "-",
     "HDF5 store of the particles; empty: packing_KIND_DIAMETER_SEED.h5 beside the case, generated when missing", ""},
    {"Packing", "Kind", "random", allow<P::Selection>("random|triangular"), "-", "dense random packing or triangular lattice",
     ""},
    {"Packing", "Mean diameter", "1e-3", positive(), "m", "mean particle diameter d", ""},
    {"Packing", "Radius spread", "0.4", allow<P::Double>(0., 0.8), "-", "radii are uniform in (1 - s, 1 + s) d/2", ""},
    {"Packing", "Gap tolerance", "0.1", allow<P::Double>(0., 1.), "-", "pairs with a gap below this times d/2 are bonded",
     "Labra 2012"},
    {"Packing", "Seed", "1", allow<P::Integer>(0, 2147483647), "-", "seed of the random packing", ""},

    {"Bond", "Tensile strength", "10e3", positive(), "N (2D: N/m)", "R_n, normal force at which a bond fails",
     "Onate & Rojek 2004"},
    {"Bond", "Shear strength", "30e3", positive(), "N (2D: N/m)", "R_t, tangential force at which a bond fails",
     "Onate & Rojek 2004"},
    {"Bond", "Friction", "0.5", not_negative(), "-", "Coulomb coefficient of contacts without bond", ""},
    {"Bond", "Damping ratio", "0.1", allow<P::Double>(0., 1.), "-", "contact damping as a fraction of critical damping", ""},
    {"Bond", "Local damping", "0", allow<P::Double>(0., 0.95), "-", "Cundall's non-viscous damping of particles", ""},

    {"Coupling", "Method", "penalty_mass_scaled", allow<P::Selection>("penalty|penalty_mass_scaled"), "-",
     "how overlap particles are tied to the finite-element field: the seed's constant k_DF, or k_i = beta mu_i/dt^2",
     "Labra, Rojek & Onate, eq. (4)"},
    {"Coupling", "Overlap width", "16", positive(), "particle diameters d", "width L_o of the overlap zone", ""},
    {"Coupling", "Weight function", "linear", allow<P::Selection>("linear|cubic|constant"), "-",
     "alpha over the overlap: s, 3 s^2 - 2 s^3, or 1/2", "Xiao & Belytschko 2004; Bauman et al. 2008"},
    {"Coupling", "Penalty ratio", "0.25", positive(), "-",
     "beta of the mass-scaled penalty (stable below about 0.5), or k_DF/k_n of the constant one", ""},

    {"Adaptivity", "Criterion", "mohr_coulomb", allow<P::Selection>("maximum_principal|von_mises|mohr_coulomb"), "-",
     "stress measure sigma of a cell; mohr_coulomb: sigma_1 - sigma_3 f_t/f_c", "seed, eq. (5)"},
    {"Adaptivity", "Sigma star", "4e6", positive(), "Pa", "a cell becomes particles when sigma > sigma*", "seed, eq. (5)"},
    {"Adaptivity", "Check interval", "20", allow<P::Integer>(1, 1000000), "steps", "steps between two checks of sigma", ""},

    {"Fixed", "Region", "", text(), "m",
     "mode fixed: boxes 'x0 y0 x1 y1' separated by ';'. Cells whose centre is inside are particles from the start", ""},

    {"Tool", "Kind", "disc", allow<P::Selection>("disc|none"), "-", "rigid disc cutter (profile in the plane), or no tool", ""},
    {"Tool", "Radius", "0.025", positive(), "m", "radius of the disc", ""},
    {"Tool", "Path", "", text(), "s, m", "way points 't x y' of the disc centre separated by ';', linear in between", ""},
    {"Tool", "Smoothing time", "1e-4", not_negative(), "s", "the path is averaged over this time: no velocity jumps", ""},
    {"Tool", "Rolling", "true", allow<P::Bool>(), "-", "the disc rolls without slip on its path; false: it does not rotate",
     ""},
    {"Tool", "Stiffness ratio", "1", positive(), "-", "contact stiffness between tool and particle / k_n", ""},
    {"Tool", "Friction", "0.3", not_negative(), "-", "Coulomb coefficient between tool and rock", ""},
    {"Tool", "Damping ratio", "0.1", allow<P::Double>(0., 1.), "-", "tool contact damping / critical damping", ""},

    {"Time", "End time", "1e-3", positive(), "s", "end of the run", ""},
    {"Time", "Time step", "0", not_negative(), "s", "step of both sides; 0: safety x stable step", ""},
    {"Time", "Safety", "0.7", allow<P::Double>(0.01, 0.99), "-", "step / stable step when the step is not given", ""},

    {"Output", "History interval", "50", allow<P::Integer>(1, 100000000), "steps",
     "steps between rows of history.csv; forces in a row are means since the row before", ""},
    {"Output", "Snapshots", "20", allow<P::Integer>(1, 100000), "-", "number of fields written over the run", ""},
  };
  return table;
}
} // namespace kerf
