// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <functional>
#include <memory>
#include <mpi.h>
#include <stdexcept>
#include <string>
#include <vector>

/// The continuum: explicit dynamics of elastic rock on finite elements. The interface has plain C++ and Eigen types only. Units
/// are SI. Vectors always have three components; z = 0 in two dimensions, which mean plane strain per metre of thickness.
///
/// Errors are of three kinds. Settings that cannot be used throw std::invalid_argument with one line for the user. A motion
/// that left the physical range throws Unstable. Misuse of the interface throws std::logic_error.
namespace kerf::fem
{
/// The motion left the physical range, because the step was too large or the loads were.
struct Unstable : std::runtime_error
{
  using std::runtime_error::runtime_error;
};

enum class MeshShape
{
  box, ///< structured, may be graded
  disc ///< the circle inscribed in the box, in three dimensions a cylinder along z
};

/// Cells that meet this box are halved along every axis this many times. Cells around it are halved too, so that neighbours
/// differ by one halving at most.
struct RefinedBox
{
  Eigen::Vector3d lower = Eigen::Vector3d::Zero(); ///< [m]
  Eigen::Vector3d upper = Eigen::Vector3d::Zero(); ///< [m]
  int levels = 1;
};

/// Mesh of the rock: a gmsh file or a shape.
struct MeshSettings
{
  std::string gmsh_file; ///< .msh file; empty: shape
  MeshShape shape = MeshShape::box;
  double flat_angle = 0.;                          ///< of a disc: half of the angle of the flats at its top and bottom [rad]
  Eigen::Vector3d lower = Eigen::Vector3d::Zero(); ///< box corner [m]
  Eigen::Vector3d upper = Eigen::Vector3d::Zero(); ///< box corner [m]
  double cell_size = 0.;                           ///< cell size, inside the fine zone if there is one [m]
  Eigen::Vector3d fine_lower = Eigen::Vector3d::Zero(); ///< fine zone corner [m]; fine_lower == fine_upper: uniform
  Eigen::Vector3d fine_upper = Eigen::Vector3d::Zero(); ///< fine zone corner [m]
  double growth = 1.;                                   ///< ratio of neighbouring cell sizes outside the fine zone, >= 1
  double largest_cell_size = 0.;                        ///< upper bound of the graded size [m]; 0: none
  std::vector<RefinedBox> refined;                      ///< local refinement with hanging nodes, of any mesh
  std::array<bool, 3> periodic = {
    {false, false, false}}; ///< axes across which the mesh repeats itself; sides across them are no boundary
};

/// Measure of the strain.
enum class Strain
{
  finite, ///< Green's strain (total Lagrangian, St. Venant-Kirchhoff): any displacement and rotation
  small   ///< linear and cheaper, for rotations and strains far below one
};

/// How stresses are integrated over a cell.
enum class Integration
{
  full,      ///< two Gauss points in each direction
  selective, ///< the same with the cell's mean volumetric strain (B-bar, Hughes 1980); does not lock when nearly incompressible
  one_point  ///< mean gradient and elastic hourglass control (Flanagan & Belytschko 1981); cheapest, does not lock in bending
};

/// Isotropic linear-elastic rock (St. Venant-Kirchhoff in finite strain).
struct Material
{
  double density = 0.; ///< [kg/m^3]
  double young = 0.;   ///< [Pa]
  double poisson = 0.; ///< [-]

  double lame_lambda() const { return young * poisson / ((1. + poisson) * (1. - 2. * poisson)); }
  double lame_mu() const { return young / (2. * (1. + poisson)); }
  double speed_p() const; ///< c_p = sqrt((lambda + 2 mu)/rho) [m/s]
  double speed_s() const; ///< c_s = sqrt(mu/rho) [m/s]
};

enum class BoundaryKind
{
  free,
  fixed,    ///< all displacement components held
  roller,   ///< normal displacement held; faces must be parallel to the axes
  velocity, ///< all velocity components prescribed, reached by a smooth ramp
  traction, ///< given traction per reference area, reached by a smooth ramp
  in_situ,  ///< traction that holds the initial stress, from the start
  absorbing ///< viscous traction -rho (c_p v_n + c_s v_t) (Lysmer & Kuhlemeyer 1969) and the traction of kind in_situ
};

/// 0 before time zero, then a half cosine up to 1 within @p ramp [s].
double smooth_start(double time, double ramp);

struct BoundaryCondition
{
  int id = 0;        ///< boundary id; box: 0 left, 1 right, 2 bottom, 3 top (3D: 4 back, 5 front); disc: 0 rim (3D: 4, 5)
  std::string where; ///< instead of the id: condition on x, y, z [m] of the faces' centres, e.g. "y < 1e-6"
  BoundaryKind kind = BoundaryKind::free;
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero(); ///< [m/s], kind velocity only
  Eigen::Vector3d traction = Eigen::Vector3d::Zero(); ///< [Pa], kind traction only
  double ramp = 0.;                                   ///< duration of the smooth (half cosine) start [s]

