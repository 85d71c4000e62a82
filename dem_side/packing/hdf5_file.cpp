// SPDX-License-Identifier: GPL-2.0-or-later
#include "dem_side/packing/hdf5_file.h"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <hdf5.h>
#include <stdexcept>
#include <type_traits>

namespace kerf
{
namespace
{
static_assert(sizeof(hid_t) == sizeof(std::int64_t), "HDF5 1.10 or newer is needed");

/// Keeps HDF5 from printing its error stack, because the errors here have one line.
class QuietErrors
{
public:
  QuietErrors()
  {
    H5Eget_auto2(H5E_DEFAULT, &m_function, &m_data);
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  }
  ~QuietErrors() { H5Eset_auto2(H5E_DEFAULT, m_function, m_data); }

private:
  H5E_auto2_t m_function = nullptr;
  void *m_data = nullptr;
};

/// Any HDF5 identifier except a file's.
class Handle
{
public:
  explicit Handle(hid_t id) : m_id(id) {}
  ~Handle()
  {
    if (m_id < 0)
      return;
    const QuietErrors quiet;
    switch (H5Iget_type(m_id))
    {
    case H5I_DATASET:
      H5Dclose(m_id);
      break;
    case H5I_DATASPACE:
      H5Sclose(m_id);
      break;
    case H5I_DATATYPE:
      H5Tclose(m_id);
      break;
    case H5I_ATTR:
      H5Aclose(m_id);
      break;
    default:
      H5Pclose(m_id);
      break;
    }
  }
  Handle(const Handle &) = delete;
  Handle &operator=(const Handle &) = delete;
  operator hid_t() const { return m_id; }
  bool valid() const { return m_id >= 0; }

private:
  hid_t m_id;
};

/// Whether the stored numbers have a type that kerf writes, on any machine. The library breaks down on damaged types.
bool is_number_type(hid_t type)
{
  const hid_t known[] = {H5T_IEEE_F64LE, H5T_IEEE_F64BE, H5T_STD_I64LE, H5T_STD_I64BE, H5T_STD_I32LE, H5T_STD_I32BE};
  return std::any_of(std::begin(known), std::end(known), [&](hid_t one) { return H5Tequal(type, one) > 0; });
}

/// Ends a file, with eight bytes of a hash of all before: HDF5 ignores what follows its data, but breaks down on damaged ones.
const std::string seal = "kerf sum";

/// FNV-1a hash as eight bytes.
std::string hash_of(const char *bytes, std::size_t n)
{
  std::uint64_t hash = 14695981039346656037ull;
  for (std::size_t k = 0; k < n; ++k)
    hash = (hash ^ static_cast<unsigned char>(bytes[k])) * 1099511628211ull;
  return {reinterpret_cast<const char *>(&hash), sizeof hash};
}

/// Whether the hash at the end of the file, if there is one, is that of the file.
bool is_whole(const std::string &path)
{
  std::ifstream file(path, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(file), {}};
  const std::size_t tail = seal.size() + sizeof(std::uint64_t);
  if (bytes.size() < tail || bytes.compare(bytes.size() - tail, seal.size(), seal) != 0)
    return true; // of an earlier version, or of another program
  return bytes.compare(bytes.size() - sizeof(std::uint64_t), sizeof(std::uint64_t),
                       hash_of(bytes.data(), bytes.size() - tail)) == 0;
}

hid_t text_type(bool variable, std::size_t size)
{
  const hid_t type = H5Tcopy(H5T_C_S1);
  H5Tset_size(type, variable ? H5T_VARIABLE : size);
  H5Tset_cset(type, H5T_CSET_UTF8);
  return type;
}
} // namespace

Hdf5Writer::Hdf5Writer(const std::string &path) : m_path(path), m_temporary(path + ".tmp")
{
  const QuietErrors quiet;
  // In memory: a library that cannot write its buffers to a full disk breaks down when the program ends.
  constexpr std::size_t growth = 1 << 20; // [bytes]
  const Handle access(H5Pcreate(H5P_FILE_ACCESS));
  H5Pset_fapl_core(access, growth, 0);
  m_file = H5Fcreate(m_temporary.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, access);
  if (m_file < 0)
    throw std::runtime_error(m_path + ": cannot be created");
}

Hdf5Writer::~Hdf5Writer()
{
  if (m_file < 0)
    return;
  const QuietErrors quiet;
  H5Fclose(m_file);
}

void Hdf5Writer::close()
{
  if (m_file < 0)
    return;
  const QuietErrors quiet;
  const bool flushed = H5Fflush(m_file, H5F_SCOPE_LOCAL) >= 0;
  const ssize_t size = flushed ? H5Fget_file_image(m_file, nullptr, 0) : -1;
  std::vector<char> image(std::max<ssize_t>(size, 0));
  const bool complete = size >= 0 && H5Fget_file_image(m_file, image.data(), image.size()) == size;
  H5Fclose(m_file);
  m_file = -1;
  errno = 0;
  std::ofstream file(m_temporary, std::ios::binary);
  file.write(image.data(), static_cast<std::streamsize>(image.size()));
  file << seal << hash_of(image.data(), image.size());
  file.close();
  if (!complete || !file || std::rename(m_temporary.c_str(), m_path.c_str()) != 0)
  {
    const std::string reason = errno != 0 ? std::string(", ") + std::strerror(errno) : "";
    std::remove(m_temporary.c_str());
    throw std::runtime_error(m_path + ": cannot be written" + reason);
  }
}

void Hdf5Writer::put_attribute(const std::string &name, std::int64_t type, std::int64_t space, const void *value)
{
  const Handle attribute(H5Acreate2(m_file, name.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT));
  if (!attribute.valid() || H5Awrite(attribute, type, value) < 0)
    throw std::runtime_error(m_path + ": attribute '" + name + "' cannot be written");
}

void Hdf5Writer::attribute(const std::string &name, double value)
{
  const QuietErrors quiet;
  put_attribute(name, H5T_NATIVE_DOUBLE, Handle(H5Screate(H5S_SCALAR)), &value);
}

void Hdf5Writer::attribute(const std::string &name, std::int64_t value)
{
  const QuietErrors quiet;
  put_attribute(name, H5T_NATIVE_INT64, Handle(H5Screate(H5S_SCALAR)), &value);
}

void Hdf5Writer::attribute(const std::string &name, const std::string &value)
{
  const QuietErrors quiet;
  const Handle type(text_type(true, 0)); // of variable length, which Python reads as text and not as bytes
  const char *start = value.c_str();
  put_attribute(name, type, Handle(H5Screate(H5S_SCALAR)), &start);
}

void Hdf5Writer::attribute(const std::string &name, const std::vector<double> &values)
{
  const QuietErrors quiet;
  const hsize_t size = values.size();
  put_attribute(name, H5T_NATIVE_DOUBLE, Handle(H5Screate_simple(1, &size, nullptr)), values.data());
}

void Hdf5Writer::put_table(const std::string &name, std::int64_t type, const void *values, std::size_t rows,
                           std::size_t columns)
{
  const QuietErrors quiet;
  const hsize_t size[2] = {rows, columns};
  const Handle space(H5Screate_simple(columns == 1 ? 1 : 2, size, nullptr));
  const Handle creation(H5Pcreate(H5P_LINK_CREATE));
  H5Pset_create_intermediate_group(creation, 1);
  const Handle table(H5Dcreate2(m_file, name.c_str(), type, space, creation, H5P_DEFAULT, H5P_DEFAULT));
  const bool written =
    table.valid() && (rows * columns == 0 || H5Dwrite(table, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values) >= 0);
  if (!written)
    throw std::runtime_error(m_path + ": data set '" + name + "' cannot be written");
}

void Hdf5Writer::table(const std::string &name, const double *values, std::size_t rows, std::size_t columns)
{
  put_table(name, H5T_NATIVE_DOUBLE, values, rows, columns);
}

void Hdf5Writer::table(const std::string &name, const int *values, std::size_t rows, std::size_t columns)
{
  put_table(name, H5T_NATIVE_INT, values, rows, columns);
}

Hdf5Reader::Hdf5Reader(const std::string &path) : m_path(path)
{
  const QuietErrors quiet;
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored))
    fail("does not exist");
  if (!std::filesystem::is_regular_file(path, ignored))
    fail("is not a file");
  if (H5Fis_hdf5(path.c_str()) <= 0)
    fail("is not an HDF5 file, or cannot be read");
  if (!is_whole(path))
    fail("is damaged: its content has changed since it was written");
  m_file = H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  if (m_file < 0)
    fail("cannot be opened, the HDF5 file is damaged or in use");
}

