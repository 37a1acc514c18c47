# How each C++ dependency is found: an installed package first (Debian: see README.md), else, with
# -DPERIDEM_DOWNLOAD=ON, a pinned download that must match its hash.
option(PERIDEM_DOWNLOAD "Download C++ dependencies that are not installed" OFF)
include(FetchContent)
list(APPEND CMAKE_MODULE_PATH "${CMAKE_CURRENT_LIST_DIR}")

function(peridem_missing name debian)
  message(FATAL_ERROR "${name} was not found: install it (Debian, Ubuntu: apt-get install ${debian}) "
                      "or configure with -DPERIDEM_DOWNLOAD=ON")
endfunction()

function(peridem_download name url hash)
  message(STATUS "${name}: downloading ${url}")
  # The archives are used as plain sources: SOURCE_SUBDIR names a folder without CMakeLists.txt.
  FetchContent_Declare(${name} URL ${url} URL_HASH SHA256=${hash} SOURCE_SUBDIR none)
  FetchContent_MakeAvailable(${name})
  set(${name}_dir "${${name}_SOURCE_DIR}" PARENT_SCOPE)
endfunction()

function(peridem_headers target dir)
  add_library(peridem_${target} INTERFACE)
  target_include_directories(peridem_${target} SYSTEM INTERFACE "$<BUILD_INTERFACE:${dir}>")
endfunction()

find_package(OpenMP REQUIRED COMPONENTS CXX)

find_package(Eigen3 3.4 QUIET CONFIG)
if(NOT TARGET Eigen3::Eigen)
  if(NOT PERIDEM_DOWNLOAD)
    peridem_missing(Eigen libeigen3-dev)
  endif()
  peridem_download(eigen
    https://gitlab.com/libeigen/eigen/-/archive/3.4.0/eigen-3.4.0.tar.bz2
    b4c198460eba6f28d34894e3a5710998818515104d6e74e5cc331ce31e46e626)
  peridem_headers(eigen "${eigen_dir}")
  add_library(Eigen3::Eigen ALIAS peridem_eigen)
endif()

find_package(nanoflann QUIET CONFIG)
if(NOT TARGET nanoflann::nanoflann)
  if(NOT PERIDEM_DOWNLOAD)
    peridem_missing(nanoflann libnanoflann-dev)
  endif()
  peridem_download(nanoflann
    https://github.com/jlblancoc/nanoflann/archive/refs/tags/v1.4.2.tar.gz
    97fce650eb644a359a767af526cab9ba31842e53790a7279887e1ae2fffe7319)
  peridem_headers(nanoflann "${nanoflann_dir}/include")
  add_library(nanoflann::nanoflann ALIAS peridem_nanoflann)
endif()

find_package(METIS QUIET)
if(NOT TARGET METIS::METIS)
  if(NOT PERIDEM_DOWNLOAD)
    peridem_missing(METIS libmetis-dev)
  endif()
  enable_language(C)
  peridem_download(metis
    http://glaros.dtc.umn.edu/gkhome/fetch/sw/metis/metis-5.1.0.tar.gz
    76faebe03f6c963127dbb73c13eab58c9a3faeae48779f049066a21c087c5db2)
  file(GLOB metis_sources "${metis_dir}/libmetis/*.c" "${metis_dir}/GKlib/*.c")
  add_library(peridem_metis STATIC ${metis_sources})
  target_include_directories(peridem_metis SYSTEM
    PUBLIC "${metis_dir}/include" PRIVATE "${metis_dir}/libmetis" "${metis_dir}/GKlib")
  set_target_properties(peridem_metis PROPERTIES POSITION_INDEPENDENT_CODE ON)
  target_compile_options(peridem_metis PRIVATE -w)
  add_library(METIS::METIS ALIAS peridem_metis)
endif()

if(PERIDEM_TESTS)
  find_package(doctest QUIET CONFIG)
  if(NOT TARGET doctest::doctest)
    if(NOT PERIDEM_DOWNLOAD)
      peridem_missing(doctest doctest-dev)
    endif()
    peridem_download(doctest
      https://github.com/doctest/doctest/archive/v2.4.9.tar.gz
      19b2df757f2f3703a5e63cee553d85596875f06d91a3333acd80a969ef210856)
    peridem_headers(doctest "${doctest_dir}")
    add_library(doctest::doctest ALIAS peridem_doctest)
  endif()
endif()
