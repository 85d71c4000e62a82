# SPDX-License-Identifier: GPL-2.0-or-later
kerf_test(coupler_constraint LABEL coupling SOURCES unit/coupler_constraint.cpp LIBRARIES kerf_coupling)
kerf_test(coupler_links LABEL coupling SOURCES unit/coupler_links.cpp LIBRARIES kerf_coupling)
kerf_test(coupler_overlap LABEL coupling SOURCES unit/coupler_overlap.cpp LIBRARIES kerf_coupling)
kerf_test(coupler_tool LABEL coupling SOURCES unit/coupler_tool.cpp unit/coupler_specimen.cpp LIBRARIES kerf_coupling)
kerf_test(coupler_packing_space LABEL coupling SOURCES unit/coupler_packing_space.cpp LIBRARIES kerf_application)
kerf_test(coupler_loads LABEL coupling RANKS 2 SOURCES verification/coupler_loads.cpp LIBRARIES kerf_coupling)
kerf_test(coupler_body LABEL coupling RANKS 2 SOURCES verification/coupler_body.cpp LIBRARIES kerf_coupling)
kerf_test(coupler_periodic LABEL coupling RANKS 2 SOURCES verification/coupler_periodic.cpp LIBRARIES kerf_coupling)
kerf_test(coupler_patch LABEL coupling RANKS 2 SOURCES verification/coupler_patch.cpp LIBRARIES kerf_coupling)
kerf_test(coupler_corrector LABEL coupling RANKS 2 SOURCES verification/coupler_corrector.cpp LIBRARIES kerf_coupling)
kerf_test(adaptivity_front LABEL adaptivity SOURCES verification/adaptivity_front.cpp LIBRARIES kerf_coupling)
kerf_test(adaptivity_changes LABEL adaptivity SOURCES verification/adaptivity_changes.cpp LIBRARIES kerf_coupling)
kerf_test(coupler_loose LABEL adaptivity RANKS 2 SOURCES verification/coupler_loose.cpp LIBRARIES kerf_coupling)
kerf_test(coupler_limit LABEL coupling SOURCES verification/coupler_limit.cpp LIBRARIES kerf_coupling)
kerf_test(coupler_waves LABEL coupling SOURCES verification/coupler_waves.cpp LIBRARIES kerf_coupling)

add_test(NAME stability_maps COMMAND /usr/bin/python3 ${CMAKE_SOURCE_DIR}/tests/stability/maps.py $<TARGET_FILE:kerf>
         ${CMAKE_SOURCE_DIR}/tests/cases/small_cut)
set_tests_properties(stability_maps PROPERTIES LABELS coupling TIMEOUT 900)

# Tables of docs/coupling.md, see tests/tools/coupling_results.py.
add_executable(coupling_study EXCLUDE_FROM_ALL verification/coupling_study.cpp)
target_link_libraries(coupling_study PRIVATE kerf_coupling GTest::gtest)
set_target_properties(coupling_study PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/tests)

add_test(NAME bad_inputs COMMAND /usr/bin/python3 ${CMAKE_SOURCE_DIR}/tests/reliability/bad_inputs.py $<TARGET_FILE:kerf>
         ${CMAKE_SOURCE_DIR}/tests/cases/small_cut)
add_test(NAME modes COMMAND /usr/bin/python3 ${CMAKE_SOURCE_DIR}/tests/reliability/modes.py $<TARGET_FILE:kerf>
         ${CMAKE_SOURCE_DIR}/tests/cases/small_cut)
set_tests_properties(bad_inputs modes PROPERTIES LABELS reliability TIMEOUT 900)
# Minutes: ctest -C long -L adaptivity-long, -L coupling-long
foreach(part modes exchange)
  add_test(NAME cutting_${part} COMMAND /usr/bin/python3 ${CMAKE_SOURCE_DIR}/tests/reliability/cutting_cases.py $<TARGET_FILE:kerf>
           ${CMAKE_SOURCE_DIR}/cases ${part} CONFIGURATIONS long)
  set_tests_properties(cutting_${part} PROPERTIES TIMEOUT 3600 PROCESSORS 2)
endforeach()
set_tests_properties(cutting_modes PROPERTIES LABELS adaptivity-long)
set_tests_properties(cutting_exchange PROPERTIES LABELS coupling-long)
add_test(NAME fem_cases COMMAND /usr/bin/python3 ${CMAKE_SOURCE_DIR}/tests/reliability/fem_cases.py $<TARGET_FILE:kerf>
         ${CMAKE_SOURCE_DIR}/tests/cases/small_cut)
set_tests_properties(fem_cases PROPERTIES LABELS fem TIMEOUT 900)

# docs/parameters.md is what the program says of itself.
add_test(NAME parameters_page
         COMMAND bash -c "diff <($<TARGET_FILE:kerf> params) ${CMAKE_SOURCE_DIR}/docs/parameters.md")
set_tests_properties(parameters_page PROPERTIES LABELS project TIMEOUT 60)

# The finite elements alone against an independent program; skipped where it is not installed.
add_test(NAME calculix COMMAND /usr/bin/python3 ${CMAKE_SOURCE_DIR}/tests/verification/calculix.py $<TARGET_FILE:kerf>)
set_tests_properties(calculix PROPERTIES LABELS fem TIMEOUT 600 SKIP_RETURN_CODE 77)
