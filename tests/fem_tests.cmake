# SPDX-License-Identifier: GPL-2.0-or-later
kerf_test(fem_unit LABEL fem RANKS 2
  SOURCES unit/fem_law.cpp unit/fem_mesh.cpp unit/fem_hanging.cpp unit/fem_forces.cpp unit/fem_boundary.cpp unit/fem_loads.cpp
  unit/fem_exchange.cpp unit/fem_output.cpp unit/fem_recovery.cpp
  LIBRARIES kerf_fem)
# The cell kernel alone, without meshes of the element library.
kerf_test(fem_kernel LABEL fem SOURCES unit/fem_kernel.cpp verification/fem_bending.cpp LIBRARIES kerf_fem)
kerf_test(fem_verification LABEL fem RANKS 2
  SOURCES verification/fem_waves.cpp verification/fem_stability.cpp verification/fem_energy.cpp
  verification/fem_surface_waves.cpp verification/fem_cantilever.cpp
  LIBRARIES kerf_fem)
# Against a one-rank run in the same process.
kerf_test(fem_ranks LABEL fem RANKS 2 4
  SOURCES verification/fem_ranks.cpp verification/fem_periodic.cpp unit/fem_exchange.cpp
  LIBRARIES kerf_fem)
