# SPDX-License-Identifier: GPL-2.0-or-later
# Checks of the source tree and of the scripts. Debian's Python by path: another one that comes first in PATH lacks h5py.
set(KERF_PYTHON /usr/bin/python3)
set(KERF_TOOLS ${CMAKE_SOURCE_DIR}/tests/tools)

function(kerf_project_test name)
  add_test(NAME ${name} COMMAND ${ARGN})
  set_tests_properties(${name} PROPERTIES LABELS project TIMEOUT 300)
endfunction()

# The files of the coupler that may use deal.II: the case file is a deal.II ParameterHandler file, output uses its VTU writer.
set(KERF_DEAL_II_IN_COUPLER case_file.cpp parameter_table.h parameter_table.cpp field_output.cpp)
kerf_project_test(include_rule ${KERF_PYTHON} ${KERF_TOOLS}/check_includes.py ${CMAKE_SOURCE_DIR}
                  --deal-ii-in-coupler ${KERF_DEAL_II_IN_COUPLER})
kerf_project_test(include_rule_self_test ${KERF_PYTHON} ${KERF_TOOLS}/check_includes.py --self-test)

kerf_project_test(licence_lines ${KERF_PYTHON} ${KERF_TOOLS}/check_files.py ${CMAKE_SOURCE_DIR} --licence)
kerf_project_test(file_sizes ${KERF_PYTHON} ${KERF_TOOLS}/check_files.py ${CMAKE_SOURCE_DIR} --size)
kerf_project_test(check_files_self_test ${KERF_PYTHON} ${KERF_TOOLS}/check_files.py --self-test)

kerf_project_test(code_format ${KERF_TOOLS}/check_format.sh ${CMAKE_SOURCE_DIR})
kerf_project_test(code_format_self_test ${KERF_TOOLS}/check_format.sh --self-test)

kerf_project_test(scripts ${KERF_TOOLS}/test_scripts.sh)
kerf_project_test(figures ${KERF_PYTHON} ${KERF_TOOLS}/test_figures.py)
kerf_project_test(compare_modes ${KERF_PYTHON} ${KERF_TOOLS}/test_compare_modes.py)
