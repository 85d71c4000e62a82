// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/application/output/console.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <unistd.h>

namespace kerf
{
namespace
{
double wall_seconds()
{
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
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

Console::Console(bool active) : active(active), terminal(isatty(STDOUT_FILENO) != 0) {}

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
  if (now - last_shown < (terminal ? 0.2 : 10.) && fraction < 1.)
    return;
  last_shown = now;
  const std::string eta = fraction > 0.01 ? clock_text((now - started) * (1. - fraction) / fraction) : "?";
  char head[64];
  std::snprintf(head, sizeof head, "%5.1f %%  ETA %-7s ", 100. * fraction, eta.c_str());
  std::string line = head + text;
  if (terminal)
  {
    const std::size_t length = line.size();
    line.resize(std::max(length, last_length), ' ');
    last_length = length;
    std::cout << '\r' << line << std::flush;
    line_open = true;
  }
  else
    std::cout << line << std::endl;
  if (log)
    log << line << std::endl;
}

void Console::finish_progress()
{
  if (line_open)
    std::cout << std::endl;
  line_open = false;
  last_length = 0;
}
} // namespace kerf