Hdf5Reader::~Hdf5Reader()
{
  if (m_file >= 0)
    H5Fclose(m_file);
}

void Hdf5Reader::fail(const std::string &what) const
{
  throw std::invalid_argument(m_path + ": " + what);
}

bool Hdf5Reader::has_attribute(const std::string &name) const
{
  const QuietErrors quiet;
  return H5Aexists(m_file, name.c_str()) > 0;
}

std::vector<double> Hdf5Reader::numbers(const std::string &name) const
{
  const QuietErrors quiet;
  const Handle attribute(H5Aopen(m_file, name.c_str(), H5P_DEFAULT));
  if (!attribute.valid())
    fail("attribute '" + name + "' is missing");
  const Handle space(H5Aget_space(attribute)), stored(H5Aget_type(attribute));
  const hssize_t n = H5Sget_simple_extent_npoints(space);
  constexpr hssize_t most = 1000; // kerf writes three at most
  if (n < 0 || n > most)
    fail("attribute '" + name + "' is not numeric");
  std::vector<double> values(n);
  if (!is_number_type(stored))
    fail("attribute '" + name + "' is not numeric");
  if (!values.empty() && H5Aread(attribute, H5T_NATIVE_DOUBLE, values.data()) < 0)
    fail("attribute '" + name + "' is not numeric");
  return values;
}

