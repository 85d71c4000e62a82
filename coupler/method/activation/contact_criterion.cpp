// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/method/activation/contact_criterion.h"

#include "coupler/base/mesh_geometry.h"

#include <algorithm>

namespace kerf
{
double contact_half_width(double radius, double pressure, const fem::Material &rock)
{
  return 2. * radius * pressure * (1. - rock.poisson * rock.poisson) / rock.young;
}

std::vector<int> cells_too_coarse_for_contact(const std::vector<NearCell> &near, double compressive_strength,
                                              const fem::Material &rock, const fem::Mesh &mesh)
{
  constexpr double cells_in_half_width = 2.; // with fewer the force differs by more than ten percent
  std::vector<int> cells;
  for (const NearCell &body : near)
    if (contact_half_width(body.curvature_radius, compressive_strength, rock) <
        cells_in_half_width * cell_box(mesh, body.cell).sizes().maxCoeff())
      cells.push_back(body.cell);
  std::sort(cells.begin(), cells.end());
  cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
  return cells;
}
} // namespace kerf
