# Third-party libraries. Debian 12 packages all of them; other systems provide them through the same find calls.
# third_party_notes/ gives the reason for each one.

set(CMAKE_THREAD_PREFER_PTHREAD ON)
find_package(Threads REQUIRED)
find_package(TBB REQUIRED)
find_package(PkgConfig REQUIRED)

# Debian installs FindOpenVDB.cmake next to the library, where CMake does not search.
find_path(CUMULET_OPENVDB_MODULE_DIR FindOpenVDB.cmake
          PATHS /usr/lib/${CMAKE_LIBRARY_ARCHITECTURE}/cmake/OpenVDB /usr/lib/cmake/OpenVDB
                /usr/local/lib/cmake/OpenVDB
          NO_DEFAULT_PATH)
if(CUMULET_OPENVDB_MODULE_DIR)
  list(APPEND CMAKE_MODULE_PATH ${CUMULET_OPENVDB_MODULE_DIR})
endif()
find_package(OpenVDB REQUIRED)
find_path(CUMULET_NANOVDB_INCLUDE_DIR nanovdb/NanoVDB.h REQUIRED)

# glTF: the parser and the decoders of compressed buffers.
find_package(TinyGLTF CONFIG REQUIRED)
find_package(draco CONFIG REQUIRED)
# Debian's libdraco exports an older tinygltf of its own. This dependency puts the right one first wherever a target
# links both.
set_property(TARGET TinyGLTF::TinyGLTF APPEND PROPERTY INTERFACE_LINK_LIBRARIES draco::draco)
find_package(meshoptimizer CONFIG REQUIRED)
pkg_check_modules(CUMULET_WEBP REQUIRED IMPORTED_TARGET GLOBAL libwebp)
pkg_check_modules(CUMULET_JPEG REQUIRED IMPORTED_TARGET GLOBAL libjpeg)
find_path(CUMULET_JSON_INCLUDE_DIR nlohmann/json.hpp REQUIRED)

find_path(CUMULET_GLM_INCLUDE_DIR glm/glm.hpp REQUIRED)
add_library(cumulet_glm INTERFACE)
target_include_directories(cumulet_glm SYSTEM INTERFACE ${CUMULET_GLM_INCLUDE_DIR})

# glad 2 from Debian's python3-glad generates the OpenGL function table, offline because of --reproducible.
find_program(CUMULET_GLAD_PYTHON NAMES python3 PATHS /usr/bin NO_DEFAULT_PATH)
if(NOT CUMULET_GLAD_PYTHON)
  find_program(CUMULET_GLAD_PYTHON NAMES python3 REQUIRED)
endif()
set(CUMULET_GLAD_DIR ${CMAKE_BINARY_DIR}/glad)
if(NOT EXISTS ${CUMULET_GLAD_DIR}/src/gl.c)
  execute_process(
    COMMAND ${CUMULET_GLAD_PYTHON} -m glad --quiet --reproducible --api gl:core=4.5 --extensions "" --out-path
            ${CUMULET_GLAD_DIR} c --mx
    RESULT_VARIABLE glad_result OUTPUT_QUIET ERROR_VARIABLE glad_error)
  if(NOT glad_result EQUAL 0)
    message(FATAL_ERROR "glad 2 (Debian: python3-glad) could not write the GL function table: ${glad_error}")
  endif()
endif()
add_library(cumulet_glad OBJECT ${CUMULET_GLAD_DIR}/src/gl.c)
target_include_directories(cumulet_glad SYSTEM PUBLIC ${CUMULET_GLAD_DIR}/include)

find_program(GLSLANG_VALIDATOR glslangValidator)
