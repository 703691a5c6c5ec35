# SPDX-License-Identifier: Apache-2.0
# Installs the library to a prefix below the working directory, and configures and builds the project
# beside this file against it: -DBUILD=FOLDER [-DCXX_FLAGS=...] -DMAKE=uses_volcomp, which is then
# run, or -DMAKE=headers with -DCOMPILER=g++ or clang++.
cmake_minimum_required(VERSION 3.25)
set(source ${CMAKE_CURRENT_LIST_DIR})
set(work $ENV{TMPDIR})
function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE result OUTPUT_VARIABLE output
    ERROR_VARIABLE output)
  message(STATUS "${output}")
  if(NOT result EQUAL 0)
    list(JOIN ARGN " " command)
    message(FATAL_ERROR "${command}")
  endif()
endfunction()

set(compiler)
if(COMPILER)
  find_program(found ${COMPILER})
  if(NOT found)
    message("skipped: ${COMPILER} is not installed")
    return()
  endif()
  set(compiler -DCMAKE_CXX_COMPILER=${found})
endif()
run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${work}/prefix --component development)
run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${work}/prefix --component programs)

# A program with other -m flags would see other types than the library.
file(GLOB_RECURSE headers ${work}/prefix/include/*.h)
foreach(header ${headers})
  file(STRINGS ${header} lines REGEX "__(AVX|SSE|FMA|F16C|BMI)|immintrin\\.h|HWY_|hwy/")
  if(lines)
    message(FATAL_ERROR "${header} depends on the instruction set of who includes it: ${lines}")
  endif()
endforeach()

run(${CMAKE_COMMAND} -G Ninja -S ${source} -B ${work}/build -Wno-dev
  -DCMAKE_PREFIX_PATH=${work}/prefix -DCMAKE_CXX_FLAGS=${CXX_FLAGS} ${compiler})
run(${CMAKE_COMMAND} --build ${work}/build --target ${MAKE} -- -k 0)
if(MAKE STREQUAL uses_volcomp)
  run(${work}/build/uses_volcomp ${source}/../interop/scene.toml ${work}/a.vdb)
endif()
