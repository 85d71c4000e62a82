# SPDX-License-Identifier: GPL-2.0-or-later
kerf_test(packing_unit LABEL dem
  SOURCES unit/packing_geometry.cpp unit/packing_store.cpp unit/closed_surface.cpp
  LIBRARIES kerf_generator ${HDF5_C_LIBRARIES})
target_include_directories(packing_unit SYSTEM PRIVATE ${HDF5_INCLUDE_DIRS})

kerf_test(packing_random LABEL dem
  SOURCES verification/packing_random.cpp verification/packing_shapes.cpp
  LIBRARIES kerf_generator)

kerf_test(packing_elasticity LABEL dem
  SOURCES verification/packing_elasticity.cpp verification/packing_frequency.cpp verification/periodic_packing.cpp
  LIBRARIES kerf_generator)

kerf_test(packing_solid LABEL dem
  SOURCES verification/packing_solid.cpp
  LIBRARIES kerf_generator)

kerf_test(packing_dynamic LABEL dem
  SOURCES verification/packing_dynamic.cpp
  LIBRARIES kerf_dem)

# Minutes: ctest -C long -L dem-long
add_executable(packing_long verification/packing_long.cpp test_main.cpp)
target_link_libraries(packing_long PRIVATE kerf_generator GTest::gtest)
set_target_properties(packing_long PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/tests)
add_test(NAME packing_long COMMAND packing_long CONFIGURATIONS long)
set_tests_properties(packing_long PROPERTIES LABELS dem-long TIMEOUT 3600)
