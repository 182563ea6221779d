# One place for what every target of the house shares.

find_program(SHERD_CCACHE ccache)
if(SHERD_CCACHE)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${SHERD_CCACHE})
  set(CMAKE_CUDA_COMPILER_LAUNCHER ${SHERD_CCACHE})
endif()

add_library(sherd_options INTERFACE)
target_include_directories(sherd_options INTERFACE ${PROJECT_SOURCE_DIR})
target_compile_options(sherd_options INTERFACE
  $<$<COMPILE_LANGUAGE:CXX>:-Wall -Wextra -Wshadow -Wno-missing-field-initializers>)
if(SHERD_WERROR)
  target_compile_options(sherd_options INTERFACE $<$<COMPILE_LANGUAGE:CXX>:-Werror>)
endif()
if(SHERD_SANITIZE)
  target_compile_options(sherd_options INTERFACE
    $<$<COMPILE_LANGUAGE:CXX>:-fsanitize=${SHERD_SANITIZE} -fno-omit-frame-pointer -g>)
  target_link_options(sherd_options INTERFACE -fsanitize=${SHERD_SANITIZE})
endif()

# sherd_room(NAME SOURCES... ): the static library of one room.
function(sherd_room name)
  add_library(${name} STATIC ${ARGN})
  target_link_libraries(${name} PUBLIC sherd_options)
endfunction()

# sherd_test(NAME SOURCES... LIBRARIES...): one GoogleTest program, its cases discovered by ctest.
function(sherd_test name)
  cmake_parse_arguments(T "" "TIMEOUT" "SOURCES;LIBRARIES" ${ARGN})
  add_executable(${name} ${T_SOURCES})
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_CURRENT_BINARY_DIR})
  target_link_libraries(${name} PRIVATE ${T_LIBRARIES} sherd_options GTest::gtest GTest::gmock
                                        GTest::gtest_main)
  target_compile_definitions(${name} PRIVATE
    SHERD_SOURCE_DIR="${PROJECT_SOURCE_DIR}" SHERD_BINARY_DIR="${PROJECT_BINARY_DIR}")
  if(NOT T_TIMEOUT)
    set(T_TIMEOUT 300)
  endif()
  gtest_discover_tests(${name} DISCOVERY_TIMEOUT 60 PROPERTIES TIMEOUT ${T_TIMEOUT})
endfunction()
