// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <fstream>
#include <string>

namespace kerf
{
/// Messages and progress of a run: a line that is rewritten on a terminal, occasional lines elsewhere, and log.txt.
class Console
{
public:
  /// @param active false: silent (ranks other than the first)
  explicit Console(bool active);

  /// Also writes all messages to @p path from now on.
  void log_to(const std::string &path);

  void message(const std::string &text);
  /// Writes to the log only.
  void note(const std::string &text);
  /// Shows the progress: a few times per second in a terminal, cut to its width, every ten seconds elsewhere, and once a minute
  /// in the log. @param fraction completed, in [0, 1]
  void progress(double fraction, const std::string &text);
  /// Ends the progress line.
  void finish_progress();

private:
  bool active, terminal, line_open = false;
  double started = 0., last_shown = -1e9, last_logged = -1e9;
  std::size_t last_length = 0;
  std::ofstream log;
};

/// 75 -> "1:15"
std::string clock_text(double seconds);
} // namespace kerf
