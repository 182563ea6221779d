# One place for what every target of the house shares.

find_program(SHERD_CCACHE ccache)
if(SHERD_CCACHE)
  # Paths relative to the sources: the presets share what they compile alike. The rest is what
  # ccache asks for where there are precompiled headers.
  set(SHERD_LAUNCHER ${CMAKE_COMMAND} -E env CCACHE_BASEDIR=${PROJECT_SOURCE_DIR} CCACHE_NOHASHDIR=1
      CCACHE_SLOPPINESS=pch_defines,time_macros ${SHERD_CCACHE})
  set(CMAKE_CXX_COMPILER_LAUNCHER ${SHERD_LAUNCHER})
  set(CMAKE_CUDA_COMPILER_LAUNCHER ${SHERD_LAUNCHER})
endif()

add_library(sherd_options INTERFACE)
target_include_directories(sherd_options INTERFACE ${PROJECT_SOURCE_DIR})
target_compile_options(sherd_options INTERFACE
  $<$<COMPILE_LANGUAGE:CXX>:-Wall -Wextra -Wshadow -Wno-missing-field-initializers>)
# GCC 12 takes a pair of doubles that are rounded to floats and back for the doubles themselves where
# it makes a vector of them: x - (double)(float)x becomes 0, and with it what anchors keep
# (tile_march.h).
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  target_compile_options(sherd_options INTERFACE
    $<$<COMPILE_LANGUAGE:CXX>:-fno-tree-slp-vectorize>
    $<$<COMPILE_LANGUAGE:CUDA>:-Xcompiler=-fno-tree-slp-vectorize>)
endif()
if(SHERD_WERROR)
  target_compile_options(sherd_options INTERFACE $<$<COMPILE_LANGUAGE:CXX>:-Werror>)
endif()
if(SHERD_SANITIZE)
  # Lines for the reports and no more, and no check of scopes: with either the packet tracers take
  # the compiler longer than all the rest.
  target_compile_options(sherd_options INTERFACE
    $<$<COMPILE_LANGUAGE:CXX>:-fsanitize=${SHERD_SANITIZE} -fno-sanitize-recover=all
      -fno-sanitize-address-use-after-scope -fno-omit-frame-pointer -O1 -g1>)
  target_link_options(sherd_options INTERFACE -fsanitize=${SHERD_SANITIZE})
endif()

# sherd_room(NAME SOURCES... ): the static library of one room.
function(sherd_room name)
  add_library(${name} STATIC ${ARGN})
  target_link_libraries(${name} PUBLIC sherd_options)
endfunction()

# sherd_precompile(NAME HEADERS...): the headers that most files of a target include and that take
# the compiler longer than the files.
function(sherd_precompile name)
  target_precompile_headers(${name} PRIVATE ${ARGN})
  target_compile_options(${name} PRIVATE $<$<CXX_COMPILER_ID:GNU>:-fpch-preprocess>)  # for ccache
endfunction()

# sherd_test(NAME SOURCES... LIBRARIES...): one GoogleTest program, its cases discovered by ctest.
function(sherd_test name)
  cmake_parse_arguments(T "" "TIMEOUT" "SOURCES;LIBRARIES" ${ARGN})
  add_executable(${name} ${T_SOURCES})
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_CURRENT_BINARY_DIR})
  target_link_libraries(${name} PRIVATE ${T_LIBRARIES} sherd_options GTest::gtest GTest::gmock
                                        GTest::gtest_main)
  target_compile_options(${name} PRIVATE $<$<CONFIG:Release>:-O1>)  # what they call is at -O3
  list(LENGTH T_SOURCES source_count)
  if(source_count GREATER 3)
    sherd_precompile(${name} <gmock/gmock.h> <gtest/gtest.h>)
  endif()
  target_compile_definitions(${name} PRIVATE
    SHERD_SOURCE_DIR="${PROJECT_SOURCE_DIR}" SHERD_BINARY_DIR="${PROJECT_BINARY_DIR}")
  if(NOT T_TIMEOUT)
    set(T_TIMEOUT 300)
  endif()
  gtest_discover_tests(${name} DISCOVERY_TIMEOUT 60 PROPERTIES TIMEOUT ${T_TIMEOUT})
endfunction()
