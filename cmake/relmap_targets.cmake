# relmap_library(NAME [FOLDERS ...] [EXCEPT ...] LINK ... PRIVATE_LINK ... SOURCES extra... [THREAD_TESTS ...]
#                TEST_LINK ... [TEST_FULL_TIMEOUT s])
#   A static library of all *.cc in the current folder, or in those of its subfolders that FOLDERS names, but *_test.cc,
#   *_fuzz.cc, *_main.cc and those that EXCEPT names. Its tests (*_test.cc) become NAME_test, with label `ci`; those that
#   THREAD_TESTS names, since they have threads, become NAME_threads_test, which is also built and run under
#   ThreadSanitizer.
# relmap_program(NAME SOURCE LINK ...)  one program, into bin/.
# relmap_fuzzer(NAME SOURCES ... LINK ... COVERS files...)
#   With RELMAP_FUZZ a libFuzzer binary; otherwise a test that replays tests/corpus/NAME through it. COVERS names the
#   files, from the current folder, that the fuzzer is there for: `tools/fuzz --coverage` counts how many of their lines
#   its corpus reaches.

add_library(relmap_flags INTERFACE)
target_include_directories(relmap_flags INTERFACE ${CMAKE_SOURCE_DIR})
target_compile_options(relmap_flags INTERFACE -Wall -Wextra -Wshadow -Wpedantic -Wnon-virtual-dtor -Werror
                       -pthread)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  target_compile_options(relmap_flags INTERFACE -Wno-restrict)  # false on std::string (GCC bug 105651)
  if(NOT CMAKE_DISABLE_PRECOMPILE_HEADERS)  # the same bug, told within system headers once they are precompiled
    target_compile_options(relmap_flags INTERFACE -Wno-stringop-overflow -Wno-array-bounds)
  endif()
  target_compile_options(relmap_flags INTERFACE -fpch-preprocess)  # ccache needs it where headers are precompiled
else()
  target_compile_options(relmap_flags INTERFACE -Wthread-safety)  # what a mutex guards (proto/base/mutex.h)
endif()
if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64")
  target_compile_options(relmap_flags INTERFACE -march=x86-64-v2)
