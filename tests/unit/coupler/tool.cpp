// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/loading/tool/tool.h"
#include "coupler/method/activation/stress_criterion.h"
#include "tests/support/dummy_fem_side.h"

#include <gtest/gtest.h>

#include <cmath>

using namespace kerf;
using Eigen::Vector3d;

// Straight parts of the path are exact (1e-13: round-off of an integral of size 10 over a window of 0.2), the velocity is the
// derivative of the position and has no jumps.
TEST(ToolPath, SmoothAndExact)
{
  const double window = 0.2;
  const ToolPath path({{0., Vector3d(0., 1., 0.)}, {1., Vector3d(0., 0., 0.)}, {3., Vector3d(4., 0., 0.)}}, window);
  EXPECT_LT((path.position(0.5) - Vector3d(0., 0.5, 0.)).norm(), 1e-13);
  EXPECT_LT((path.velocity(0.5) - Vector3d(0., -1., 0.)).norm(), 1e-13);
  EXPECT_LT((path.position(2.) - Vector3d(2., 0., 0.)).norm(), 1e-13);
  EXPECT_LT((path.position(5.) - Vector3d(4., 0., 0.)).norm(), 1e-13);
  EXPECT_LT(path.velocity(5.).norm(), 1e-14);
  const double step = 1e-6;
  for (double t = -0.3; t < 3.5; t += 0.0137)
  {
    const Vector3d slope = (path.position(t + step) - path.position(t - step)) / (2. * step);
    EXPECT_LT((slope - path.velocity(t)).norm(), 1e-5); // central difference: kinks of the velocity give step/window
    EXPECT_LT((path.velocity(t + step) - path.velocity(t)).norm(), 2. * step * 3. / window); // bounded acceleration
  }
}

TEST(ContactLaw, SpringWithoutTensionAndCoulombBound)
{
  const ContactLaw law{0.3};
  const Vector3d n = Vector3d::UnitY();
  EXPECT_EQ(law.force(1e-6, n, Vector3d::Zero(), 1e9, 10.), Vector3d::Zero());
  EXPECT_NEAR(law.force(-1e-3, n, Vector3d::Zero(), 1e9, 10.)[1], 1e6, 1e-6);
  // Separating fast: the dashpot would pull, the contact must not.
  EXPECT_EQ(law.force(-1e-9, n, Vector3d(0., 1e3, 0.), 1e9, 1e6)[1], 0.);
  // Sliding fast: exactly mu F_n against the sliding velocity. Sliding slowly: the dashpot alone.
  const Vector3d fast = law.force(-1e-3, n, Vector3d(1e9, 0., 0.), 1e9, 10.);
  EXPECT_NEAR(fast[0], -0.3 * 1e6, 1e-6);
  EXPECT_NEAR(law.force(-1e-3, n, Vector3d(1e-2, 0., 0.), 1e9, 10.)[0], -0.1, 1e-12);
}

// Tool on one particle: force, reaction and power follow from the law; a rolling disc does not slide over a fixed surface.
TEST(Tool, ContactWithOneParticle)
{
  ToolSettings settings;
  settings.radius = 2.;
  settings.path = {{0., Vector3d(0., 2.45, 0.)}, {1., Vector3d(3., 2.45, 0.)}};
  settings.smoothing_time = 0.;
  settings.stiffness_ratio = 2.;
  settings.friction = 0.5;
  settings.damping = 0.1;
  settings.rolling = true;
  Tool tool(settings, 2, 1e4, 1., 1000., MPI_COMM_WORLD);
  tool.move_to(0.);
  Eigen::Matrix3Xd x = Eigen::Matrix3Xd::Zero(3, 1);
  test::DummyParticles particles(x);
  particles.weight[0] = 0.25;
  test::DummyFemSide fem(1, 1, 1., 1.);
  dem::Particles view = particles.view();
  tool.apply(view, fem);
  // Overlap 2 + 0.5 - 2.45 = 0.05; stiffness = weight 0.25 x ratio 2 x k_n.
  EXPECT_NEAR(particles.f(1, 0), -0.25 * 2. * 1e4 * 0.05, 1e-9);
  EXPECT_NEAR(particles.f(0, 0), 0., 1e-9); // v_x + spin R = 0 at the lowest point
  EXPECT_NEAR(tool.total(tool.local_load()).force[1], particles.f(1, 0), 1e-9);
  EXPECT_NEAR(tool.local_load().power, 0., 1e-9);
}

namespace
{
ToolSettings rolling_disc(double width)
{
  ToolSettings settings;
  settings.radius = 2.;
  settings.width = width;
  settings.path = {{0., Vector3d(0., 2.45, 0.7)}, {1., Vector3d(3., 2.45, 0.7)}};
  settings.smoothing_time = 0.;
  settings.rolling = true;
  return settings;
}
} // namespace

