// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <functional>
#include <memory>
#include <mpi.h>
#include <string>
#include <vector>

/// The continuum: explicit dynamics of elastic rock on finite elements. Plain C++ and Eigen types only; vectors always have
/// three components (z = 0 in two dimensions), SI units, two dimensions mean plane strain per metre of thickness.
namespace kerf::fem
{
enum class MeshShape
{
  box, ///< structured, may be graded
  disc ///< the circle inscribed in the box, in three dimensions a cylinder along z
};

/// Cells that meet this box are halved along every axis this many times; cells around it follow so that neighbours differ by
/// one halving at most.
struct RefinedBox
{
  Eigen::Vector3d lower = Eigen::Vector3d::Zero(); ///< [m]
  Eigen::Vector3d upper = Eigen::Vector3d::Zero(); ///< [m]
  int levels = 1;
};

/// Mesh of the rock: a gmsh file, or a shape.
struct MeshSettings
{
  std::string gmsh_file; ///< .msh file; empty: shape
  MeshShape shape = MeshShape::box;
  double flat_angle = 0.;                          ///< of a disc: half of the angle of the flats at its top and bottom [rad]
  Eigen::Vector3d lower = Eigen::Vector3d::Zero(); ///< box corner [m]
  Eigen::Vector3d upper = Eigen::Vector3d::Zero(); ///< box corner [m]
  double cell_size = 0.;                           ///< cell size, inside the fine zone if there is one [m]
  Eigen::Vector3d fine_lower = Eigen::Vector3d::Zero();   ///< fine zone corner [m]; fine_lower == fine_upper: uniform
  Eigen::Vector3d fine_upper = Eigen::Vector3d::Zero();   ///< fine zone corner [m]
  double growth = 1.;                                     ///< ratio of neighbouring cell sizes outside the fine zone, >= 1
  double largest_cell_size = 0.;                          ///< upper bound of the graded size [m]; 0: none
  std::vector<RefinedBox> refined;                        ///< local refinement with hanging nodes, of any mesh
  std::array<bool, 3> periodic = {{false, false, false}}; ///< axes across which the mesh repeats itself: no boundary there
};

/// Measure of the strain.
enum class Strain
{
  finite, ///< Green's strain (total Lagrangian, St. Venant-Kirchhoff): any displacement and rotation
  small   ///< linear, cheaper: rotations and strains far below one
};

/// How stresses are integrated over a cell.
enum class Integration
{
  full,      ///< Gauss points, 2 a direction
  selective, ///< the same with the cell's mean volumetric strain (B-bar): does not lock when nearly incompressible
  one_point  ///< mean gradient and elastic hourglass control: cheapest, bends without locking
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
  absorbing ///< viscous (Lysmer-Kuhlemeyer 1969): traction -rho (c_p v_n + c_s v_t), and that of kind in_situ
};

/// 0 before time zero, then a half cosine up to 1 within @p ramp [s].
double smooth_start(double time, double ramp);

struct BoundaryCondition
{
  int id = 0;        ///< boundary id; box: 0 left, 1 right, 2 bottom, 3 top (3D: 4 back, 5 front); disc: 0 rim (3D: 4, 5)
  std::string where; ///< instead of the id: expression of x, y, z [m] that the centres of the faces fulfil, e.g. "y < 1e-6"
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
  /// Cauchy stress in the body at the start [Pa], tension positive; the body starts deformed by initial_state(), in two
  /// dimensions with the out-of-plane stress of plane strain.
  Eigen::Matrix3d initial_stress = Eigen::Matrix3d::Zero();
  double surface_spacing = 0.; ///< largest distance of surface_points() [m]; 0: Gauss points of the faces
};

/// A face of the mesh boundary.
struct BoundaryFace
{
  int id = 0;                                    ///< boundary id
  int cell = -1;                                 ///< the cell it belongs to
  std::array<int, 4> nodes = {{-1, -1, -1, -1}}; ///< 2 (2D) or 4 (3D) node numbers
};

/// A node without freedom of its own: it moves with its masters, u_s = sum_k w_k u_k, and what it carries of force and mass
/// goes to them with the same weights (hanging node of a locally refined mesh, image of a node across a periodic axis).
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

/// How the corners of a cell move: by the nodes that have freedom of their own.
struct CellMotion
{
  std::vector<int> nodes; ///< the corners in their order, with masters in place of slaves; each once
  Eigen::MatrixXd share;  ///< of the motion of each corner (row) that each of the nodes gives
};
CellMotion cell_motion(const Mesh &mesh, int cell);

/// A point of the reference configuration seen by its cell: u(X) = sum_a N_a u_a, grad u = sum_a u_a (x) dN_a. The nodes are
/// those of the cell with their masters in place of slaves, so that mass and forces never meet a slave.
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

/// Tangent stiffness of one cell at rest, weighted: dofs are component c of corner a at dim * a + c.
using CellStiffness = Eigen::MatrixXd;

/// Integration points of outer boundary faces of weighted cells owned by this rank, in the current configuration.
struct SurfacePoints
{
  Eigen::Matrix3Xd position; ///< [m]
  Eigen::Matrix3Xd velocity; ///< [m/s]
  Eigen::VectorXd area;      ///< alpha-weighted reference area of the point [m^2] (2D: [m] per metre)
  Eigen::Matrix3Xd normal;   ///< outer
  Eigen::VectorXd weight;    ///< alpha, mean of the cell behind the face [-]
};

/// Where forces on the surface come from: their work is counted apart.
enum class SurfaceLoad
{
  tool,
  loose ///< particles that have come off the rock
};

/// Tells whether anything within @p radius of @p centre can matter [m].
using NearTest = std::function<bool(const Eigen::Vector3d &centre, double radius)>;

struct Energies
{
  double kinetic = 0.; ///< weighted [J]
  /// What a finite step adds to it, -dt^2/8 sum f^2/m over free components: m/2 v^{n-1/2} v^{n+1/2} grows by exactly the work
  /// of all forces by the trapezoidal rule, so balances of energy hold with it [J].
  double finite_step = 0.;
  double elastic = 0.;  ///< weighted [J]
  double boundary = 0.; ///< work done on the rock by velocity boundaries, tractions and gravity since the start [J]
  double absorbed = 0.; ///< taken away by absorbing boundaries since the start [J]
  std::array<double, 2> surface = {{0., 0.}}; ///< work of each SurfaceLoad since the start (trapezoidal rule) [J]
};

/// The part of the finite elements that a contact with their surface needs.
struct SurfaceContact
{
  virtual ~SurfaceContact() = default;

