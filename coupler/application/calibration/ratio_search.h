// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>

namespace kerf
{
/// Where to look for R_t/R_n next. UCS/BTS rises with it in two dimensions; in three it has its largest value near 1 and falls
/// on either side. So a bracket is searched from the best value on, in the direction in which it is not known yet.
class RatioSearch
{
public:
  /// @param q = R_t/R_n; @param off log of UCS/BTS to the one target
  void add(double q, double off) { tried[q] = off; }

  /// 0: there is none.
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
      // Secant in logarithms, kept off the ends: the ratio has small jumps, for each bond breaks or does not.
      const auto after = std::next(before);
      const double share = std::min(0.85, std::max(0.15, before->second / (before->second - after->second)));
      const double step = std::log(after->first / before->first);
      return step > 0.005 ? before->first * std::exp(share * step) : 0.;
    }
    const bool first = best == tried.begin(), last = std::next(best) == tried.end();
    if (!first && !last)
      return 0.; // the ratio turns back here
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
  std::map<double, double> tried; // off by q
};
} // namespace kerf
