// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/application/output/console.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fcntl.h>
#include <iostream>
#include <sys/ioctl.h>
#include <unistd.h>

namespace kerf
{
namespace
{
double wall_seconds()
{
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// Columns of the terminal; 80 when it does not say.
std::size_t terminal_width()
{
  winsize size = {};
  return ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : 80;
}

/// Seconds between lines of progress: in a terminal, in a file or pipe, and in the log.
constexpr double pause_terminal = 0.2, pause_other = 10., pause_log = 60.;

/// Whether the output goes to a terminal. mpirun gives its ranks terminals of its own: then its own output decides.
bool writes_to_terminal()
{
  if (isatty(STDOUT_FILENO) == 0)
    return false;
  if (std::getenv("OMPI_COMM_WORLD_SIZE") == nullptr)
    return true;
  const std::string path = "/proc/" + std::to_string(getppid()) + "/fd/1";
  const int output = open(path.c_str(), O_WRONLY | O_NOCTTY);
  const bool terminal = output >= 0 && isatty(output) != 0;
  if (output >= 0)
    close(output);
  return terminal;
}
} // namespace

std::string clock_text(double seconds)
{
  const long whole = std::lround(std::max(0., seconds));
  char text[32];
  if (whole >= 3600)
    std::snprintf(text, sizeof text, "%ld:%02ld:%02ld", whole / 3600, whole / 60 % 60, whole % 60);
  else
    std::snprintf(text, sizeof text, "%ld:%02ld", whole / 60, whole % 60);
  return text;
}

Console::Console(bool active) : active(active), terminal(writes_to_terminal()) {}

void Console::log_to(const std::string &path)
{
  if (active)
    log.open(path);
}

void Console::message(const std::string &text)
{
  if (!active)
    return;
  finish_progress();
  std::cout << text << std::endl;
  if (log)
    log << text << std::endl;
}

void Console::note(const std::string &text)
{
  if (active && log)
    log << text << std::endl;
}

void Console::progress(double fraction, const std::string &text)
{
  if (!active)
    return;
  const double now = wall_seconds();
  if (fraction <= 0. || started == 0.)
    started = now;
  const bool is_last = fraction >= 1.;
  const bool show = is_last || now - last_shown >= (terminal ? pause_terminal : pause_other);
  const bool keep = log && (is_last || now - last_logged >= pause_log);
  if (!show && !keep)
    return;
  const std::string eta = fraction > 0.01 ? clock_text((now - started) * (1. - fraction) / fraction) : "?";
  char head[64];
  std::snprintf(head, sizeof head, "%5.1f %%  ETA %-7s ", 100. * fraction, eta.c_str());
  const std::string line = head + text;
  if (keep)
  {
    last_logged = now;
    log << line << std::endl;
  }
  if (!show)
    return;
  last_shown = now;
  if (terminal)
  {
    // The cursor must stay in the line, or the next one would not cover it.
    std::string cut = line.substr(0, terminal_width() - 1);
    const std::size_t length = cut.size();
    cut.resize(std::max(length, std::min(last_length, terminal_width() - 1)), ' ');
    last_length = length;
    std::cout << '\r' << cut << std::flush;
    line_open = true;
  }
  else
    std::cout << line << std::endl;
}

void Console::finish_progress()
{
  if (line_open)
    std::cout << std::endl;
  line_open = false;
  last_length = 0;
}
} // namespace kerf
