// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/application/output/field_output.h"

#include "coupler/application/output/written.h"
#include "coupler/base/errors.h"
#include "coupler/base/mesh_geometry.h"
#include "coupler/base/mpi_helpers.h"

#include <deal.II/base/data_out_base.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <unordered_map>

namespace kerf
{
namespace
{
using Range =
  std::tuple<unsigned int, unsigned int, std::string, dealii::DataComponentInterpretation::DataComponentInterpretation>;

using Field = std::pair<std::string, std::string>; // name and unit
const Field displacement_field = {"displacement", "m"}, velocity_field = {"velocity", "m/s"}, radius_field = {"radius", "m"};

/// Points (dim 0) or lines (dim 1) with data at their ends, for the VTU writer of deal.II.
template <int dim>
class Cloud : public dealii::DataOutInterface<dim, 3>
{
public:
  using Patch = dealii::DataOutBase::Patch<dim, 3>;

  /// @param fields names and units of the data; three of the same name in a row are a vector
  explicit Cloud(const std::vector<Field> &fields) : units(fields.begin(), fields.end())
  {
    for (const auto &field : fields)
      names.push_back(field.first);
    for (unsigned int n = 0; n + 2 < this->names.size(); ++n)
      if (this->names[n] == this->names[n + 1] && this->names[n] == this->names[n + 2])
        vectors.push_back({n, n + 2, this->names[n], dealii::DataComponentInterpretation::component_is_part_of_vector});
  }

  /// @param values one column for each end point, one row for each name
  void add(const Eigen::Matrix<double, 3, dim + 1> &ends, const Eigen::MatrixXd &values)
  {
    Patch patch;
    set_shape(patch);
    for (int v = 0; v <= dim; ++v)
      for (int c = 0; c < 3; ++c)
        patch.vertices[v][c] = ends(c, v);
    patch.patch_index = static_cast<unsigned int>(patches.size());
    patch.data.reinit(names.size(), dim + 1);
    for (std::size_t n = 0; n < names.size(); ++n)
      for (int v = 0; v <= dim; ++v)
        patch.data(n, v) = static_cast<float>(values(n, v));
    patches.push_back(std::move(patch));
  }

  void write(const std::string &path)
  {
    std::ofstream file(path);
    if (patches.empty())
    {
      write_empty(file);
      check_written(file, path);
      return;
    }
    dealii::DataOutBase::VtkFlags flags;
    flags.compression_level = dealii::DataOutBase::VtkFlags::best_speed; // the default is many times slower
    flags.physical_units = units;
    this->set_flags(flags);
    try
    {
      this->write_vtu(file);
    }
    catch (const dealii::ExceptionBase &) // its text is long; the next line says the same
    {
    }
    check_written(file, path);
  }

private:
  const std::vector<Patch> &get_patches() const override { return patches; }
  std::vector<std::string> get_dataset_names() const override { return names; }
  std::vector<Range> get_nonscalar_data_ranges() const override { return vectors; }

  /// A patch has no shape by default, and then its file no cells. Points have theirs.
  static void set_shape(dealii::DataOutBase::Patch<0, 3> &) {}
  static void set_shape(dealii::DataOutBase::Patch<1, 3> &patch) { patch.reference_cell = dealii::ReferenceCells::Line; }

  /// deal.II leaves out the points and arrays of an empty file, which readers then refuse.
  void write_empty(std::ostream &file) const
  {
    const auto array = [&](const std::string &type, const std::string &name, int components)
    {
      file << "        <DataArray type=\"" << type << "\" Name=\"" << name << "\" NumberOfComponents=\"" << components
           << "\" format=\"ascii\"";
      if (const auto unit = units.find(name); unit != units.end())
        file << " units=\"" << unit->second << "\""; // as deal.II does
      file << "></DataArray>\n";
    };
    file << "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"0.1\">\n  <UnstructuredGrid>\n"
            "    <Piece NumberOfPoints=\"0\" NumberOfCells=\"0\">\n      <Points>\n";
    array("Float64", "Points", 3);
    file << "      </Points>\n      <Cells>\n";
    array("Int32", "connectivity", 1);
    array("Int32", "offsets", 1);
    array("UInt8", "types", 1);
    file << "      </Cells>\n      <PointData>\n";
    std::size_t scalars_from = 0;
    for (const auto &[first, last, name, kind] : vectors)
    {
      for (; scalars_from < first; ++scalars_from)
        array("Float64", names[scalars_from], 1);
      array("Float64", name, 3);
      scalars_from = last + 1;
    }
    for (; scalars_from < names.size(); ++scalars_from)
      array("Float64", names[scalars_from], 1);
    file << "      </PointData>\n    </Piece>\n  </UnstructuredGrid>\n</VTKFile>\n";
  }

