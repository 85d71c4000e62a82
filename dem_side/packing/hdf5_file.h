// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace kerf
{
/// Writes one HDF5 file: numbers and texts as attributes, tables as data sets (row by row). The data go to a temporary file,
/// which close() renames. An older file of that name therefore stays intact until then, also when writing fails. Names may
/// contain groups ("history/force"). Every error is a std::runtime_error that begins with "FILE: ".
class Hdf5Writer
{
public:
  explicit Hdf5Writer(const std::string &path);
  ~Hdf5Writer(); ///< without close(): discards the data
  Hdf5Writer(const Hdf5Writer &) = delete;
  Hdf5Writer &operator=(const Hdf5Writer &) = delete;

  void attribute(const std::string &name, double value);
  void attribute(const std::string &name, std::int64_t value);
  void attribute(const std::string &name, int value) { attribute(name, std::int64_t(value)); }
  void attribute(const std::string &name, const std::string &value);
  void attribute(const std::string &name, const std::vector<double> &values);

  /// @p values holds rows * columns numbers, row by row; a data set with columns = 1 is a plain vector.
  void table(const std::string &name, const double *values, std::size_t rows, std::size_t columns = 1);
  void table(const std::string &name, const int *values, std::size_t rows, std::size_t columns = 1);

  void close();

private:
  void put_attribute(const std::string &name, std::int64_t type, std::int64_t space, const void *value);
  void put_table(const std::string &name, std::int64_t type, const void *values, std::size_t rows, std::size_t columns);

  std::string m_path, m_temporary;
  std::int64_t m_file = -1; // hid_t; this header does not need hdf5.h
};

/// Reads one HDF5 file. Every error is a std::invalid_argument that begins with "FILE: " and names the attribute or data set.
class Hdf5Reader
{
public:
  explicit Hdf5Reader(const std::string &path);
  ~Hdf5Reader();
  Hdf5Reader(const Hdf5Reader &) = delete;
  Hdf5Reader &operator=(const Hdf5Reader &) = delete;

  bool has_attribute(const std::string &name) const;
  double number(const std::string &name) const;
  std::int64_t integer(const std::string &name) const;
  std::string text(const std::string &name) const;
  std::vector<double> numbers(const std::string &name) const;

  bool has_table(const std::string &name) const;
  /// All numbers row by row. Throws if the data set does not have @p columns columns; rows = size / columns.
  std::vector<double> table(const std::string &name, std::size_t columns = 1) const;
  std::vector<int> integer_table(const std::string &name, std::size_t columns = 1) const;

  [[noreturn]] void fail(const std::string &what) const; ///< throws std::invalid_argument "FILE: " + what

private:
  template <class Number>
  std::vector<Number> get_table(const std::string &name, std::int64_t type, std::size_t columns) const;

  std::string m_path;
  std::int64_t m_file = -1;
};
} // namespace kerf
