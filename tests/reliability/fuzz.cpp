// SPDX-License-Identifier: GPL-2.0-or-later
// Mutated inputs of every kind: case file, gmsh mesh, STL surface, store, command line. Each must end with exit code 0 or 2, at
// most one line of error that begins with "kerf: ", within 10 s and 2 GB, and write nothing but its results.
//
// usage: fuzz COUNT [FIRST_SEED [KIND]]
// Input number n follows from its seed FIRST_SEED + n alone. A fault prints its seed; fuzz 1 SEED repeats it and shows the
// output. A child of this program runs each input: no time is spent on starting MPI and loading libraries, and a crash ends the
// child.
#include "coupler/command_line.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <random>
#include <set>
#include <sstream>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

namespace
{
namespace fs = std::filesystem;
using Random = std::mt19937_64;
using Words = std::vector<std::string>;

constexpr int time_limit = 10;                 // [s] of CPU
constexpr rlim_t memory_limit = 2000ull << 20; // beyond that of the libraries
constexpr long resident_limit = 2000l << 10;   // [kB]

std::size_t below(Random &random, std::size_t n)
{
  return n > 0 ? random() % n : 0;
}

template <typename List>
const auto &one_of(Random &random, const List &list)
{
  return list[below(random, list.size())];
}

const Words odd_words = {"",
                         "0",
                         "-1",
                         "1",
                         "2",
                         "3",
                         "-0",
                         "1e-310",
                         "1e-300",
                         "1e300",
                         "1e308",
                         "1e400",
                         "nan",
                         "inf",
                         "-inf",
                         "0x10",
                         "2147483647",
                         "2147483648",
                         "-2147483649",
                         "99999999999999999999",
                         "1e-9",
                         "1e-6",
                         "1e6",
                         "0.5",
                         "0.999",
                         "true",
                         "x",
                         ";",
                         ":",
                         ",",
                         "=",
                         "==",
                         "(",
                         "/",
                         "end",
                         "#",
                         "..",
                         "\xff\xfe",
                         "\xef\xbb\xbf",
                         "\t",
                         "%s%n",
                         "none",
                         "yz",
                         "disc",
                         "platens",
                         "random",
                         "hcp",
                         "triangular",
                         "y = 1",
                         "y < 1e-6: fixed",
                         "left: velocity 1 0 ramp 0",
                         "0 0 1 1 8",
                         "0 0 1; 1 1 1",
                         "1,2,3",
                         "1e-9, 1e9",
                         "/dev/zero",
                         "/",
                         "mesh.msh"};

/// Text as bytes: flips, cuts, doubled parts, odd words in place of a token.
std::string mutate(std::string text, Random &random)
{
  for (std::size_t n = 1 + below(random, 3); n > 0; --n)
  {
    const std::size_t at = below(random, text.size()), length = 1 + below(random, 40);
    switch (below(random, 8))
    {
    case 0:
      if (!text.empty())
        text[at] = static_cast<char>(random());
      break;
    case 1:
      text.resize(at);
      break;
    case 2:
      text.erase(at, length);
      break;
    case 3:
      text.insert(at, text.substr(below(random, text.size()), length));
      break;
    case 4:
      text.insert(at, std::string(1 + below(random, 3000), static_cast<char>(random())));
      break;
    default: // a token
    {
      const std::size_t from = text.find_first_not_of(" \n\t", at);
      if (from == std::string::npos)
        break;
      const std::size_t to = std::min(text.find_first_of(" \n\t,;", from), text.size());
      text.replace(from, to - from, one_of(random, odd_words));
    }
    }
  }
  return text;
}

/// A line of the case file or of a mesh lost, doubled, exchanged, or with another value.
std::string mutate_lines(const std::string &text, Random &random)
{
  Words lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);)
    lines.push_back(line);
  for (std::size_t n = 1 + below(random, 3); n > 0 && !lines.empty(); --n)
  {
    std::string &line = lines[below(random, lines.size())];
    const std::size_t equal = line.find('=');
    switch (below(random, 6))
    {
    case 0:
      line.clear();
      break;
    case 1:
      line += '\n' + line;
      break;
    case 2:
      std::swap(line, lines[below(random, lines.size())]);
      break;
    default:
      if (const std::size_t digit = line.find_first_of("0123456789", equal == std::string::npos ? 0 : equal);
          digit != std::string::npos && below(random, 2) == 0)
      {
        char *end = nullptr; // a number of another size
        const double number = std::strtod(&line[digit], &end);
        std::ostringstream scaled;
        scaled << number * std::pow(10., static_cast<double>(below(random, 9)) - 4.);
        line = line.substr(0, digit) + scaled.str() + end;
      }
      else
        line = equal != std::string::npos ? line.substr(0, equal + 1) + ' ' + one_of(random, odd_words) : mutate(line, random);
    }
  }
  std::string result;
  for (const std::string &line : lines)
    result += line + '\n';
  return result;
}

