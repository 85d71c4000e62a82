// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/application/output/field_output.h"
#include "dem_side/packing/hdf5_file.h"

namespace kerf
{
namespace
{
/// Row-major storage, as in the file.
using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

void write_vectors(Hdf5Writer &file, const std::string &name, const Eigen::Matrix3Xd &columns)
{
  const Rows rows = columns.transpose();
  file.table(name, rows.data(), rows.rows(), 3);
}

void write_values(Hdf5Writer &file, const std::string &name, const Eigen::VectorXd &values)
{
  file.table(name, values.data(), values.size());
}
} // namespace

void FieldOutput::write_mesh(const fem::Mesh &mesh) const
{
  Hdf5Writer file(directory + "/fields/mesh.h5");
  write_vectors(file, "nodes", mesh.nodes);
  file.table("cells", mesh.cells.data(), mesh.cells.cols(), mesh.cells.rows());
  file.close();
}

void FieldOutput::write_snapshot(CoupledModel &model, const std::string &stamp, const ParticleFields &fields,
                                 const Eigen::Matrix3Xd &displacement, const Eigen::VectorXd &alpha,
                                 const Eigen::VectorXd &measure) const
{
  Hdf5Writer file(directory + "/fields/snapshot_" + stamp + ".h5");
  file.attribute("time", model.time());
  file.attribute("step", static_cast<std::int64_t>(model.step()));
  if (const Disc *disc = model.tool().disc())
  {
    file.attribute("tool_radius", disc->radius);
    file.attribute("tool_angle", disc->angle);
    file.attribute("tool_center", std::vector<double>(disc->centre.data(), disc->centre.data() + 3));
  }
  const std::array<double, 2> platens = model.tool().platens();
  if (platens[0] != platens[1])
    file.attribute("platens", std::vector<double>(platens.begin(), platens.end()));
  write_vectors(file, "fem_displacement", displacement);
  write_values(file, "cell_alpha", alpha);
  write_values(file, "cell_stress", measure);
  file.table("particle_index", fields.index.data(), fields.index.size());
  write_vectors(file, "particle_position", fields.position);
  write_vectors(file, "particle_velocity", fields.velocity);
  write_values(file, "particle_radius", fields.radius);
  write_values(file, "particle_weight", fields.weight);
  write_values(file, "particle_damage", fields.damage);
  Eigen::Matrix3Xd broken(3, fields.broken.size());
  for (std::size_t k = 0; k < fields.broken.size(); ++k)
    broken.col(k) = fields.broken[k].position;
  write_vectors(file, "bond_broken_position", broken);
  file.close();
}
} // namespace kerf