  /// Prescribed velocity at @p time [s].
  Eigen::Vector3d velocity_at(double time) const;
  std::string name() const; ///< the id or the expression, for a person
};

struct Settings
{
  MPI_Comm comm = MPI_COMM_WORLD;
  int dim = 2;
  MeshSettings mesh;
  Material material;
  Strain strain = Strain::finite;
  Integration integration = Integration::full;
  std::vector<BoundaryCondition> boundary_conditions; ///< faces without an entry are free
  Eigen::Vector3d gravity = Eigen::Vector3d::Zero();  ///< [m/s^2]
  double gravity_ramp = 0.;                           ///< duration of its smooth start [s]
  /// Cauchy stress in the body at the start [Pa], tension positive. The body starts deformed by initial_state(). In two
  /// dimensions the out-of-plane stress is that of plane strain.
  Eigen::Matrix3d initial_stress = Eigen::Matrix3d::Zero();
  double surface_spacing = 0.; ///< largest distance of the points of the surface [m]; 0: Gauss points of the faces
};

/// A face of the mesh boundary.
struct BoundaryFace
{
  int id = 0;                                    ///< boundary id
  int cell = -1;                                 ///< the cell it belongs to
  std::array<int, 4> nodes = {{-1, -1, -1, -1}}; ///< 2 (2D) or 4 (3D) node numbers
};

/// A node without degrees of freedom of its own: a hanging node of a locally refined mesh or the image of a node across a
/// periodic axis. It moves with its masters, u_s = sum_k w_k u_k. Its force and mass go to them with the same weights.
struct SlaveNode
{
  int node = -1;
  std::vector<int> masters; ///< no slaves themselves
  std::vector<double> weights;
};

/// Reference geometry, the same on every rank.
struct Mesh
{
  int dim = 2;
  Eigen::Matrix3Xd nodes;                           ///< reference positions [m]
  Eigen::MatrixXi cells;                            ///< 2^dim x n_cells node numbers, lexicographic order (x runs fastest)
  std::vector<int> owner;                           ///< rank that computes a cell
  std::vector<BoundaryFace> boundary;               ///< without the sides that are joined across a periodic axis
  Eigen::Vector3d period = Eigen::Vector3d::Zero(); ///< length of the mesh along periodic axes, 0 along others [m]
  std::vector<SlaveNode> slaves;                    ///< by rising node number
  std::vector<std::vector<int>> neighbours;         ///< of every cell: the cells that share a face or a part of it