std::string read(const std::string &path)
{
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

void write(const std::string &path, const std::string &text)
{
  std::ofstream(path, std::ios::binary) << text;
}

const std::string plane_case = R"(subsection Mesh
  set Upper corner = 0.016, 0.014
  set Cell size = 4e-3
  set Fine zone lower corner = 0, 0
  set Fine zone upper corner = 0, 0
  set Growth ratio = 1.2
  set Refine =
  set Periodic = none
end
subsection Boundary
  set Conditions = left: roller; right: absorbing; y < 1e-6: fixed
end
subsection Loads
  set Gravity = 0, -9.81
  set Initial stress = -1e6 0 0
end
subsection Packing
  set Mean diameter = 1e-3
  set Radius spread = 0.3
  set Lattice plane =
end
subsection Bond
  set Tensile strength = 10e3
  set Shear strength = 12e3
end
subsection Coupling
  set Method = weak_multipliers
  set Overlap width = 4
  set Penalty ratio = 0.5
  set Weight function = linear
end
subsection Adaptivity
  set Sigma star = 3e6
end
subsection Fixed
  set Region = 0.004 0.004 0.012 0.014
end
subsection Tool
  set Kind = disc
  set Radius = 0.004
  set Path = 0 0.008 0.01805; 4e-4 0.008 0.0175
  set Smoothing time = 5e-5
end
subsection Time
  set End time = 4e-4
  set Time step = 0
end
)";

const std::string space_case = R"(subsection Mesh
  set Dimension = 3
  set Lower corner = 0, 0, 0
  set Upper corner = 1, 1, 1
  set Cell size = 0.5
end
subsection Boundary
  set Conditions =
end
subsection Tool
  set Kind = none
end
subsection Packing
  set Mean diameter = 0.1
  set Surface = surface.stl
end
)";

/// Quadrilaterals of a 3 x 2 grid with groups on their sides, format 2.2.
std::string gmsh_grid()
{
  std::ostringstream text;
  text
    << "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n2\n1 1 \"bottom\"\n2 2 \"rock\"\n$EndPhysicalNames\n$Nodes\n12\n";
  for (int j = 0; j < 3; ++j)
    for (int i = 0; i < 4; ++i)
      text << 1 + i + 4 * j << ' ' << 4e-3 * i << ' ' << 4e-3 * j << " 0\n";
  text << "$EndNodes\n$Elements\n9\n";
  for (int i = 0; i < 3; ++i)
    text << 1 + i << " 1 2 1 1 " << 1 + i << ' ' << 2 + i << '\n';
  for (int j = 0; j < 2; ++j)
    for (int i = 0; i < 3; ++i)
      text << 4 + i + 3 * j << " 3 2 2 1 " << 1 + i + 4 * j << ' ' << 2 + i + 4 * j << ' ' << 6 + i + 4 * j << ' '
           << 5 + i + 4 * j << '\n';
  text << "$EndElements\n";
  return text.str();
}