// On the rim, on a flat side and on the half circle between them, outside and inside.
TEST(Disc, NearestPlaceOfARoundRim)
{
  Disc disc(rolling_disc(0.8));
  disc.move_to(0.5);
  const Vector3d centre(1.5, 2.45, 0.7);
  const Vector3d radial(0.6, -0.8, 0.), axial = Vector3d::UnitZ(), between = 0.8 * radial + 0.6 * axial;
  for (const double gap : {-0.1, 0.3})
  {
    const NearestSurface rim = disc.nearest(centre + (2. + gap) * radial);
    EXPECT_NEAR(rim.gap, gap, 1e-14);
    EXPECT_LT((rim.normal - radial).norm(), 1e-14);
    const NearestSurface side = disc.nearest(centre + 1.2 * radial - (0.4 + gap) * axial);
    EXPECT_NEAR(side.gap, gap, 1e-14);
    EXPECT_LT((side.normal + axial).norm(), 1e-14);
    const NearestSurface edge = disc.nearest(centre + 1.6 * radial + (0.4 + gap) * between);
    EXPECT_NEAR(edge.gap, gap, 1e-14);
    EXPECT_LT((edge.normal - between).norm(), 1e-14);
    // Rolling to the right turns clockwise: v = v_c + spin x arm, spin = -3/2.
    const Vector3d arm = 1.6 * radial + 0.4 * between;
    EXPECT_LT((edge.velocity - Vector3d(3., 0., 0.) - Vector3d(1.5 * arm[1], -1.5 * arm[0], 0.)).norm(), 1e-14);
  }
  EXPECT_LT(disc.nearest(centre - 2. * Vector3d::UnitY()).velocity.norm(), 1e-14);
}

// The search for contacts relies on it: the gap is a distance, it changes by no more than the point moves, and the normal is
// its gradient; the box holds what is nearer than its reach.
TEST(Disc, GapIsADistance)
{
  for (const double width : {0., 0.8})
  {
    Disc disc(rolling_disc(width));
    disc.move_to(0.);
    const double step = 1e-6;
    const Box box = disc.bounds(0.25);
    Vector3d before = disc.centre;
    for (int k = 1; k < 400; ++k)
    {
      const Vector3d point = disc.centre + Vector3d(2.6 * std::sin(1.3 * k), 2.6 * std::sin(2.1 * k), 0.9 * std::sin(3.7 * k));
      const NearestSurface there = disc.nearest(point);
      EXPECT_LE(std::abs(there.gap - disc.nearest(before).gap), (1. + 1e-14) * (point - before).norm());
      const bool inside = ((point - box.lower).array() > 0.).all() && ((box.upper - point).array() > 0.).all();
      EXPECT_TRUE(inside || there.gap > 0.25);
      Vector3d slope;
      for (int c = 0; c < 3; ++c)
        slope[c] = (disc.nearest(point + step * Vector3d::Unit(c)).gap - disc.nearest(point - step * Vector3d::Unit(c)).gap) /
                   (2. * step);
      EXPECT_LT((slope - there.normal).norm(), 1e-4) << point.transpose(); // curvature 1/(distance from the flat disc)
      before = point;
    }
  }
}

// The surface of the finite elements pushes back like particles d apart: one on each length d in the plane, on each d^2 in
// space.
TEST(Tool, SurfaceIsAsStiffAsParticles)
{
  class WithPoint : public test::DummyFemSide
  {
  public:
    WithPoint() : DummyFemSide(1, 1, 1., 1.) {}
    void surface_points(const Vector3d &, const Vector3d &, const fem::NearTest &near,
                        fem::SurfacePoints &points) const override
    {
      EXPECT_TRUE(near(place, 0.));
      EXPECT_FALSE(near(Vector3d(0., -0.5, 0.7), 0.9)); // 0.05 away
      points.position = place;
      points.velocity = Vector3d::Zero();
      points.area = Eigen::VectorXd::Constant(1, 0.02);
    }
    void add_surface_forces(const Eigen::Matrix3Xd &forces, fem::SurfaceLoad) override { pushed = forces.col(0); }
    const Vector3d place = Vector3d(0., 0.46, 0.7); // 0.01 inside
    Vector3d pushed = Vector3d::Zero();
  };
  ToolSettings settings = rolling_disc(0.8);
  settings.stiffness_ratio = 2.;
  const double d = 0.1, k_n = 1e4;
  Eigen::Matrix3Xd nothing(3, 0);
  test::DummyParticles none(nothing);
  for (const int dim : {2, 3})
  {
    Tool tool(settings, dim, k_n, d, 1000., MPI_COMM_WORLD);
    WithPoint fem;
    dem::Particles view = none.view();
    tool.apply(view, fem);
    const double expected = 2. * k_n / std::pow(d, dim - 1) * 0.02 * 0.01;
    EXPECT_LT((fem.pushed + expected * Vector3d::UnitY()).norm(), 1e-12 * expected);
    EXPECT_NEAR(tool.local_load().force[1], -expected, 1e-12 * expected);
  }
}

