# Compile options every target shares, and the two helpers that make a library or a test.

add_library(upright_options INTERFACE)
target_compile_options(upright_options INTERFACE -Wall -Wextra -Wpedantic -Wshadow -Wno-psabi)
# g++ 12 takes the undefined lanes of its own AVX-512 intrinsics for ours (its bug 105593).
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
  target_compile_options(upright_options INTERFACE -Wno-maybe-uninitialized)
endif()
# Built where it runs: the machine's own SIMD makes fits and sweeps several times faster. All targets share the flag,
# since Eigen's alignment must be the same everywhere.
if(UPRIGHT_NATIVE)
  # GCC 12 warns of its own AVX-512 intrinsics.
  target_compile_options(upright_options INTERFACE -march=native -ffp-contract=off -Wno-maybe-uninitialized)
  # QEMU's processor, which runs the tests of GPIO and Comedi, has none.
  if(NOT UPRIGHT_AVX512)
    include(CheckCXXCompilerFlag)
    check_cxx_compiler_flag("-mno-avx512f -mno-avxvnni" UPRIGHT_CAN_LEAVE_AVX512)
    if(UPRIGHT_CAN_LEAVE_AVX512)
      target_compile_options(upright_options INTERFACE -mno-avx512f -mno-avxvnni)
    endif()
  endif()
endif()
if(UPRIGHT_WERROR)
  target_compile_options(upright_options INTERFACE -Werror)
endif()
if(UPRIGHT_SANITIZE)
  target_compile_options(upright_options INTERFACE -fsanitize=${UPRIGHT_SANITIZE} -fno-omit-frame-pointer
                         -fno-sanitize-recover=all)
  target_link_options(upright_options INTERFACE -fsanitize=${UPRIGHT_SANITIZE})
  # What the address sanitizer finds as well, for twice the time to compile.
  if(UPRIGHT_SANITIZE MATCHES "address.*undefined" AND NOT UPRIGHT_FUZZ)
    target_compile_options(upright_options INTERFACE -fno-sanitize=null,object-size)
  endif()
endif()
if(UPRIGHT_FUZZ)
  target_compile_options(upright_options INTERFACE -fsanitize=fuzzer-no-link)
endif()

# upright_library(NAME SOURCES... OFFERS HEADERS... LINK PUBLIC-TARGETS... PRIVATE PRIVATE-TARGETS...): the library of a
# folder. Other folders may include its headers in include/upright and those it OFFERS (scripts/check_includes.py).
function(upright_library name)
  cmake_parse_arguments(arg "" "" "SOURCES;OFFERS;LINK;PRIVATE" ${ARGN})
  if(arg_SOURCES)
    add_library(${name} STATIC ${arg_SOURCES})
    target_include_directories(${name} PUBLIC ${PROJECT_SOURCE_DIR}/include
                               ${PROJECT_SOURCE_DIR}/src ${PROJECT_SOURCE_DIR})
    target_link_libraries(${name} PUBLIC ${arg_LINK} PRIVATE ${arg_PRIVATE} upright_options)
  else()
    add_library(${name} INTERFACE)
    target_include_directories(${name} INTERFACE ${PROJECT_SOURCE_DIR}/include)
    target_link_libraries(${name} INTERFACE ${arg_LINK})
  endif()
endfunction()

# real_time_test(NAME SECONDS PROGRAM ARGUMENTS...): a ctest entry of what needs real time: tried again for so long while
# the machine stands still, and skipped, aloud, on one that never stops doing so. PROGRAM is a target or a command.
function(real_time_test name seconds program)
  set(command ${program})
  if(TARGET ${program})
    set(command $<TARGET_FILE:${program}>)
    add_dependencies(${program} calm_machine)
  endif()
  math(EXPR timeout "2 * ${seconds}")
  add_test(NAME ${name} COMMAND calm_machine ${seconds} ${command} ${ARGN})
  set_tests_properties(${name} PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT ${timeout})
endfunction()

# upright_test(NAME SOURCES... LINK TARGETS... LABELS ...): one GoogleTest program, one ctest entry. With REAL_TIME one
# that is tried again when the machine stood still.
function(upright_test name)
  cmake_parse_arguments(arg "REAL_TIME" "TIMEOUT" "SOURCES;LINK;LABELS" ${ARGN})
  add_executable(${name} ${arg_SOURCES})
  target_link_libraries(${name} PRIVATE ${arg_LINK} GTest::gtest_main upright_options)
  target_compile_options(${name} PRIVATE ${UPRIGHT_PRELUDE_OPTIONS})
  target_precompile_headers(${name} REUSE_FROM ${UPRIGHT_TEST_PRELUDE})
  target_compile_definitions(${name} PRIVATE UPRIGHT_SOURCE_DIR="${PROJECT_SOURCE_DIR}"
                             UPRIGHT_BINARY="$<TARGET_FILE:upright>")
  if(NOT "unit" IN_LIST arg_LABELS)
    add_dependencies(${name} upright)
  else()
    add_dependencies(unit_tests ${name})
  endif()
  if(NOT arg_TIMEOUT)
    set(arg_TIMEOUT 120)
  endif()
  if(arg_REAL_TIME)
    real_time_test(${name} ${arg_TIMEOUT} ${name})
  else()
    add_test(NAME ${name} COMMAND ${name})
    set_tests_properties(${name} PROPERTIES TIMEOUT ${arg_TIMEOUT})
  endif()
  set_tests_properties(${name} PROPERTIES LABELS "${arg_LABELS}")
endfunction()