double Hdf5Reader::number(const std::string &name) const
{
  const std::vector<double> values = numbers(name);
  if (values.size() != 1)
    fail("attribute '" + name + "' is not a single number");
  return values[0];
}

std::int64_t Hdf5Reader::integer(const std::string &name) const
{
  const double value = number(name); // exact for all counts that occur (below 2^53)
  const bool in_range = value >= -0x1p53 && value <= 0x1p53;
  if (!in_range || value != double(std::int64_t(value)))
    fail("attribute '" + name + "' is not a whole number");
  return std::int64_t(value);
}

std::string Hdf5Reader::text(const std::string &name) const
{
  const QuietErrors quiet;
  const Handle attribute(H5Aopen(m_file, name.c_str(), H5P_DEFAULT));
  if (!attribute.valid())
    fail("attribute '" + name + "' is missing");
  const Handle stored(H5Aget_type(attribute)), space(H5Aget_space(attribute));
  if (H5Tget_class(stored) != H5T_STRING || H5Sget_simple_extent_npoints(space) != 1)
    fail("attribute '" + name + "' is not a text");
  if (H5Tis_variable_str(stored) > 0)
  {
    char *start = nullptr;
    const Handle type(H5Tget_native_type(stored, H5T_DIR_ASCEND));
    if (H5Aread(attribute, type, &start) < 0)
      fail("attribute '" + name + "' cannot be read");
    const std::string result = start ? start : "";
    H5free_memory(start);
    return result;
  }
  std::string result(H5Tget_size(stored), '\0');
  if (H5Aread(attribute, stored, &result[0]) < 0)
    fail("attribute '" + name + "' cannot be read");
  return result.substr(0, result.find('\0'));
}

bool Hdf5Reader::has_table(const std::string &name) const
{
  const QuietErrors quiet;
  return Handle(H5Dopen2(m_file, name.c_str(), H5P_DEFAULT)).valid();
}

template <class Number>
std::vector<Number> Hdf5Reader::get_table(const std::string &name, std::int64_t type, std::size_t columns) const
{
  const QuietErrors quiet;
  const Handle table(H5Dopen2(m_file, name.c_str(), H5P_DEFAULT));
  if (!table.valid())
    fail("data set '" + name + "' is missing");
  const Handle space(H5Dget_space(table));
  const int rank = H5Sget_simple_extent_ndims(space);
  hsize_t size[2] = {0, 1};
  const bool fits = (rank == 1 || rank == 2) && H5Sget_simple_extent_dims(space, size, nullptr) >= 0 && size[1] == columns;
  const Handle stored(H5Dget_type(table));
  if (!is_number_type(stored))
    fail("data set '" + name + "' cannot be read as numbers");
  if (!fits)
    fail("data set '" + name + "' must have " + std::to_string(columns) + (columns == 1 ? " column" : " columns"));
  // A damaged file may announce any size; compression saves less than a factor of 1100.
  if (size[0] > 1100 * std::filesystem::file_size(m_path))
    fail("data set '" + name + "' is larger than its file");
  if (std::is_integral<Number>::value && H5Tget_class(Handle(H5Dget_type(table))) != H5T_INTEGER)
    fail("data set '" + name + "' does not hold whole numbers");
  std::vector<Number> values(size[0] * columns);
  if (!values.empty() && H5Dread(table, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) < 0)
    fail("data set '" + name + "' cannot be read as numbers");
  return values;
}

std::vector<double> Hdf5Reader::table(const std::string &name, std::size_t columns) const
{
  return get_table<double>(name, H5T_NATIVE_DOUBLE, columns);
}

std::vector<int> Hdf5Reader::integer_table(const std::string &name, std::size_t columns) const
{
  return get_table<int>(name, H5T_NATIVE_INT, columns);
}
} // namespace kerf