/// The unit cube of twelve facets.
std::string stl_cube(bool binary)
{
  static constexpr int corner[12][3] = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                                        {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  std::ostringstream text;
  std::string bytes(80, ' ');
  const std::uint32_t n = 12;
  bytes.append(reinterpret_cast<const char *>(&n), 4);
  text << "solid cube\n";
  for (const auto &facet : corner)
  {
    text << " facet normal 0 0 0\n  outer loop\n";
    bytes.append(12, '\0');
    for (const int c : facet)
    {
      const float x[3] = {float(c & 1), float(c >> 1 & 1), float(c >> 2)};
      text << "   vertex " << x[0] << ' ' << x[1] << ' ' << x[2] << '\n';
      bytes.append(reinterpret_cast<const char *>(x), 12);
    }
    text << "  endloop\n endfacet\n";
    bytes.append(2, '\0');
  }
  text << "endsolid cube\n";
  return binary ? bytes : text.str();
}

struct Outcome
{
  int status = 0; ///< of waitpid
  std::string errors;
  long resident = 0; ///< [kB]
};

/// Runs kerf in a child with limits of time and memory.
Outcome run(const Words &arguments, const std::string &directory)
{
  const std::string errors = directory + ".err", output = directory + ".out";
  std::cout << std::flush;
  const pid_t child = fork();
  if (child == 0)
  {
    long pages = 0;
    std::ifstream("/proc/self/statm") >> pages;
    const rlim_t memory = static_cast<rlim_t>(pages) * static_cast<rlim_t>(sysconf(_SC_PAGESIZE)) + memory_limit;
    const rlimit memory_limits = {memory, memory}, cpu = {time_limit, time_limit}, core = {0, 0};
    setrlimit(RLIMIT_AS, &memory_limits);
    setrlimit(RLIMIT_CPU, &cpu);
    setrlimit(RLIMIT_CORE, &core);
    alarm(10 * time_limit);
    for (const int crash : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT}) // MPI's handlers print, and may hang in it
      std::signal(crash, SIG_DFL);
    for (const auto &[path, stream] : {std::pair(errors, STDERR_FILENO), std::pair(output, STDOUT_FILENO)})
      dup2(open(path.c_str(), O_CREAT | O_WRONLY | O_TRUNC, 0600), stream);
    if (chdir(directory.c_str()) != 0)
      _exit(99);
    const int code = kerf::run_command_line(arguments, MPI_COMM_SELF).code;
    std::cout << std::flush;
    _exit(code);
  }
  Outcome outcome;
  rusage usage = {};
  wait4(child, &outcome.status, 0, &usage);
  outcome.resident = usage.ru_maxrss;
  outcome.errors = read(errors);
  return outcome;
}

std::string listing(const std::string &directory)
{
  std::set<std::string> names;
  for (const auto &entry : fs::recursive_directory_iterator(directory))
    if (entry.path().string().find("/results") == std::string::npos && entry.path().filename() != "case.prm")
      names.insert(entry.path().string());
  std::string text;
  for (const std::string &name : names)
    text += name + ' ' + (fs::is_regular_file(name) ? std::to_string(fs::file_size(name)) : "") + '\n';
  return text;
}

/// What is wrong with the outcome; empty: nothing.
std::string fault_of(const Outcome &outcome)
{
  if (!WIFEXITED(outcome.status))
    return "ended by signal " + std::to_string(WTERMSIG(outcome.status));
  const int code = WEXITSTATUS(outcome.status);
  const auto lines = std::count(outcome.errors.begin(), outcome.errors.end(), '\n');
  if (code != 0 && code != 2)
    return "exit code " + std::to_string(code);
  if (code == 2 && (lines != 1 || outcome.errors.rfind("kerf: ", 0) != 0))
    return "not one line of error";
  if (code == 0 && lines != 0)
    return "an error with exit code 0";
  if (outcome.resident > resident_limit)
    return std::to_string(outcome.resident / 1024) + " MB";
  return "";
}

class Fuzz
{
public:
  explicit Fuzz(const std::string &work) : work(work)
  {
    for (const std::string name : {"plane", "space"})
      fs::create_directories(work + "/" + name);
    write(work + "/plane/case.prm", plane_case);
    write(work + "/plane/mesh.msh", gmsh_grid());
    write(work + "/space/case.prm", space_case);
    write(work + "/space/surface.stl", stl_cube(false));
    if (run({"pack", "plane", "--set", "Packing/File=store.h5"}, work).status != 0)
      throw std::runtime_error("the store cannot be made: " + read(work + ".err"));
    store = read(work + "/plane/store.h5");
  }

  static constexpr std::array<const char *, 5> kinds = {"case", "gmsh", "stl", "store", "command"};

  /// Prepares the files of an input and returns its command line.
  Words input(int kind, Random &random)
  {
    static const Words modes = {"adaptive", "fixed", "dem", "fem"};
    const bool bytes = below(random, 3) == 0;
    switch (kind)
    {
    case 0:
      write(work + "/plane/case.prm", bytes ? mutate(plane_case, random) : mutate_lines(plane_case, random));
      return {"check", "plane", "--set", "Packing/File=store.h5", "--mode", one_of(random, modes)};
    case 1:
      write(work + "/plane/mesh.msh", bytes ? mutate(gmsh_grid(), random) : mutate_lines(gmsh_grid(), random));
      return {"check", "plane", "--set", "Mesh/File=mesh.msh", "--set", "Boundary/Conditions=y < 1e-6: fixed", "--mode", "fem"};
    case 2:
      write(work + "/space/surface.stl", mutate(stl_cube(below(random, 2) == 0), random));
      return {"check", "space", "--mode", "dem"};
    case 3:
      write(work + "/plane/store.h5", mutate_store(random));
      return {"check", "plane", "--set", "Packing/File=store.h5", "--mode", one_of(random, modes)};
    default:
      return command_line(random);
    }
  }

