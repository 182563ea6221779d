# Whether and how CUDA is compiled. Sets SHERD_HAVE_CUDA and, with it, enables the language for every
# directory (what links sherd_cuda must know it too).
#
# SHERD_CUDA=AUTO takes a toolkit that is there, ON demands one, OFF leaves it alone.
# SHERD_CUDA_ARCHITECTURES: machine code for each -real entry, and PTX (-virtual) for GPUs newer than
# the list. One entry makes a build for one machine short: -DSHERD_CUDA_ARCHITECTURES=90.
set(SHERD_CUDA_ARCHITECTURES
    "75-real;80-real;86-real;89-real;90-real;120-real;90-virtual"
    CACHE STRING "GPU architectures to compile for (CMAKE_CUDA_ARCHITECTURES' syntax)")
set(SHERD_HAVE_CUDA OFF)
if(SHERD_CUDA STREQUAL "OFF")
  return()
endif()
if(NOT SHERD_CUDA MATCHES "^(AUTO|ON)$")
  message(FATAL_ERROR "SHERD_CUDA is '${SHERD_CUDA}': use AUTO, ON or OFF")
endif()

# The toolkit installs itself beside the PATH.
if(NOT CMAKE_CUDA_COMPILER AND NOT DEFINED ENV{CUDACXX})
  find_program(SHERD_NVCC nvcc HINTS ENV CUDA_PATH PATHS /usr/local/cuda PATH_SUFFIXES bin)
  if(SHERD_NVCC)
    set(CMAKE_CUDA_COMPILER ${SHERD_NVCC})
  endif()
endif()
# Never `native`: it fails where the build machine has no GPU.
set(CMAKE_CUDA_ARCHITECTURES ${SHERD_CUDA_ARCHITECTURES})
include(CheckLanguage)
check_language(CUDA)
if(NOT CMAKE_CUDA_COMPILER)
  if(SHERD_CUDA STREQUAL "ON")
    message(FATAL_ERROR "SHERD_CUDA is ON, but no CUDA compiler (nvcc) works here: install the CUDA "
                        "toolkit, name it by -DCMAKE_CUDA_COMPILER, or set SHERD_CUDA=OFF")
  endif()
  message(STATUS "CUDA: no compiler found, building without")
  return()
endif()
enable_language(CUDA)
if(CMAKE_CUDA_COMPILER_VERSION VERSION_LESS 12.0)
  if(SHERD_CUDA STREQUAL "ON")
    message(FATAL_ERROR "CUDA ${CMAKE_CUDA_COMPILER_VERSION} is too old: 12.0 or newer is needed")
  endif()
  message(STATUS "CUDA: ${CMAKE_CUDA_COMPILER_VERSION} is too old (12.0), building without")
  return()
endif()
# CMake 3.25 does not know that nvcc has C++20.
if(NOT CMAKE_CUDA20_STANDARD_COMPILE_OPTION)
  set(CMAKE_CUDA20_STANDARD_COMPILE_OPTION "-std=c++20")
  set(CMAKE_CUDA20_EXTENSION_COMPILE_OPTION "-std=c++20")
endif()
set(CMAKE_CUDA_STANDARD 20)
set(CMAKE_CUDA_STANDARD_REQUIRED ON)
set(CMAKE_CUDA_EXTENSIONS OFF)
set(SHERD_HAVE_CUDA ON)
message(STATUS "CUDA: ${CMAKE_CUDA_COMPILER_VERSION} for ${CMAKE_CUDA_ARCHITECTURES}")
