// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "tests/support/coupled_strip.h"

#include <Eigen/Eigenvalues>
#include <complex>

/// Plane wave packets along x that run in one direction only, on either side of a strip.
namespace kerf::test
{
/// A plane wave exp(i k x) of unit displacement: frequency, and rotation of the particles for that displacement.
struct PlaneWave
{
  double omega = 0.;
  std::complex<double> rotation = 0.;
};

/// Of a triangular lattice: dynamical matrix of the three bonds of a particle, for displacements and the rotation.
/// @param direction 0: P, 1: S
inline PlaneWave lattice_wave(const StripCase &strip, double k, int direction)
{
  using Complex = std::complex<double>;
  using Matrix = Eigen::Matrix3cd;
  const double d = Strip::d,
               mass = strip.packing.particle_density(strip.settings.body.material.density) * strip.packing.volume(0);
  Matrix D = Matrix::Zero();
  for (const double angle : {M_PI / 6., M_PI / 2., 5. * M_PI / 6.})
  {
    const Eigen::Vector2d n(std::cos(angle), std::sin(angle)), t(-n[1], n[0]);
    const Complex phase = std::exp(Complex(0., k * d * n[0]));
    Eigen::Matrix<Complex, 2, 3> gap; // normal, tangential
    for (int c = 0; c < 2; ++c)
    {
      gap(0, c) = (phase - 1.) * n[c];
      gap(1, c) = (phase - 1.) * t[c];
    }
    gap(0, 2) = 0.;
    gap(1, 2) = -0.5 * d * (1. + phase);
    const Eigen::DiagonalMatrix<double, 2> stiffness(strip.settings.bond.k_n, strip.settings.bond.k_t);
    D += gap.adjoint() * stiffness * gap;
  }
  const Eigen::Vector3d root = Eigen::Vector3d(mass, mass, mass * d * d / 8.).cwiseSqrt().cwiseInverse();
  const Eigen::SelfAdjointEigenSolver<Matrix> solver(root.asDiagonal() * D * root.asDiagonal());
  int mode = -1; // the lower one of those that move along the direction
  for (int m = 0; m < 3 && mode < 0; ++m)
    if (std::abs(solver.eigenvectors()(direction, m)) > 0.6)
      mode = m;
  PlaneWave wave;
  wave.omega = std::sqrt(solver.eigenvalues()[mode]);
  wave.rotation = root[2] * solver.eigenvectors()(2, mode) / (root[direction] * solver.eigenvectors()(direction, mode));
  return wave;
}

/// Of the rock itself: rotation = curl/2.
inline PlaneWave continuum_wave(const Case &settings, double k, int direction)
{
  PlaneWave wave;
  wave.omega = k * (direction == 0 ? settings.body.material.speed_p() : settings.body.material.speed_s());
  wave.rotation = direction == 0 ? 0. : std::complex<double>(0., 0.5 * k);
  return wave;
}

/// Of rows of cells of length h with lumped masses: omega = 2 c/h sin(k h/2).
inline PlaneWave cells_wave(const Case &settings, double k, int direction)
{
  PlaneWave wave = continuum_wave(settings, k, direction);
  const double h = settings.body.mesh.cell_size;
  wave.omega *= std::sin(0.5 * k * h) / (0.5 * k * h);
  return wave;
}

/// A Gaussian packet of waves that all run to the same side.
class PlanePacket
{
public:
  struct State
  {
    double u = 0., v = 0., rotation = 0., spin = 0.;
  };
  /// @param length of the mean wave [m]; the envelope exp(-(x - centre)^2/(2 length^2)). @param side +1: runs to the right
  template <typename Wave>
  PlanePacket(double centre, double length, int side, double amplitude, const Wave &wave_at) : centre(centre)
  {
    constexpr int half = 60;
    const double mean = 2. * M_PI / length, spread = 1. / length, step = 4. * spread / half;
    double sum = 0.;
    for (int i = -half; i <= half; ++i)
    {
      const double k = mean + i * step;
      if (k <= 0.)
        continue;
      Component part;
      part.k = k;
      part.wave = wave_at(k);
      part.amplitude = std::exp(-0.5 * std::pow((k - mean) / spread, 2));
      part.side = side;
      parts.push_back(part);
      sum += part.amplitude;
    }
    for (Component &part : parts)
      part.amplitude *= amplitude / sum;
  }