  void restore() const
  {
    write(work + "/plane/case.prm", plane_case);
    write(work + "/plane/mesh.msh", gmsh_grid());
    write(work + "/plane/store.h5", store);
    write(work + "/space/surface.stl", stl_cube(false));
    fs::remove_all(work + "/results");
  }

private:
  /// Numbers of a store are eight bytes long.
  std::string mutate_store(Random &random) const
  {
    static const std::vector<double> numbers = {0., -1., 1e300, 1e-300, std::nan(""), HUGE_VAL, 3., 1e9};
    if (below(random, 3) == 0)
      return mutate(store, random);
    std::string result = store;
    for (std::size_t n = 1 + below(random, 4); n > 0; --n)
    {
      const double number = one_of(random, numbers);
      std::memcpy(&result[8 * below(random, result.size() / 8)], &number, sizeof number);
    }
    return result;
  }

  static Words command_line(Random &random)
  {
    static const Words words = {"check",
                                "check",
                                "check",
                                "params",
                                "export",
                                "plane",
                                "plane",
                                "space",
                                "nowhere",
                                "--set",
                                "--set",
                                "--mode",
                                "--force",
                                "--overwrite",
                                "--output",
                                "results",
                                "fem",
                                "dem",
                                "adaptive",
                                "--version",
                                "--help",
                                "-h",
                                "--",
                                "-",
                                "Tool/Kind=none",
                                "Mesh/Cell size=2e-3",
                                "Packing/File=store.h5",
                                "Rock/Density=-1",
                                "Rock/Dens=1",
                                "Mesh/File=/dev/zero",
                                "Packing/Seed=2",
                                "plane/case.prm"};
    Words result;
    for (std::size_t n = below(random, 8); n > 0; --n)
      result.push_back(below(random, 6) == 0 ? mutate(one_of(random, words), random) : one_of(random, words));
    if (std::find(result.begin(), result.end(), "space") != result.end()) // its surface may be a mutant of before
      result.insert(result.end(), {"--set", "Packing/Surface="});
    for (std::string &word : result)
      word = word.c_str(); // a command line holds no zero bytes
    return result;
  }

  std::string work, store;
};
} // namespace

int main(int argc, char **argv)
{
  MPI_Init(&argc, &argv);
  const long count = argc > 1 ? std::atol(argv[1]) : 2000;
  const unsigned long first = argc > 2 ? std::strtoul(argv[2], nullptr, 10) : 1;
  char pattern[] = "/tmp/kerf_fuzz_XXXXXX";
  const std::string work = mkdtemp(pattern);
  std::array<long, 5> refused{}, all{};
  long faults = 0;
  {
    Fuzz fuzz(work);
    const std::string before = (fuzz.restore(), listing(work));
    for (long n = 0; n < count; ++n)
    {
      Random random(first + static_cast<unsigned long>(n));
      const int kind = static_cast<int>(below(random, Fuzz::kinds.size()));
      const Words words = fuzz.input(kind, random);
      const Outcome outcome = run(words, work);
      ++all[kind];
      refused[kind] += WIFEXITED(outcome.status) && WEXITSTATUS(outcome.status) == 2;
      std::string fault = fault_of(outcome);
      if (count != 1) // one input stays, to look at
        fuzz.restore();
      if (const std::string after = listing(work); count != 1 && fault.empty() && after != before)
        fault = "files changed:\n" + after;
      if (!fault.empty() || count == 1)
      {
        std::cout << "seed " << first + static_cast<unsigned long>(n) << ", " << Fuzz::kinds[kind] << ": " << fault << '\n';
        for (const std::string &word : words)
          std::cout << "  '" << word << "'\n";
        std::cout << outcome.errors.substr(0, 1000) << std::endl;
      }
      faults += !fault.empty();
    }
  }
  for (std::size_t k = 0; k < all.size(); ++k)
    std::cout << Fuzz::kinds[k] << ": " << all[k] << " inputs, " << refused[k] << " refused\n";
  std::cout << faults << " faults\n";
  if (count == 1)
    std::cout << "input in " << work << '\n';
  else
    fs::remove_all(work);
  for (const char *end : {".err", ".out"})
    fs::remove(work + end);
  MPI_Finalize();
  return faults > 0;
}