  /// Points of the outer boundary that lie in the box [lower, upper] [m] (current positions, whole faces), on faces whose
  /// enclosing ball is @p near; without a test on all of them. Not collective.
  virtual void surface_points(const Eigen::Vector3d &lower, const Eigen::Vector3d &upper, const NearTest &near,
                              SurfacePoints &points) const = 0;
  /// Adds forces [N] at the points of the last surface_points() call. Collective.
  virtual void add_surface_forces(const Eigen::Matrix3Xd &forces, SurfaceLoad source) = 0;
};

/// One explicit step (velocity Verlet = central differences, Verlet with lumped mass) is
/// begin_step(dt); compute_forces(t); ...forces added from outside...; end_step(dt).
/// All functions are collective unless stated; energies and steps are the same on every rank.
class FemSide : public SurfaceContact
{
public:
  virtual ~FemSide() = default;

  virtual const Mesh &mesh() const = 0;

  /// Reference coordinates of the quadrature points of the cells this rank owns, n_q = 2^dim points a cell,
  /// column = local_cell * n_q + q. Not collective.
  virtual const Eigen::Matrix3Xd &quadrature_points() const = 0;
  virtual const std::vector<int> &owned_cells() const = 0;

  /// Where points [m] of the reference configuration lie (points on a face: any of its cells), across periodic axes they or
  /// their images. Not collective.
  virtual std::vector<Interpolation> locate(const Eigen::Matrix3Xd &points) const = 0;