  State at(double x) const
  {
    State state;
    for (const Component &part : parts)
    {
      const std::complex<double> u = part.amplitude * std::exp(std::complex<double>(0., part.k * (x - centre)));
      const std::complex<double> rate(0., -part.side * part.wave.omega); // exp(i (k x - side omega t))
      state.u += u.real();
      state.v += (rate * u).real();
      state.rotation += (part.wave.rotation * u).real();
      state.spin += (rate * part.wave.rotation * u).real();
    }
    return state;
  }

private:
  struct Component
  {
    double k = 0., amplitude = 0.;
    PlaneWave wave;
    int side = 1;
  };
  double centre;
  std::vector<Component> parts;
};

/// Puts a packet on the particles of a started body that is at rest.
inline void put_on_particles(Body &body, const PlanePacket &packet, int direction)
{
  dem::Particles particles = body.model.dem().particles();
  for (int i = 0; i < particles.n; ++i)
  {
    const PlanePacket::State state = packet.at(body.packing.positions(0, particles.index[i]));
    particles.position(direction, i) += state.u;
    particles.velocity(direction, i) = state.v;
    particles.angular_velocity(2, i) = state.spin;
    const Eigen::Vector4d turned(std::cos(0.5 * state.rotation), 0., 0., std::sin(0.5 * state.rotation));
    Eigen::Map<Eigen::Vector4d>(particles.rotation + 4 * i) = turned;
  }
  body.model.dem().setup([](dem::Phase, dem::Particles &) {}); // the finite elements and the overlap are at rest
}

/// Gives a body that is not started a packet on its nodes.
inline void put_on_nodes(Body &body, const PlanePacket &packet, int direction)
{
  body.set_state(
    [&](const Eigen::Vector3d &x) { return Eigen::Vector3d(packet.at(x[0]).u * Eigen::Vector3d::Unit(direction)); },
    [&](const Eigen::Vector3d &x) { return Eigen::Vector3d(packet.at(x[0]).v * Eigen::Vector3d::Unit(direction)); });
}

/// Energies relative to that of the packet.
struct Passage
{
  double returned = 0., lost = 0.;
};

/// @param length of the waves in diameters. The packet starts four lengths from the overlap and the run ends when what comes
/// back and what goes through have both left it.
inline Passage pass(const Case &method, double length, int direction, bool from_particles)
{
  Strip shape;
  const double wave = length * Strip::d;
  shape.region = shape.fem = static_cast<int>(std::ceil(8.5 * wave / shape.cell_length()));
  StripCase strip(shape);
  strip.settings.constraint = method.constraint;
  Body body(strip.settings, strip.packing, Mode::fixed);
  const double amplitude = 1e-6 * Strip::d;
  double speed = 0.; // of the energy
  if (from_particles)
  {
    const auto at = [&](double k) { return test::lattice_wave(strip, k, direction); };
    body.model.start();
    put_on_particles(body, PlanePacket(shape.region_end() - 4. * wave, wave, 1, amplitude, at), direction);
    const double k = 2. * M_PI / wave;
    speed = (at(1.01 * k).omega - at(0.99 * k).omega) / (0.02 * k);
  }
  else
  {
    const auto at = [&](double k) { return test::cells_wave(strip.settings, k, direction); };
    const double centre = shape.region_end() + shape.overlap_width() + 4. * wave;
    put_on_nodes(body, PlanePacket(centre, wave, -1, amplitude, at), direction);
    body.model.start();
    const double k = 2. * M_PI / wave;
    speed = (at(1.01 * k).omega - at(0.99 * k).omega) / (0.02 * k);
  }
  const double before = body.model.energies().held();
  body.model.advance(static_cast<int>((8. * wave + shape.overlap_width()) / (speed * body.dt)));
  const EnergyLedger energy = body.model.energies();
  const fem::Energies fem = body.fem->energies();
  const dem::Energies dem = body.model.dem().energies();
  Passage result;
  result.returned = from_particles ? (dem.kinetic + dem.elastic) / before : (fem.kinetic + fem.elastic) / before;
  result.lost = 1. - energy.held() / before;
  return result;
}

/// What an overlap sends back in a random packing, relative to the packet: energy of the difference between the coupled strip
/// and particles alone in what both model by particles, after the packet has passed. A packing scatters waves itself; @p
/// scattered is what is left behind of the packet in the run of particles alone. One rank.
inline double sent_back(const Case &method, int seed, double length, int direction, double &scattered)
{
  Strip shape;
  const double wave = length * Strip::d;
  shape.random = true;
  shape.seed = seed;
  shape.region = shape.fem = static_cast<int>(std::ceil(8.5 * wave / shape.cell_length()));
  shape.high = 5;
  StripCase strip(shape);
  strip.settings.constraint = method.constraint;
  strip.settings.activation.relaxation_steps = 0; // at rest as stored
  const auto at = [&](double k) { return continuum_wave(strip.settings, k, direction); };
  const PlanePacket packet(shape.region_end() - 4. * wave, wave, 1, 1e-6 * Strip::d, at);

  Body coupled(strip.settings, strip.packing, Mode::fixed);
  Body particles(strip.settings, strip.packing, coupled.dt, Mode::dem);
  for (Body *body : {&coupled, &particles})
  {
    body->model.start();
    put_on_particles(*body, packet, direction);
  }
  const double before = particles.model.energies().held();
  const double speed = direction == 0 ? strip.settings.body.material.speed_p() : strip.settings.body.material.speed_s();
  const int steps = static_cast<int>((6. * wave + shape.overlap_width()) / (speed * coupled.dt));
  constexpr int samples = 10, apart = 5;
  coupled.model.advance(steps - samples * apart);
  particles.model.advance(steps - samples * apart);
  double difference = 0.;
  scattered = 0.;
  for (int k = 0; k < samples; ++k)
  {
    coupled.model.advance(apart);
    particles.model.advance(apart);
    const dem::Particles one = coupled.model.dem().particles(), all = particles.model.dem().particles();
    std::vector<int> place(strip.packing.size());
    for (int i = 0; i < all.n; ++i)
      place[all.index[i]] = i;
    for (int i = 0; i < one.n; ++i)
      if (strip.packing.positions(0, one.index[i]) < shape.region_end())
      {
        // Twice the kinetic energy is the energy, on an average.
        const int j = place[one.index[i]];
        difference += all.mass[j] * (one.velocity.col(i) - all.velocity.col(j)).squaredNorm() / samples;
        scattered += all.mass[j] * all.velocity.col(j).squaredNorm() / samples;
      }
  }
  scattered /= before;
  return difference / before;
}
} // namespace kerf::test
