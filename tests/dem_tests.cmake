# SPDX-License-Identifier: GPL-2.0-or-later
kerf_test(rock_bond_law_tests LABEL dem
          SOURCES unit/rock_bond_law_test.cpp
          LIBRARIES kerf_dem)
kerf_test(dem_tests LABEL dem RANKS 2
          SOURCES unit/dem_pair_test.cpp unit/dem_contact_test.cpp unit/dem_side_test.cpp unit/dem_insertion_test.cpp
                  unit/dem_benchmark_test.cpp unit/dem_slabs_test.cpp
          LIBRARIES kerf_dem)
kerf_test(dem_verification LABEL dem
          SOURCES verification/dem_conservation_test.cpp verification/dem_time_step_test.cpp
                  verification/dem_lattice_test.cpp
          LIBRARIES kerf_dem)
# Four ranks have corners where the ghosts of two borders meet.
kerf_test(dem_ranks LABEL dem RANKS 2 4
          SOURCES verification/dem_ranks_test.cpp
          LIBRARIES kerf_dem)
kerf_test(dem_periodic LABEL dem RANKS 2 4
          SOURCES verification/dem_periodic_test.cpp
          LIBRARIES kerf_dem)
kerf_test(dem_energy LABEL dem RANKS 2
          SOURCES verification/dem_energy_test.cpp
          LIBRARIES kerf_coupling)
kerf_test(dem_crush_step LABEL dem
          SOURCES verification/dem_crush_step_test.cpp
          LIBRARIES kerf_coupling)
kerf_test(export_3d LABEL dem
          SOURCES verification/export_3d.cpp
          LIBRARIES kerf_application)

add_test(NAME stand_alone COMMAND /usr/bin/python3 ${CMAKE_SOURCE_DIR}/tests/verification/stand_alone.py $<TARGET_FILE:kerf>
         ${CMAKE_SOURCE_DIR}/tests/cases/small_cut)
set_tests_properties(stand_alone PROPERTIES LABELS dem TIMEOUT 600 PROCESSORS 2)

foreach(part press calibration)
  add_test(NAME specimens_${part} COMMAND /usr/bin/python3 ${CMAKE_SOURCE_DIR}/tests/verification/specimens.py
           $<TARGET_FILE:kerf> ${CMAKE_SOURCE_DIR}/cases ${part})
  set_tests_properties(specimens_${part} PROPERTIES LABELS dem TIMEOUT 900)
endforeach()
# Minutes: ctest -C long -L dem-long
add_test(NAME specimens_long COMMAND /usr/bin/python3 ${CMAKE_SOURCE_DIR}/tests/verification/specimens.py $<TARGET_FILE:kerf>
         ${CMAKE_SOURCE_DIR}/cases long CONFIGURATIONS long)
set_tests_properties(specimens_long PROPERTIES LABELS dem-long TIMEOUT 3600 PROCESSORS 2)