endif()
if(RELMAP_SANITIZE)
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")  # takes much of what is instrumented for uninitialised
    target_compile_options(relmap_flags INTERFACE -Wno-maybe-uninitialized)
  endif()
  target_compile_options(relmap_flags INTERFACE -fsanitize=${RELMAP_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
  target_link_options(relmap_flags INTERFACE -fsanitize=${RELMAP_SANITIZE})
  if(RELMAP_SANITIZE MATCHES "undefined")
    # Halves the time to compile Eigen; a null or dangling access is AddressSanitizer's to find anyway.
    target_compile_options(relmap_flags INTERFACE -fno-sanitize=null,alignment,object-size,vptr)
  endif()
endif()
# Debian's hardening=+all, of which its compiler does PIE by itself. Sanitizers find the same, and do not go with it.
if(CMAKE_BUILD_TYPE MATCHES "Rel" AND NOT RELMAP_SANITIZE AND NOT RELMAP_FUZZ)
  target_compile_options(relmap_flags INTERFACE -fstack-protector-strong -Wformat -Werror=format-security
                         -U_FORTIFY_SOURCE -D_FORTIFY_SOURCE=2)
  target_link_options(relmap_flags INTERFACE LINKER:-z,relro,-z,now)
endif()
if(RELMAP_FUZZ)
  # Fuzzers also count the lines that they reach (tools/fuzz --coverage).
  set(fuzz_flags -fsanitize=fuzzer-no-link -fprofile-instr-generate)
  target_compile_options(relmap_flags INTERFACE ${fuzz_flags} -fcoverage-mapping)
  target_link_options(relmap_flags INTERFACE ${fuzz_flags})
endif()

find_package(GTest REQUIRED)

# The files of a target are compiled eight at a time (CMAKE_UNITY_BUILD), which halves the time once more. So two files of
# a target cannot give different things in their anonymous namespaces the same name. CMAKE_UNITY_BUILD=OFF compiles each
# by itself.
option(CMAKE_UNITY_BUILD "Compile files of a target together" ON)

# Much of the time to compile a file goes into the headers of others, so the commonest are compiled once:
#   relmap_precompiled        the standard library and Eigen
#   relmap_precompiled_quick  the same for command lines and what tests share, which are compiled with -O1: the work that
#                             they ask for is done elsewhere, and CLI11 takes GCC half as long again with -O3 (GCC obeys
#                             the -O of the precompiled headers)
#   relmap_precompiled_test   and GoogleTest, for tests; they are compiled with -O1, for what they measure is in the
#                             libraries
# (CLI11 is better left out: it has objects that each file which sees them must build.) The headers are named, not
# gathered in a file of our own, so that the compiler cache serves every checkout. CMAKE_DISABLE_PRECOMPILE_HEADERS=ON
# builds without; tools/fuzz does, and so finds an #include that is missing.
set(RELMAP_QUICK_OPTIONS "")
if(CMAKE_BUILD_TYPE STREQUAL "RelWithDebInfo")
  set(RELMAP_QUICK_OPTIONS -O1)
endif()
function(relmap_precompile name)
  cmake_parse_arguments(arg "" "" "HEADERS;LINK;OPTIONS" ${ARGN})
  file(WRITE ${CMAKE_BINARY_DIR}/precompiled/${name}.cc "")
  add_library(${name} OBJECT ${CMAKE_BINARY_DIR}/precompiled/${name}.cc)
  target_link_libraries(${name} PRIVATE relmap_flags Eigen3::Eigen ${arg_LINK})
  target_compile_options(${name} PRIVATE ${arg_OPTIONS})
  target_precompile_headers(${name} PRIVATE
    <algorithm> <array> <atomic> <chrono> <cmath> <condition_variable> <cstdint> <cstring> <deque> <filesystem> <fstream>
    <functional> <map> <memory> <mutex> <optional> <random> <set> <span> <sstream> <string> <string_view> <thread>
    <unordered_map> <unordered_set> <variant> <vector> <Eigen/Cholesky> <Eigen/Core> <Eigen/Geometry> ${arg_HEADERS})
endfunction()
relmap_precompile(relmap_precompiled)
relmap_precompile(relmap_precompiled_quick OPTIONS ${RELMAP_QUICK_OPTIONS})
relmap_precompile(relmap_precompiled_test LINK GTest::gmock HEADERS <gmock/gmock.h> <gtest/gtest.h>
                  OPTIONS ${RELMAP_QUICK_OPTIONS})
# In a folder whose libraries and programs are compiled with -O1: set(RELMAP_QUICK ON)
function(relmap_precompiled_headers name)
  if(RELMAP_QUICK)
    target_compile_options(${name} PRIVATE ${RELMAP_QUICK_OPTIONS})
    target_precompile_headers(${name} REUSE_FROM relmap_precompiled_quick)
  else()
    target_precompile_headers(${name} REUSE_FROM relmap_precompiled)
  endif()
endfunction()

# All tests with threads that ThreadSanitizer runs: a target that builds them, and a label of ctest.
add_custom_target(relmap_thread_tests)

# relmap_test(NAME SOURCES ... LINK ... [LABELS ...] [TIMEOUT s] [FULL_TIMEOUT s] [ALONE] [THREADS])
#   Each gtest suite is a ctest entry: to start a program, and to make what the cases of a suite share, takes longer than
#   most cases. The timeout is for what hangs; no test may depend on it. Suites named Long* get FULL_TIMEOUT and label
#   `full`. ALONE: nothing else runs beside them. THREADS: they have the label `threads`, too, and belong to
#   relmap_thread_tests.
function(relmap_test name)
  cmake_parse_arguments(arg "ALONE;THREADS" "TIMEOUT;LABELS;FULL_TIMEOUT" "SOURCES;LINK" ${ARGN})
  if(NOT arg_ALONE)
    set(arg_ALONE OFF)
  endif()
  if(NOT arg_TIMEOUT)
    set(arg_TIMEOUT 1800)  # PublishedFigures takes 430 s on two slow cores
  endif()
  if(NOT arg_FULL_TIMEOUT)
    set(arg_FULL_TIMEOUT 600)
  endif()
  if(RELMAP_SANITIZE)  # several times slower
    math(EXPR arg_TIMEOUT "4 * ${arg_TIMEOUT}")
  endif()
  if(NOT arg_LABELS)
    set(arg_LABELS ci)
  endif()
  if(arg_THREADS)
    list(APPEND arg_LABELS threads)
    add_dependencies(relmap_thread_tests ${name})
  endif()
  add_executable(${name} ${arg_SOURCES})
  target_link_libraries(${name} PRIVATE ${arg_LINK} relmap_flags GTest::gtest GTest::gmock GTest::gtest_main)
  target_compile_options(${name} PRIVATE ${RELMAP_QUICK_OPTIONS})
  target_precompile_headers(${name} REUSE_FROM relmap_precompiled_test)
  target_include_directories(${name} PRIVATE ${CMAKE_BINARY_DIR}/generated)  # tests/paths.h
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/tests)
  set(suites ${CMAKE_CURRENT_BINARY_DIR}/${name}_suites.cmake)
  add_custom_command(
    TARGET ${name} POST_BUILD BYPRODUCTS ${suites}
    COMMAND ${CMAKE_COMMAND} -DPROGRAM=$<TARGET_FILE:${name}> -DNAME=${name} -DFOLDER=${CMAKE_CURRENT_BINARY_DIR}
            -DTIMEOUT=${arg_TIMEOUT} -DLONG_TIMEOUT=${arg_FULL_TIMEOUT} "-DLABELS=${arg_LABELS}" -DALONE=${arg_ALONE}
            -DOUTPUT=${suites} -P ${CMAKE_SOURCE_DIR}/cmake/discover_suites.cmake
    VERBATIM)
  # ctest must not pass over a program that has not been built.
  set(included ${CMAKE_CURRENT_BINARY_DIR}/${name}_included.cmake)
  file(WRITE ${included}
       "if(EXISTS \"${suites}\")\n  include(\"${suites}\")\nelse()\n"
       "  add_test(${name}.NOT_BUILT ${name}.NOT_BUILT)\n"
       "  set_tests_properties(${name}.NOT_BUILT PROPERTIES LABELS \"${arg_LABELS}\")\nendif()\n")
  set_property(DIRECTORY APPEND PROPERTY TEST_INCLUDE_FILES ${included})
endfunction()

function(relmap_library name)
  cmake_parse_arguments(arg "" "TEST_FULL_TIMEOUT" "EXCEPT;FOLDERS;LINK;PRIVATE_LINK;SOURCES;THREAD_TESTS;TEST_LINK" ${ARGN})
  set(patterns *.cc)
  if(arg_FOLDERS)
    list(TRANSFORM arg_FOLDERS APPEND /*.cc OUTPUT_VARIABLE patterns)
  endif()
  list(TRANSFORM patterns PREPEND ${CMAKE_CURRENT_SOURCE_DIR}/)
  file(GLOB sources CONFIGURE_DEPENDS ${patterns})
  set(tests ${sources})
  list(FILTER sources EXCLUDE REGEX "_(test|fuzz|main)\\.cc$")
  foreach(file ${arg_EXCEPT})
    list(REMOVE_ITEM sources ${CMAKE_CURRENT_SOURCE_DIR}/${file})
  endforeach()
  list(FILTER tests INCLUDE REGEX "_test\\.cc$")
  add_library(${name} STATIC ${sources} ${arg_SOURCES})
  target_link_libraries(${name} PUBLIC relmap_flags ${arg_LINK} PRIVATE ${arg_PRIVATE_LINK})
  relmap_precompiled_headers(${name})
  if(arg_THREAD_TESTS)
    set(thread_tests ${arg_THREAD_TESTS})
    list(TRANSFORM thread_tests PREPEND ${CMAKE_CURRENT_SOURCE_DIR}/)
    list(REMOVE_ITEM tests ${thread_tests})
    relmap_test(${name}_threads_test SOURCES ${thread_tests} LINK ${name} ${arg_TEST_LINK} THREADS)
  endif()
  if(tests)
    relmap_test(${name}_test SOURCES ${tests} LINK ${name} ${arg_TEST_LINK} FULL_TIMEOUT ${arg_TEST_FULL_TIMEOUT})
  endif()
endfunction()

function(relmap_program name)
  cmake_parse_arguments(arg "" "" "SOURCES;LINK" ${ARGN})
  add_executable(${name} ${arg_SOURCES})
  target_link_libraries(${name} PRIVATE relmap_flags ${arg_LINK})
  relmap_precompiled_headers(${name})
endfunction()

add_custom_target(relmap_fuzzers)
set(RELMAP_FUZZERS ${CMAKE_BINARY_DIR}/fuzzers.txt)  # a line for each: its name and what it covers
file(WRITE ${RELMAP_FUZZERS} "")
function(relmap_fuzzer name)
  cmake_parse_arguments(arg "" "" "SOURCES;LINK;COVERS" ${ARGN})
  add_dependencies(relmap_fuzzers ${name})
  set(covered "")
  foreach(file ${arg_COVERS})
    cmake_path(ABSOLUTE_PATH file NORMALIZE)
    if(NOT EXISTS ${file})
      message(FATAL_ERROR "${name} covers ${file}, which does not exist")
    endif()
    cmake_path(RELATIVE_PATH file BASE_DIRECTORY ${CMAKE_SOURCE_DIR})
    string(APPEND covered " ${file}")
  endforeach()
  if(NOT covered)
    message(FATAL_ERROR "${name} does not say which files it COVERS")
  endif()
  file(APPEND ${RELMAP_FUZZERS} "${name}${covered}\n")
  if(RELMAP_FUZZ)
    add_executable(${name} ${arg_SOURCES})
    target_link_options(${name} PRIVATE -fsanitize=fuzzer)
    target_link_libraries(${name} PRIVATE relmap_flags ${arg_LINK})
  else()
    add_executable(${name} ${arg_SOURCES} ${CMAKE_SOURCE_DIR}/tests/replay_corpus_main.cc)
    target_link_libraries(${name} PRIVATE relmap_flags ${arg_LINK})
    target_compile_options(${name} PRIVATE ${RELMAP_QUICK_OPTIONS})
    set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/tests)
    add_test(NAME ${name}.corpus COMMAND ${name} ${CMAKE_SOURCE_DIR}/tests/corpus/${name})
    set_tests_properties(${name}.corpus PROPERTIES TIMEOUT 60 LABELS ci)
  endif()
endfunction()