TEST(Tool, ClearanceOfTheDisc)
{
  const test::DummyFemSide boundaryless(2, 2, 1., 1.);
  ToolSettings settings;
  settings.radius = 0.5;
  settings.path = {{0., Vector3d(1., 3., 0.)}};
  // The dummy has no boundary faces: build them for the top side only.
  class WithTop : public test::DummyFemSide
  {
  public:
    WithTop() : DummyFemSide(2, 2, 1., 1.), copy(DummyFemSide::mesh())
    {
      copy.boundary.push_back({3, 2, {{6, 7, -1, -1}}});
      copy.boundary.push_back({3, 3, {{7, 8, -1, -1}}});
    }
    const fem::Mesh &mesh() const override { return copy; }

  private:
    fem::Mesh copy;
  } fem;
  EXPECT_NEAR(Tool::clearance(settings, fem), 0.5, 1e-14); // centre 1 above the top
  settings.path = {{0., Vector3d(1., 2.3, 0.)}};
  EXPECT_NEAR(Tool::clearance(settings, fem), -0.2, 1e-14);
  settings.path = {{0., Vector3d(1., 1.5, 0.)}};
  EXPECT_NEAR(Tool::clearance(settings, fem), -1., 1e-14);
}

TEST(StressMeasure, ClosedAnswers)
{
  using Stress = Eigen::Matrix<double, 6, 1>;
  Stress uniaxial = Stress::Zero();
  uniaxial[1] = 3e6;
  const double f_t = 5e6, f_c = 50e6;
  EXPECT_NEAR(stress_measure(Criterion::maximum_principal, uniaxial, f_t, f_c), 3e6, 1e-6);
  EXPECT_NEAR(stress_measure(Criterion::von_mises, uniaxial, f_t, f_c), 3e6, 1e-6);
  EXPECT_NEAR(stress_measure(Criterion::mohr_coulomb, uniaxial, f_t, f_c), 3e6, 1e-6);
  EXPECT_NEAR(stress_measure(Criterion::drucker_prager, uniaxial, f_t, f_c), 3e6, 1e-6);
  Stress compression = Stress::Zero();
  compression[1] = -50e6; // at failure the measure is the tensile strength
  EXPECT_NEAR(stress_measure(Criterion::mohr_coulomb, compression, f_t, f_c), f_t, 1e-3);
  EXPECT_NEAR(stress_measure(Criterion::drucker_prager, compression, f_t, f_c), f_t, 1e-3);
  EXPECT_NEAR(stress_measure(Criterion::maximum_principal, compression, f_t, f_c), 0., 1e-3);
  Stress shear = Stress::Zero();
  shear[5] = 2e6;
  EXPECT_NEAR(stress_measure(Criterion::von_mises, shear, f_t, f_c), 2e6 * std::sqrt(3.), 1e-6);
  EXPECT_NEAR(stress_measure(Criterion::maximum_principal, shear, f_t, f_c), 2e6, 1e-6);
  EXPECT_NEAR(stress_measure(Criterion::mohr_coulomb, shear, f_t, f_c), 2e6 * (1. + f_t / f_c), 1e-6);
  EXPECT_NEAR(stress_measure(Criterion::drucker_prager, shear, f_t, f_c), std::sqrt(3.) * 1e6 * (1. + f_t / f_c), 1e-6);
}

// Cells are passed over by the norm of their stress, so no criterion may measure more than it promises, whatever the strengths.
TEST(StressMeasure, IsBoundedByTheNorm)
{
  using Stress = Eigen::Matrix<double, 6, 1>;
  std::srand(1);
  double closest = 0.;
  for (int k = 0; k < 2000; ++k)
  {
    Stress sigma = Stress::Random();
    if (k % 2 == 1)
      sigma.head<3>().setConstant(sigma[0]); // nearly isotropic: the largest trace for a norm
    const double f_t = 1., f_c = k % 3 == 0 ? 0.5 : k % 3 == 1 ? 1. : 20.;
    const double norm = std::sqrt(sigma.head<3>().squaredNorm() + 2. * sigma.tail<3>().squaredNorm());
    sigma *= norm_below(7., f_t, f_c) / norm;
    for (const Criterion criterion :
         {Criterion::maximum_principal, Criterion::von_mises, Criterion::mohr_coulomb, Criterion::drucker_prager})
      closest = std::max(closest, stress_measure(criterion, sigma, f_t, f_c));
  }
  EXPECT_LE(closest, 7.);
  EXPECT_GT(closest, 4.); // and it is worth asking
}
