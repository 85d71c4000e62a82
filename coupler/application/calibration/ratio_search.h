// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>

namespace kerf
{
/// Search for the R_t/R_n that gives a target UCS/BTS. In two dimensions UCS/BTS increases with R_t/R_n. In three dimensions it
/// has its maximum near 1. So the search extends from the best value into the direction without a bracket.
class RatioSearch
{
public:
  /// Adds the result of a test. @param q R_t/R_n. @param off logarithm of UCS/BTS over its target
  void add(double q, double off) { tried[q] = off; }

  /// Next R_t/R_n to test; 0: none is left.
  double next() const
  {
    constexpr double factor = 1.7, smallest = 0.2, largest = 10.;
    auto best = tried.begin(), before = tried.end();
    double bracket = std::numeric_limits<double>::max();
    for (auto here = tried.begin(); here != tried.end(); ++here)
    {
      if (std::abs(here->second) < std::abs(best->second))
        best = here;
      const auto after = std::next(here);
      if (after != tried.end() && here->second * after->second < 0. &&
          std::abs(here->second) + std::abs(after->second) < bracket)
      {
        before = here;
        bracket = std::abs(here->second) + std::abs(after->second);
      }
    }
    if (before != tried.end())
    {
      // Secant in logarithms, away from the ends of the bracket, because the ratio is not smooth: single bonds break or hold.
      const auto after = std::next(before);
      const double share = std::min(0.85, std::max(0.15, before->second / (before->second - after->second)));
      const double step = std::log(after->first / before->first);
      return step > 0.005 ? before->first * std::exp(share * step) : 0.;
    }
    const bool first = best == tried.begin(), last = std::next(best) == tried.end();
    if (!first && !last)
      return 0.; // the ratio has its extremum here
    const bool up = first && last ? best->second < 0. : last;
    const double q = std::clamp(up ? best->first * factor : best->first / factor, smallest, largest);
    return q != best->first ? q : 0.;
  }
  bool bracketed() const
  {
    const auto [least, most] =
      std::minmax_element(tried.begin(), tried.end(), [](const auto &a, const auto &b) { return a.second < b.second; });
    return least->second < 0. && most->second > 0.;
  }

private:
  std::map<double, double> tried; // logarithm off by q
};
} // namespace kerf
