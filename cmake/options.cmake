# Compile options every target shares, and the helpers that make a library or a test.

add_library(upright_options INTERFACE)
target_compile_options(upright_options INTERFACE -Wall -Wextra -Wpedantic -Wshadow -Wno-psabi)
# g++ 12 takes the undefined lanes of its own AVX-512 intrinsics for ours (its bug 105593).
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
  target_compile_options(upright_options INTERFACE -Wno-maybe-uninitialized)
endif()
# g++ searches its memory for garbage each time it has doubled, from 128 MB on. Most of it stays in use until the end: without
# the search below 4 GiB, more than any unit takes (2.5 GB), a unit takes a tenth less processor time.
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  target_compile_options(upright_options INTERFACE "SHELL:--param ggc-min-heapsize=4194304")
endif()
# A voltage, a simulated motion and a log have the same bits on every machine of an architecture: all is compiled for its
# baseline, and no product is fused into a sum. Only lanes and fits are compiled for more (UPRIGHT_WIDE_ARCH).
target_compile_options(upright_options INTERFACE -ffp-contract=off)
if(CMAKE_SYSTEM_PROCESSOR MATCHES "^(x86_64|AMD64)$")
  target_compile_options(upright_options INTERFACE -march=x86-64)
endif()
# What a fit allocates others free, and the other way round: Eigen's alignment is that of AVX-512 everywhere.
target_compile_definitions(upright_options INTERFACE EIGEN_MAX_ALIGN_BYTES=64 EIGEN_MAX_STATIC_ALIGN_BYTES=64)
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

# Effects of one's own: a header in place of include/upright/model/effects/all.hpp, which therefore stands first everywhere.
set(extra_folder)
if(UPRIGHT_EXTRA_EFFECTS)
  set(extra_folder ${PROJECT_BINARY_DIR}/extra)
  configure_file(${PROJECT_SOURCE_DIR}/cmake/extra_effects.hpp.in ${extra_folder}/upright/model/effects/all.hpp @ONLY)
endif()

