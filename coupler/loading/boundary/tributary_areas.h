// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/packing/packing.h"
#include "fem_side/fem_side.h"

#include <utility>
#include <vector>

namespace kerf
{
/// A particle that ends at a face of the boundary.
struct ParticleAtFace
{
  int particle = -1;                                ///< index in the packing
  Eigen::Vector3d normal = Eigen::Vector3d::Zero(); ///< outer, of the first such face
};

/// Particles that end at one of the chosen faces, by rising index. A particle ends at a face when its gap to the face exceeds
/// the smallest gap by less than half a mean radius; the smallest gap is zero but for lattices that do not fit. There are none
/// where the packing ends more than about a radius before the faces.
/// @param faces one flag for each face of mesh.boundary
std::vector<ParticleAtFace> particles_at_faces(const fem::Mesh &mesh, const std::vector<char> &faces,
                                               const dem::Packing &packing);

/// The part of a face that a particle stands for, with the weight of the particles there.
struct TributaryArea
{
  int particle = -1;                                ///< index in the packing
  Eigen::Vector3d normal = Eigen::Vector3d::Zero(); ///< outer
  double area = 0.;                                 ///< reference area times weight [m^2], 2D [m]
};

/// Division of chosen faces among the particles that end at them (particles_at_faces()). Every point of the faces
/// (fem::face_points()) belongs to the particle whose surface is nearest to it, in equal parts if there are several. It counts
/// with the weight of the particles at the point, whatever that at the centre is. So the shares of both models in a load sum
/// to one at every point, and the total is exact. Theory (9.14).
class TributaryAreas
{
public:
  /// @param faces one flag for each face of mesh.boundary. @param spacing of the points [m], fem::Settings::surface_spacing.
  /// The weights are one at the start.
  TributaryAreas(const fem::Mesh &mesh, const std::vector<char> &faces, const dem::Packing &packing, double spacing);

  const Eigen::Matrix3Xd &points() const { return positions; } ///< [m]
  /// @param weights of the particles at points(), zero to one. @param takes flags of the particles that can bear a load, by
  /// index in the packing. The share of any other one goes to the nearest particle that can.
  void set_weights(const Eigen::VectorXd &weights, const std::vector<char> &takes);
  /// All weights one, all particles bear loads.
  void set_whole();

  /// By rising particle. A particle occurs once for each direction of its normals.
  const std::vector<TributaryArea> &areas() const { return shares; }
  /// Mean weight of the area of each particle by index in the packing [-]; -1: it has none, also with weights of one.
  std::vector<double> mean_weights() const;

private:
  struct Part
  {
    int point, particle;
    double fraction; // of the area of the point
  };
  template <typename Weight, typename Owner>
  void add_up(const Weight &weight, const Owner &owner);

  const dem::Packing &packing;
  Eigen::Matrix3Xd positions, area_vectors; // of points
  std::vector<int> at_faces;                // particles
  std::vector<Part> parts;
  std::vector<TributaryArea> shares;
};
} // namespace kerf
