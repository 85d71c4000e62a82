// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/application/output/draw_figures.h"

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <iostream>
#include <optional>
#include <set>
#include <spawn.h>
#include <sstream>
#include <sys/wait.h>
#include <unistd.h>
#include <vector>

namespace kerf
{
namespace
{
namespace fs = std::filesystem;

/// Path of figures.py, in share/kerf/plots beside bin/kerf. A build directory has the same layout.
std::optional<fs::path> figures_script()
{
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  if (error)
    return std::nullopt;
  for (const fs::path &prefix : {program.parent_path().parent_path(), program.parent_path()})
  {
    const fs::path script = prefix / "share/kerf/plots/figures.py";
    if (fs::exists(script, error))
      return script;
  }
  return std::nullopt;
}

/// All programs named python3 in PATH, in the order of its directories.
std::vector<std::string> pythons()
{
  std::vector<std::string> found;
  std::set<fs::path> seen;
  const char *path = std::getenv("PATH");
  std::istringstream directories(path != nullptr ? path : "");
  for (std::string directory; std::getline(directories, directory, ':');)
  {
    std::error_code error;
    const fs::path python = fs::path(directory) / "python3";
    if (!directory.empty() && access(python.c_str(), X_OK) == 0 && seen.insert(fs::canonical(python, error)).second)
      found.push_back(python);
  }
  return found;
}

/// Runs a program without a shell, so that names may contain any character. Returns its exit code, or -1 when it did not start
/// or was ended by a signal. @param output receives the standard output unless null @param detached the program is not waited
/// for and survives this one
int run(const std::vector<std::string> &words, std::string *output = nullptr, bool detached = false)
{
  int ends[2] = {-1, -1};
  if (output != nullptr && pipe(ends) != 0)
    return -1;
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  if (output != nullptr)
  {
    posix_spawn_file_actions_adddup2(&actions, ends[1], STDOUT_FILENO);
    posix_spawn_file_actions_addclose(&actions, ends[0]);
    posix_spawn_file_actions_addclose(&actions, ends[1]);
  }
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  if (detached)
  {
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSID);
    for (const int stream : {STDOUT_FILENO, STDERR_FILENO})
      posix_spawn_file_actions_addopen(&actions, stream, "/dev/null", O_WRONLY, 0);
  }
  std::vector<char *> arguments;
  for (const std::string &word : words)
    arguments.push_back(const_cast<char *>(word.c_str()));
  arguments.push_back(nullptr);
  pid_t child = 0;
  const bool started = posix_spawn(&child, arguments[0], &actions, &attributes, arguments.data(), environ) == 0;
  posix_spawn_file_actions_destroy(&actions);
  posix_spawnattr_destroy(&attributes);
  if (output != nullptr)
  {
    close(ends[1]);
    char buffer[256];
    for (ssize_t count; started && ((count = read(ends[0], buffer, sizeof buffer)) > 0 || (count < 0 && errno == EINTR));)
      output->append(buffer, count > 0 ? count : 0);
    close(ends[0]);
  }
  if (!started)
    return -1;
  if (detached)
    return 0;
  int status = 0;
  while (waitpid(child, &status, 0) < 0)
    if (errno != EINTR)
      return -1;
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

/// The modules that a Python interpreter lacks. The modules are not loaded.
std::string missing_modules(const std::string &python)
{
  std::string missing;
  const int code = run({python, "-c",
                        "from importlib.util import find_spec\n"
                        "print(*(m for m in ('numpy', 'matplotlib', 'h5py') if find_spec(m) is None), end='')"},
                       &missing);
  return code == 0 ? missing : "a working interpreter";
}
} // namespace

void draw_figures(const std::string &directory, bool detached)
{
  if (!fs::exists(directory + "/history.h5") && !fs::exists(directory + "/stability.csv"))
    return;
  const std::optional<fs::path> script = figures_script();
  if (!script)
  {
    std::cerr << "figures were not drawn: share/kerf/plots/figures.py is missing from the installation" << std::endl;
    return;
  }
  std::string lacking;
  for (const std::string &python : pythons())
  {
    const std::string missing = missing_modules(python);
    if (missing.empty())
    {
      // -B: no bytecode is written beside installed scripts.
      if (run({python, "-B", script->string(), directory}, nullptr, detached) != 0)
        std::cerr << "figures were not drawn; try: " << python << " " << *script << " " << fs::path(directory) << std::endl;
      return;
    }
    lacking += (lacking.empty() ? "" : "; ") + python + " lacks " + missing;
  }
  std::cerr << "figures were not drawn: " << (lacking.empty() ? "there is no python3 in PATH" : lacking) << std::endl;
}
} // namespace kerf