  std::vector<std::string> names;
  std::map<std::string, std::string> units;
  std::vector<Range> vectors;
  std::vector<Patch> patches;
};

/// Joins lists of plain records of all ranks on the first rank.
template <typename Record>
std::vector<Record> gather_records(const std::vector<Record> &local, MPI_Comm comm)
{
  const int rank = rank_of(comm);
  int n_ranks = 1;
  MPI_Comm_size(comm, &n_ranks);
  const int bytes = static_cast<int>(local.size() * sizeof(Record));
  std::vector<int> counts(n_ranks), offsets(n_ranks, 0);
  MPI_Gather(&bytes, 1, MPI_INT, counts.data(), 1, MPI_INT, 0, comm);
  for (int r = 1; r < n_ranks; ++r)
    offsets[r] = offsets[r - 1] + counts[r - 1];
  std::vector<Record> all(rank == 0 ? (offsets.back() + counts.back()) / sizeof(Record) : 0);
  MPI_Gatherv(local.data(), bytes, MPI_BYTE, all.data(), counts.data(), offsets.data(), MPI_BYTE, 0, comm);
  return all;
}

struct ParticleRecord
{
  int index;
  double position[3], velocity[3], radius, weight, damage;
};
} // namespace

ParticleFields gather_particles(CoupledModel &model, MPI_Comm comm)
{
  const dem::Particles particles = model.dem().particles();
  const std::vector<double> damage = model.dem().damage();
  std::vector<ParticleRecord> local(particles.n);
  for (int i = 0; i < particles.n; ++i)
  {
    local[i].index = particles.index[i];
    for (int c = 0; c < 3; ++c)
    {
      local[i].position[c] = particles.position(c, i);
      local[i].velocity[c] = particles.velocity(c, i);
    }
    local[i].radius = particles.radius[i];
    local[i].weight = particles.weight[i];
    local[i].damage = damage[i];
  }
  const std::vector<ParticleRecord> all = gather_records(local, comm);
  ParticleFields fields;
  const auto n = static_cast<Eigen::Index>(all.size());
  fields.index.resize(n);
  fields.position.resize(3, n);
  fields.velocity.resize(3, n);
  fields.radius.resize(n);
  fields.weight.resize(n);
  fields.damage.resize(n);
  for (Eigen::Index i = 0; i < n; ++i)
  {
    fields.index[i] = all[i].index;
    fields.position.col(i) = Eigen::Map<const Eigen::Vector3d>(all[i].position);
    fields.velocity.col(i) = Eigen::Map<const Eigen::Vector3d>(all[i].velocity);
    fields.radius[i] = all[i].radius;
    fields.weight[i] = all[i].weight;
    fields.damage[i] = all[i].damage;
  }
  fields.bonds = gather_records(model.dem().bonds(), comm);
  fields.broken = gather_records(model.dem().broken_bonds(), comm);
  return fields;
}

FieldOutput::FieldOutput(const std::string &directory, CoupledModel &model, MPI_Comm comm)
  : directory(directory), comm(comm), dim(model.fem().mesh().dim)
{
  on_first_rank(comm,
                [&]
                {
                  std::filesystem::create_directories(directory + "/fields");
                  write_mesh(model.fem().mesh());
                });
}

void FieldOutput::write(CoupledModel &model)
{
  char stamp[32];
  std::snprintf(stamp, sizeof stamp, "%09lld", static_cast<long long>(model.step()));
  if (!stamps.empty() && stamps.back().second == stamp)
    return;
  stamps.push_back({model.time(), stamp});

  const Eigen::VectorXd measure = model.rule().measures(model.fem());
  Eigen::VectorXd alpha = Eigen::VectorXd::Zero(measure.size());
  const Eigen::VectorXd weights = model.overlap().fe_weights();
  const std::vector<int> &owned = model.fem().owned_cells();
  const auto n_points = owned.empty() ? 1 : weights.size() / static_cast<Eigen::Index>(owned.size());
  for (std::size_t k = 0; k < owned.size(); ++k)
    alpha[owned[k]] = weights.segment(k * n_points, n_points).mean();
  MPI_Allreduce(MPI_IN_PLACE, alpha.data(), static_cast<int>(alpha.size()), MPI_DOUBLE, MPI_SUM, comm);

  const std::string fem_file = directory + "/fields/fem_" + stamp + ".vtu";
  if (model.fem().n_active_cells() > 0)
    model.fem().write_vtu(fem_file, {{"stress_measure", measure}});
  else
    on_first_rank(
      comm,
      [&]
      {
        Cloud<0>({displacement_field, displacement_field, displacement_field, velocity_field, velocity_field, velocity_field})
          .write(fem_file);
      });
  const Eigen::Matrix3Xd displacement = model.fem().gather(fem::NodalField::displacement);
  const ParticleFields fields = gather_particles(model, comm);
  on_first_rank(comm,
                [&]
                {
                  write_particles(fields, stamp);
                  write_bonds(fields, stamp);
                  if (model.tool().disc())
                    write_disc(*model.tool().disc(), stamp);
                  else if (model.tool().present())
                    write_platens(model.tool().platens(), mesh_box(model.fem().mesh()), stamp);
                  write_snapshot(model, stamp, fields, displacement, alpha, measure);
                  for (const char *name : {"fem", "particles", "bonds"})
                    write_pvd(name);
                  if (model.tool().present())
                    write_pvd("tool");
                });
}

void FieldOutput::write_particles(const ParticleFields &fields, const std::string &stamp) const
{
  Cloud<0> cloud(
    {radius_field, {"damage", "1"}, {"weight", "1"}, velocity_field, velocity_field, velocity_field, {"index", "1"}});
  Eigen::MatrixXd values(7, 1);
  for (Eigen::Index i = 0; i < fields.radius.size(); ++i)
  {
    values << fields.radius[i], fields.damage[i], fields.weight[i], fields.velocity.col(i), fields.index[i];
    cloud.add(fields.position.col(i), values);
  }
  cloud.write(directory + "/fields/particles_" + stamp + ".vtu");
}

void FieldOutput::write_bonds(const ParticleFields &fields, const std::string &stamp) const
{
  const char *unit = dim == 2 ? "N/m" : "N";
  Cloud<1> cloud({{"broken", "1"}, {"normal_force", unit}, {"shear_force", unit}});
  Eigen::Matrix<double, 3, 2> ends;
  Eigen::MatrixXd values(3, 2);
  for (const dem::ActiveBond &bond : fields.bonds)
  {
    ends << bond.a, bond.b;
    values.row(0).setZero();
    values.row(1).setConstant(bond.normal_force);
    values.row(2).setConstant(bond.shear_force);
    cloud.add(ends, values);
  }
  std::unordered_map<int, Eigen::Index> place;
  for (std::size_t i = 0; i < fields.index.size(); ++i)
    place[fields.index[i]] = static_cast<Eigen::Index>(i);
  values.row(0).setOnes();
  values.bottomRows(2).setZero();
  const double reach = 3. * (fields.radius.size() > 0 ? fields.radius.maxCoeff() : 0.);
  for (const dem::BrokenBond &bond : fields.broken)
  {
    const auto a = place.find(bond.first), b = place.find(bond.second);
    if (a == place.end() || b == place.end())
      continue;
    ends << fields.position.col(a->second), fields.position.col(b->second);
    if ((ends.col(0) - ends.col(1)).norm() < reach) // long lines would cover the cut
      cloud.add(ends, values);
  }
  cloud.write(directory + "/fields/bonds_" + stamp + ".vtu");
}

void FieldOutput::write_disc(const Disc &disc, const std::string &stamp) const
{
  Cloud<1> cloud({radius_field});
  constexpr int n_sides = 180;
  const Eigen::MatrixXd radius = Eigen::MatrixXd::Constant(1, 2, disc.radius);
  const auto rim = [&](double angle, double r, double z)
  { return Eigen::Vector3d(disc.centre + Eigen::Vector3d(r * std::cos(angle), r * std::sin(angle), z)); };
  Eigen::Matrix<double, 3, 2> ends;
  const double half = 0.5 * disc.width;
  std::vector<std::array<double, 2>> circles = {{{disc.radius, 0.}}}; // radius and z, with the edges of the flat sides
  if (half > 0.)
    circles.insert(circles.end(), {{{disc.radius - half, -half}}, {{disc.radius - half, half}}});
  for (const auto &[r, z] : circles)
    for (int k = 0; k < n_sides; ++k)
    {
      ends << rim(2. * M_PI * k / n_sides, r, z), rim(2. * M_PI * (k + 1) / n_sides, r, z);
      cloud.add(ends, radius);
    }
  ends << disc.centre, rim(disc.angle, disc.radius, 0.); // a radius shows the rotation
  cloud.add(ends, radius);
  cloud.write(directory + "/fields/tool_" + stamp + ".vtu");
}

/// The faces of a press, a tenth wider than the body on each side: a line in the plane, the rim of a square in space.
void FieldOutput::write_platens(const std::array<double, 2> &faces, const Box &body, const std::string &stamp) const
{
  Cloud<1> cloud({Field("velocity_direction", "1")});
  const Eigen::Vector3d margin = 0.1 * (body.upper - body.lower);
  const Eigen::Vector3d lower = body.lower - margin, upper = body.upper + margin;
  for (int platen = 0; platen < 2; ++platen)
  {
    const double y = faces[platen];
    const Eigen::Vector3d corner[4] = {
      {lower[0], y, lower[2]}, {upper[0], y, lower[2]}, {upper[0], y, upper[2]}, {lower[0], y, upper[2]}};
    const Eigen::MatrixXd direction = Eigen::MatrixXd::Constant(1, 2, platen == 0 ? 1. : -1.);
    Eigen::Matrix<double, 3, 2> ends;
    for (int k = 0; k < (margin[2] > 0. ? 4 : 1); ++k)
    {
      ends << corner[k], corner[(k + 1) % 4];
      cloud.add(ends, direction);
    }
  }
  cloud.write(directory + "/fields/tool_" + stamp + ".vtu");
}

void FieldOutput::write_pvd(const std::string &name) const
{
  std::vector<std::pair<double, std::string>> files;
  for (const auto &stamp : stamps)
    files.push_back({stamp.first, "fields/" + name + "_" + stamp.second + ".vtu"});
  std::ofstream file(directory + "/" + name + ".pvd");
  dealii::DataOutBase::write_pvd_record(file, files);
  check_written(file, directory + "/" + name + ".pvd");
}
} // namespace kerf