  int n_cells() const { return static_cast<int>(cells.cols()); }
  int n_nodes() const { return static_cast<int>(nodes.cols()); }
};

/// Motion of the corners of a cell in terms of nodes that have degrees of freedom.
struct CellMotion
{
  std::vector<int> nodes; ///< the corners in their order, with masters in place of slaves; each once
  Eigen::MatrixXd share;  ///< u_corner = sum over nodes of share(corner, node) u_node
};
CellMotion cell_motion(const Mesh &mesh, int cell);

/// Interpolation at a point of the reference configuration: u(X) = sum_a N_a u_a, grad u = sum_a u_a (x) dN_a. The nodes are
/// those of the cell, with masters in place of slaves.
struct Interpolation
{
  int cell = -1; ///< -1: outside the mesh
  int n = 0;     ///< number of nodes, at most 2^dim
  std::array<int, 8> nodes = {};
  std::array<double, 8> N = {};
  std::array<double, 3> xi = {}; ///< place in the cell [0, 1]^dim, whose corners are numbered by bits: bit d for direction d
  Eigen::Matrix<double, 3, 8> dN = Eigen::Matrix<double, 3, 8>::Zero(); ///< gradients in the reference configuration [1/m]
};

enum class NodalField
{
  displacement, ///< [m]
  velocity,     ///< [m/s]
  force,        ///< assembled so far in this step [N]
  mass,         ///< weighted lumped mass, in all three rows [kg]
  inverse_mass  ///< of free components; 0 where the motion is prescribed or there is no mass [1/kg]
};

/// Cauchy stress at the centre of the cells that this rank owns and that carry weight.
struct CellStress
{
  std::vector<int> cell;
  Eigen::Matrix<double, 6, Eigen::Dynamic> sigma; ///< xx, yy, zz, yz, xz, xy [Pa], tension positive, not weighted
};

/// Weighted tangent stiffness of one undeformed cell. Component c of corner a has number dim * a + c.
using CellStiffness = Eigen::MatrixXd;

/// The points of a boundary face at which loads and contacts act, in the reference configuration.
struct FacePoints
{
  Eigen::Matrix3Xd position; ///< [m]
  Eigen::Matrix3Xd area;     ///< outer normal times the area that a point stands for [m^2] (2D: [m] per metre)
};
/// The Gauss points of a face that is divided into equal parts, so that their mean distance is at most @p spacing [m]. 0: one
/// part.
FacePoints face_points(const Mesh &mesh, const BoundaryFace &face, double spacing);

/// Points of outer boundary faces of weighted cells owned by this rank, in the current configuration.
struct SurfacePoints
{
  Eigen::Matrix3Xd position; ///< [m]
  Eigen::Matrix3Xd velocity; ///< [m/s]
  Eigen::VectorXd area;      ///< alpha-weighted reference area of the point [m^2] (2D: [m] per metre)
  Eigen::Matrix3Xd normal;   ///< outer unit normal
  std::vector<int> cell;     ///< number in the mesh of the cell behind the face
  Eigen::VectorXd weight;    ///< alpha at the point [-]
};

/// Source of forces on the surface. The work of each source is counted apart.
enum class SurfaceLoad
{
  tool,
  debris ///< particles that have come off the rock
};

/// True if the ball of @p radius about @p centre [m] may hold a point of interest.
using NearTest = std::function<bool(const Eigen::Vector3d &centre, double radius)>;

struct Energies
{
  double kinetic = 0.; ///< weighted [J]
  /// Correction for the finite step, -dt^2/8 sum f^2/m over free components [J]. With it kinetic energy is
  /// m/2 v^{n-1/2} v^{n+1/2}, which grows by exactly the work of all forces by the trapezoidal rule.
  double finite_step = 0.;
  double elastic = 0.;  ///< weighted [J]
  double boundary = 0.; ///< work done on the rock by velocity boundaries, tractions and gravity since the start [J]
  double absorbed = 0.; ///< taken away by absorbing boundaries since the start [J]
  std::array<double, 2> surface = {{0., 0.}}; ///< work of each SurfaceLoad since the start (trapezoidal rule) [J]
};

/// Contact of the outer boundary with other bodies: all that tools and debris need of the finite elements.
class SurfaceContact
{
public:
  virtual ~SurfaceContact() = default;

  /// Points of the outer boundary that lie in the box [lower, upper] [m]. Positions are current and faces are taken whole. Only
  /// faces whose enclosing ball is @p near are searched; without a test all of them are. Not collective.
  virtual void surface_points(const Eigen::Vector3d &lower, const Eigen::Vector3d &upper, const NearTest &near,
                              SurfacePoints &points) const = 0;
  /// Adds forces [N], 3 x the number of points of the last surface_points() call on this rank. Throws std::logic_error on any
  /// other number. Collective.
  virtual void add_surface_forces(const Eigen::Matrix3Xd &forces, SurfaceLoad source) = 0;
};

/// The solver of the continuum. One explicit step (velocity Verlet with lumped mass, Belytschko, Liu & Moran 2000, ch. 6) is
/// begin_step(dt, t); compute_forces(); ...forces added from outside...; end_step(dt, t).
///
/// All functions are collective unless stated. Energies and steps are the same on every rank. Misuse, such as a vector of the
/// wrong size, throws std::logic_error.
class FemSide : public SurfaceContact
{
public:
  // ---- Mesh: fixed in the reference configuration. Not collective.

  virtual const Mesh &mesh() const = 0;
  virtual const std::vector<int> &owned_cells() const = 0; ///< of this rank, by their numbers in the mesh
  /// Reference coordinates of the quadrature points of the owned cells [m]. A cell has n_q = 2^dim points. Point q of cell
  /// owned_cells()[c] is column c * n_q + q.
  virtual const Eigen::Matrix3Xd &quadrature_points() const = 0;
  /// Reference coordinates of the points of the outer boundary faces of the owned cells, see face_points() [m].
  virtual const Eigen::Matrix3Xd &surface_positions() const = 0;
  /// Cells and shape functions of points of the reference configuration [m]. A point on a face belongs to the cell with the
  /// lowest number. Across periodic axes a point may be replaced by its image. Outside the mesh cell = -1.
  virtual std::vector<Interpolation> locate(const Eigen::Matrix3Xd &points) const = 0;

