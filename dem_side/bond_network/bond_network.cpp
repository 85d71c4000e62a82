// SPDX-License-Identifier: GPL-2.0-or-later
#include "dem_side/bond_network/bond_network.h"

#include "dem_side/bond_network/bond_sample.h"

#include <cmath>
#include <sstream>
#include <stdexcept>

namespace kerf::dem
{
Moduli relaxed_moduli(const Packing &packing, double k_n, double k_t, int sample_size)
{
  return make_bond_sample(packing, sample_size)->relaxed(k_n, k_t);
}

Moduli affine_moduli(const Packing &packing, double k_n, double k_t)
{
  return make_bond_sample(packing, packing.size())->affine(k_n, k_t);
}

ElasticCalibration calibrate_elastic(const Packing &packing, double young, double poisson)
{
  if (!(young > 0.))
    throw std::invalid_argument("elastic calibration: Young's modulus must be positive");
  const std::unique_ptr<BondSample> sample = make_bond_sample(packing);
  const double largest_ratio = 2., tolerance = 1e-6 * std::max(std::abs(poisson), 0.01);
  const auto moduli_at = [&](double ratio) { return sample->relaxed(1., ratio); };
  const auto finish = [&](double ratio, const Moduli &unit)
  {
    ElasticCalibration result;
    result.k_n = young / unit.young;
    result.k_t = ratio * result.k_n;
    result.target_young = young;
    result.target_poisson = poisson;
    result.achieved_young = result.k_n * unit.young;
    result.achieved_poisson = unit.poisson;
    result.anisotropy = unit.anisotropy;
    result.axis_young = result.k_n * unit.axis_young;
    result.axis_poisson = unit.axis_poisson;
    return result;
  };

  // Poisson's ratio falls with k_t / k_n. Start near the affine relation nu = (1 - k_t / k_n) / 4, with an allowance for
  // relaxation.
  double previous_ratio = std::clamp(1. - 3.5 * poisson, 0.05, 1.9);
  Moduli previous = moduli_at(previous_ratio);
  double ratio = std::clamp(previous_ratio + 3.5 * (previous.poisson - poisson), 0., largest_ratio);
  if (std::abs(previous.poisson - poisson) <= tolerance)
    return finish(previous_ratio, previous);
  for (int iteration = 0; iteration < 20 && ratio != previous_ratio; ++iteration)
  {
    const Moduli current = moduli_at(ratio);
    if (std::abs(current.poisson - poisson) <= tolerance)
      return finish(ratio, current);
    const double slope = (current.poisson - previous.poisson) / (ratio - previous_ratio);
    const double next = slope < 0. ? ratio + (poisson - current.poisson) / slope : ratio + 3.5 * (current.poisson - poisson);
    previous_ratio = ratio;
    previous = current;
    ratio = std::clamp(next, 0., largest_ratio);
  }
  std::ostringstream error;
  error << "elastic calibration: Poisson's ratio " << poisson << " is out of reach, this packing allows "
        << moduli_at(largest_ratio).poisson << " to " << moduli_at(0.).poisson;
  throw std::invalid_argument(error.str());
}
} // namespace kerf::dem