# upright_compile_together(NAME): the sources of a target are one translation unit. Most of their compile time is the reading of
# headers, which is done once then. The names in the unnamed namespaces of a target must therefore differ.
function(upright_compile_together name)
  set_target_properties(${name} PROPERTIES UNITY_BUILD ${UPRIGHT_UNITY} UNITY_BUILD_BATCH_SIZE 0)
  # g++ takes what such a unit includes for headers, and warns of their unnamed namespaces.
  if(UPRIGHT_UNITY AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    target_compile_options(${name} PRIVATE -Wno-subobject-linkage)
  endif()
endfunction()

# upright_compile_alone(SOURCES...): sources of this folder that are translation units of their own. With g++ a unit with many
# types of Eigen takes longer than its parts do: the folder model 52.9 s in one unit and 48.9 s in four.
function(upright_compile_alone)
  set_source_files_properties(${ARGN} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
endfunction()

# upright_optimise(NAME LEVEL): another level of optimisation than -O2 in a release build.
function(upright_optimise name level)
  target_compile_options(${name} PRIVATE $<$<CONFIG:Release>:-O${level}>)
endfunction()

# upright_library(NAME SOURCES... OFFERS HEADERS... LINK PUBLIC-TARGETS... PRIVATE PRIVATE-TARGETS...): the library of a
# folder. Other folders may include its headers in include/upright and those it OFFERS (scripts/check_includes.py).
function(upright_library name)
  cmake_parse_arguments(arg "" "" "SOURCES;OFFERS;LINK;PRIVATE" ${ARGN})
  if(arg_SOURCES)
    add_library(${name} STATIC ${arg_SOURCES})
    target_include_directories(${name} PUBLIC $<BUILD_INTERFACE:${extra_folder}> $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include>
                               $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/src> $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}>)
    # upright_options is of this build alone: whoever links an installed library has options of their own.
    target_link_libraries(${name} PUBLIC ${arg_LINK} PRIVATE ${arg_PRIVATE} $<BUILD_INTERFACE:upright_options>)
    upright_compile_together(${name})
  else()
    add_library(${name} INTERFACE)
    target_include_directories(${name} INTERFACE $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include>)
    target_link_libraries(${name} INTERFACE ${arg_LINK})
  endif()
endfunction()

# upright_embed(TARGET NAME=FILE...): each file as the C++ text NAME.inc, which the sources of the target may include.
function(upright_embed target)
  set(folder ${CMAKE_CURRENT_BINARY_DIR}/embedded)
  set(script ${PROJECT_SOURCE_DIR}/cmake/embed_text.cmake)
  set(texts)
  foreach(pair IN LISTS ARGN)
    string(REGEX MATCH "^(.*)=(.*)$" pair ${pair})
    set(text ${folder}/${CMAKE_MATCH_1}.inc)
    cmake_path(ABSOLUTE_PATH CMAKE_MATCH_2 OUTPUT_VARIABLE file)
    add_custom_command(OUTPUT ${text} COMMAND ${CMAKE_COMMAND} -DSOURCE=${file} -DOUTPUT=${text} -P ${script}
                       DEPENDS ${file} ${script})
    list(APPEND texts ${text})
  endforeach()
  target_sources(${target} PRIVATE ${texts})
  target_include_directories(${target} PRIVATE ${folder})
  add_custom_target(${target}_texts DEPENDS ${texts})
  add_dependencies(embedded_texts ${target}_texts)
endfunction()

# upright_own_object(NAME INTO LIBRARY SOURCES... [ARCH -march] [OPTIONS COMPILE-OPTIONS...] LINK TARGETS... [UNSANITIZED
# SOURCES...]): sources of a library with compile options of their own, as one object file. An inline function that these and
# other files use would be linked from either; so what is inline stays inside the object file (keep_inside.sh), which offers
# only its own functions. UNSANITIZED are those that the sanitizers leave out: say why at the call.
function(upright_own_object name)
  cmake_parse_arguments(arg "" "INTO;ARCH" "SOURCES;OPTIONS;LINK;UNSANITIZED" ${ARGN})
  add_library(${name} OBJECT ${arg_SOURCES})
  upright_optimise(${name} 3)
  target_include_directories(${name} PRIVATE ${extra_folder} ${PROJECT_SOURCE_DIR}/include ${PROJECT_SOURCE_DIR}/src ${PROJECT_SOURCE_DIR})
  # A target of its own, and the last one: then these options win over those before.
  add_library(${name}_options INTERFACE)
  target_compile_options(${name}_options INTERFACE ${arg_OPTIONS})
  if(arg_ARCH)
    target_compile_options(${name}_options INTERFACE -march=${arg_ARCH})
  endif()
  # objcopy leaves GNU's unique symbols global.
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    target_compile_options(${name}_options INTERFACE -fno-gnu-unique)
  endif()
  if(UPRIGHT_SANITIZE AND arg_UNSANITIZED)
    set_source_files_properties(${arg_UNSANITIZED} PROPERTIES COMPILE_OPTIONS -fno-sanitize=all)
  endif()
  target_link_libraries(${name} PRIVATE ${arg_LINK} upright_options ${name}_options)
  upright_compile_together(${name})
  set(script ${PROJECT_SOURCE_DIR}/cmake/keep_inside.sh)
  set(object ${CMAKE_CURRENT_BINARY_DIR}/${name}.o)
  set(objects $<TARGET_OBJECTS:${name}>)
  add_custom_command(OUTPUT ${object}
    COMMAND ${script} ${CMAKE_LINKER} ${CMAKE_NM} ${CMAKE_OBJCOPY} ${object} ${objects}
    DEPENDS ${script} ${name} ${objects} COMMAND_EXPAND_LISTS VERBATIM)
  set_source_files_properties(${object} PROPERTIES EXTERNAL_OBJECT TRUE GENERATED TRUE)
  target_sources(${arg_INTO} PRIVATE ${object})
  set_property(GLOBAL APPEND PROPERTY UPRIGHT_OWN_OBJECTS ${object})
endfunction()

# upright_test(NAME SOURCES... LINK TARGETS... LABELS ...): one GoogleTest program, one ctest entry.
function(upright_test name)
  cmake_parse_arguments(arg "" "TIMEOUT" "SOURCES;LINK;LABELS" ${ARGN})
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
  add_test(NAME ${name} COMMAND ${name})
  set_tests_properties(${name} PROPERTIES TIMEOUT ${arg_TIMEOUT} LABELS "${arg_LABELS}")
endfunction()