  /// Weight alpha in [0,1] at every quadrature point (same order as quadrature_points()). A cell whose points are all
  /// zero is switched off. Recomputes the lumped masses; nodes without mass stop moving. Kinematics are untouched.
  /// Starts with 1 everywhere.
  virtual void set_weights(const Eigen::VectorXd &alpha) = 0;
  virtual int n_active_cells() const = 0; ///< over all ranks

  /// v += dt/2 f/M, u += dt v; @p time is that of the new positions (for prescribed velocities).
  virtual void begin_step(double dt, double time) = 0;
  /// f = -f_int(u) + boundary forces; anything added before is lost.
  virtual void compute_forces() = 0;
  /// v += dt/2 f/M, with prescribed velocities enforced.
  virtual void end_step(double dt, double time) = 0;

  /// Chooses the nodes whose values this rank wants to read and push, wherever they are owned.
  virtual void set_window(const std::vector<int> &nodes) = 0;
  /// Values of the window nodes, 3 x n_window, in the order given to set_window().
  virtual void read_window(NodalField field, Eigen::Matrix3Xd &values) const = 0;
  /// Adds forces [N] to the window nodes; the exact transpose of read_window().
  virtual void add_window_forces(const Eigen::Matrix3Xd &forces) = 0;

  virtual CellStress cell_stress() const = 0;

  /// Sets displacement [m] and velocity [m/s] of all nodes from functions of the reference position (initial conditions,
  /// tests).
  virtual void set_state(const Eigen::Matrix3Xd &displacement, const Eigen::Matrix3Xd &velocity) = 0;
  /// All nodal values, gathered on every rank (output, tests): 3 x n_nodes. Masses and forces of slaves are zero, as their
  /// masters have them.
  virtual Eigen::Matrix3Xd gather(NodalField field) const = 0;

  virtual Energies energies() const = 0;
  /// Stiffness of @p cells that this rank owns, for the present weights, in the reference configuration [N/m]; cells that are
  /// switched off give zero. Not collective.
  virtual std::vector<CellStiffness> cell_stiffness(const std::vector<int> &cells) const = 0;
  /// Largest stable step of central differences for the present weights: 2/omega_max by power iteration [s].
  virtual double stable_step() const = 0;

  /// Writes one VTU file for all ranks: displacement, velocity, stress, alpha, user cell fields.
  /// @p cell_fields: name and one value for every mesh cell.
  virtual void write_vtu(const std::string &path,
                         const std::vector<std::pair<std::string, Eigen::VectorXd>> &cell_fields) const = 0;
};

/// Faces that a condition selects, one flag for each of mesh.boundary. Throws std::runtime_error with one line when there is
/// none or the expression cannot be understood.
std::vector<char> selected_faces(const Mesh &mesh, const BoundaryCondition &condition);

/// The homogeneous deformation that carries Settings::initial_stress: u = gradient (X - anchor), the anchor being the middle of
/// the mesh's top side (largest y), where tools come from.
struct InitialState
{
  Eigen::Matrix3d gradient = Eigen::Matrix3d::Zero();    ///< du/dX, symmetric [-]
  Eigen::Matrix3d first_piola = Eigen::Matrix3d::Zero(); ///< its traction on a face is first_piola times the outer normal [Pa]
};
/// Throws std::runtime_error with one line when the material cannot carry the stress.
InitialState initial_state(const Settings &settings);

/// Builds the mesh and the solver. Throws std::runtime_error with one line on a mesh that cannot be used.
std::unique_ptr<FemSide> make_fem_side(const Settings &settings);

/// Version string of the finite-element library.
std::string library_version();
} // namespace kerf::fem
