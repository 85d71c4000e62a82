// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/base/errors.h"

#include <algorithm>
#include <filesystem>
#include <new>
#include <sstream>

namespace kerf
{
namespace
{
/// Bytes of the UTF-8 character at @p place; 0 when there is none.
std::size_t bytes_of_character(const std::string &text, std::size_t place)
{
  const auto byte = [&](std::size_t k) { return static_cast<unsigned char>(text[k]); };
  const unsigned first = byte(place);
  const std::size_t n = first < 0x80 ? 1 : first >= 0xC2 && first < 0xE0 ? 2 : first >= 0xE0 && first < 0xF0 ? 3 : 0;
  if (n == 0 || place + n > text.size())
    return 0;
  for (std::size_t k = 1; k < n; ++k)
    if ((byte(place + k) & 0xC0) != 0x80)
      return 0;
  return n;
}
} // namespace

int exit_code(const std::exception &error)
{
  const auto is = [&error](auto *kind) { return dynamic_cast<decltype(kind)>(&error) != nullptr; };
  if (is(static_cast<const UnstableRun *>(nullptr)))
    return 3;
  const bool of_user = is(static_cast<const std::runtime_error *>(nullptr)) ||
                       is(static_cast<const std::invalid_argument *>(nullptr)) ||
                       is(static_cast<const std::bad_alloc *>(nullptr));
  return of_user ? 2 : 1;
}

std::string error_line(const std::exception &error)
{
  if (const auto *system = dynamic_cast<const std::filesystem::filesystem_error *>(&error))
    return shown(system->path1().string()) + ": " + system->code().message();
  if (dynamic_cast<const std::bad_alloc *>(&error) != nullptr)
    return "the machine has not enough memory, take larger cells or particles, or a smaller body";
  // The text of a library's failed assertion has many lines; its reason stands between these words.
  std::string text = error.what();
  if (const auto reason = text.find("Additional information:"); reason != std::string::npos)
    text = text.substr(reason + 23, text.find("Stacktrace:", reason) - reason - 23);
  std::istringstream words(text);
  text.clear();
  for (std::string word; words >> word;)
    if (word.size() < 10 || word.find_first_not_of('-') != std::string::npos) // lines that frame the text
      text += (text.empty() ? "" : " ") + word;
  return shown(text, 2000);
}

std::string shown(const std::string &text, std::size_t most)
{
  std::string result;
  std::size_t length = 0;
  for (std::size_t place = 0; place < text.size(); ++length)
  {
    if (length == most)
      return result + "...";
    const std::size_t n = bytes_of_character(text, place);
    const auto byte = static_cast<unsigned char>(text[place]);
    if (n == 1 && (byte == '\n' || byte == '\t'))
      result += ' ';
    else if (n == 0 || byte < 0x20 || byte == 0x7F)
      result += '?';
    else
      result += text.substr(place, n);
    place += std::max<std::size_t>(n, 1);
  }
  return result;
}
} // namespace kerf
