# Checks what the files of the core include:   cmake -DCORE=<cpp/peridem> -P check_includes.cmake
# A header may include headers of lower levels only, a source file also its own header. So the
# dependencies point downwards and have no cycles, laws know no arrays, kernels know no model, and
# nothing knows Python, YAML, VTK or a console.
cmake_minimum_required(VERSION 3.22)

if(NOT IS_DIRECTORY "${CORE}")
  message(FATAL_ERROR "CORE is not a folder: '${CORE}'")
endif()

# Stems (path without extension), from the ground up.
set(levels
  "real errors lanes huge_pages stopwatch"
  "types"
  "fuzzy deck state node_sums neighbors cell_grid simd laws/influence"
  "laws/lps laws/pmb laws/rnp laws/contact influence mesh integrator block_view kernel_arrays"
  "material contact_pair bond_lanes"
  "bond_passes"
  "peridynamic_kernel"
  "particle instruction_set"
  "bonds external"
  "partition bond_block bond_energy fragments"
  "contact_search kernel_space"
  "contact peridynamic"
  "peridynamic_setup contact_damping contact_network stability energy memory"
  "model"
  "model_diagnostics model_setup")
set(foreign "pybind11/|Python\\.h|yaml|vtk|[Hh]5|iostream|cstdio|stdio\\.h|fstream|filesystem")
set(laws_may_include "real fuzzy lanes laws/influence laws/lps laws/pmb laws/rnp laws/contact")

set(level 0)
foreach(names IN LISTS levels)
  string(REPLACE " " ";" names "${names}")
  foreach(name IN LISTS names)
    set("level_${name}" ${level})
  endforeach()
  math(EXPR level "${level} + 1")
endforeach()

set(problems "")
file(GLOB_RECURSE files RELATIVE "${CORE}" "${CORE}/*.h" "${CORE}/*.cpp")
foreach(file IN LISTS files)
  string(REGEX REPLACE "\\.(h|cpp)$" "" stem "${file}")
  if(NOT DEFINED "level_${stem}")
    string(APPEND problems "  ${file} has no level: give it one in check_includes.cmake\n")
    continue()
  endif()
  get_filename_component(folder "${file}" DIRECTORY)

  file(STRINGS "${CORE}/${file}" includes REGEX "^[ \t]*#[ \t]*include")
  foreach(include IN LISTS includes)
    string(REGEX MATCH "[\"<]([^\">]+)[\">]" found "${include}")
    set(target "${CMAKE_MATCH_1}")
    if("${target}" MATCHES "${foreign}")
      string(APPEND problems "  ${file} includes ${target}, which is foreign to the core\n")
    endif()
    if("${found}" MATCHES "^<")
      if("${stem}" MATCHES "^laws/" AND NOT "${target}" STREQUAL "cmath")
        string(APPEND problems "  ${file} includes <${target}>: laws are scalar formulas\n")
      endif()
      continue()
    endif()

    cmake_path(SET path NORMALIZE "./${folder}/${target}")
    string(REGEX REPLACE "\\.h$" "" other "${path}")
    if(NOT DEFINED "level_${other}")
      string(APPEND problems "  ${file} includes ${target}, which is not in the core\n")
    elseif("${stem}" MATCHES "^laws/")
      if(NOT " ${laws_may_include} " MATCHES " ${other} ")
        string(APPEND problems "  ${file} includes ${target}: laws need types, fuzzy and lanes only\n")
      endif()
    elseif(NOT "${other}" STREQUAL "${stem}" AND NOT "${level_${other}}" LESS "${level_${stem}}")
      string(APPEND problems
        "  ${file} (level ${level_${stem}}) includes ${target} (level ${level_${other}})\n")
    endif()
  endforeach()
endforeach()

list(LENGTH files n_files)
if(n_files EQUAL 0)
  set(problems "  no source files in ${CORE}\n")
endif()
if(problems)
  message(FATAL_ERROR "Includes that break the layers of the core:\n${problems}")
endif()
message(STATUS "${n_files} files of the core include only what is below them")