  // ---- Weights: the share of the continuum where models overlap.

  /// Weight alpha in [0, 1] at every quadrature point, in the order of quadrature_points(), and at every point of the surface,
  /// in the order of surface_positions(); 1 at the start. A cell whose quadrature points are all zero is switched off. Lumped
  /// masses are computed anew. Nodes without mass stop moving; displacements stay. Loads, dashpots and contacts on the surface
  /// have the weight of the surface where they act.
  virtual void set_weights(const Eigen::VectorXd &alpha, const Eigen::VectorXd &surface_alpha) = 0;
  virtual int n_active_cells() const = 0; ///< over all ranks. Not collective.

  // ---- Time step.

  /// v += dt/2 f/M, then u += dt v. @p dt [s]; @p time [s] is that of the new positions, for prescribed velocities.
  virtual void begin_step(double dt, double time) = 0;
  /// f = -f_int(u) + loads on the boundary and weight. Forces that were added before are lost.
  virtual void compute_forces() = 0;
  /// v += dt/2 f/M with prescribed velocities enforced.
  virtual void end_step(double dt, double time) = 0;
  /// Largest stable step of central differences for the present weights [s]: 2/omega_max by Lanczos' method.
  virtual double stable_step() const = 0;
  /// Throws Unstable on every rank when velocities are not finite or a cell has turned inside out: its deformation has no
  /// positive volume at a quadrature point of weight above zero. As expensive as a part of a step.
  virtual void check_motion() const = 0;

  // ---- Nodal window: chosen nodes whose values go out and forces come in.

  /// Chooses the nodes that this rank reads and loads, whichever rank owns them. Slaves cannot be chosen.
  virtual void set_window(const std::vector<int> &nodes) = 0;
  /// Values of the nodal window, 3 x n_window, in the order given to set_window().
  virtual void read_window(NodalField field, Eigen::Matrix3Xd &values) const = 0;
  /// Adds forces [N], 3 x n_window, to the nodal window. This is the exact transpose of read_window().
  virtual void add_window_forces(const Eigen::Matrix3Xd &forces) = 0;

  // ---- Fields: state in, results out.

  /// Sets displacement [m] and velocity [m/s] of all nodes, each 3 x n_nodes and the same on every rank.
  virtual void set_state(const Eigen::Matrix3Xd &displacement, const Eigen::Matrix3Xd &velocity) = 0;
  /// All nodal values on every rank, 3 x n_nodes. Masses and forces of slaves are zero because their masters carry them.
  virtual Eigen::Matrix3Xd gather(NodalField field) const = 0;
  virtual CellStress cell_stress() const = 0;
  /// Stiffness of @p cells that this rank owns, for the present weights, in the reference configuration [N/m]. Cells that are
  /// switched off give zero. Not collective.
  virtual std::vector<CellStiffness> cell_stiffness(const std::vector<int> &cells) const = 0;
  /// Writes one VTU file for all ranks: displacement, velocity, stress, alpha, and @p cell_fields [Pa], each of which has a
  /// name and one value for every cell of the mesh.
  virtual void write_vtu(const std::string &path,
                         const std::vector<std::pair<std::string, Eigen::VectorXd>> &cell_fields) const = 0;

  // ---- Energy.

  virtual Energies energies() const = 0;
};

/// Faces that a condition selects, one flag for each of mesh.boundary. Throws std::invalid_argument with one line when it
/// selects none or its expression cannot be parsed.
std::vector<char> selected_faces(const Mesh &mesh, const BoundaryCondition &condition);

/// The homogeneous deformation that carries Settings::initial_stress: u = gradient (X - anchor). The anchor is the middle of
/// the mesh's top side (largest y), where tools come from.
struct InitialState
{
  Eigen::Matrix3d gradient = Eigen::Matrix3d::Zero();    ///< du/dX, symmetric [-]
  Eigen::Matrix3d first_piola = Eigen::Matrix3d::Zero(); ///< its traction on a face is first_piola times the outer normal [Pa]
};
/// Throws std::invalid_argument with one line when the material cannot carry the stress.
InitialState initial_state(const Settings &settings);

/// Builds the mesh and the solver. Throws std::invalid_argument with one line on settings or a mesh that cannot be used.
/// Collective.
std::unique_ptr<FemSide> make_fem_side(const Settings &settings);

/// Version string of the finite-element library.
std::string library_version();
} // namespace kerf::fem
