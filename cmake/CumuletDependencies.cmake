# Third-party libraries. Debian 12 packages all of them; other systems provide them through the same find calls.
# third_party_notes/ gives the reason for each one.

# A program that links a static libcumulet need not be in this folder.
set(CMAKE_FIND_PACKAGE_TARGETS_GLOBAL ${CUMULET_STATIC})
include(CumuletLibraries)
include(CumuletPrivate)

if(CUMULET_NANOVDB)
  find_path(CUMULET_NANOVDB_INCLUDE_DIR nanovdb/NanoVDB.h HINTS ${CUMULET_OPENVDB_ROOT} PATH_SUFFIXES include REQUIRED)
endif()
find_path(CUMULET_JSON_INCLUDE_DIR nlohmann/json.hpp REQUIRED)
find_path(CUMULET_GLM_INCLUDE_DIR glm/glm.hpp REQUIRED)
add_library(cumulet_glm INTERFACE)
target_include_directories(cumulet_glm SYSTEM INTERFACE ${CUMULET_GLM_INCLUDE_DIR})

if(CUMULET_TINYGLTF_IS_HEADER)
  find_path(CUMULET_TINYGLTF_INCLUDE_DIR tiny_gltf.h REQUIRED)
  find_path(CUMULET_STB_INCLUDE_DIR stb_image_write.h PATH_SUFFIXES stb REQUIRED)
elseif(CUMULET_DRACO)
  # Debian's libdraco exports an older tinygltf of its own. This dependency puts the right one first wherever a target
  # links both.
  set_property(TARGET TinyGLTF::TinyGLTF APPEND PROPERTY INTERFACE_LINK_LIBRARIES draco::draco)
endif()

# glad 2 generates the OpenGL function table, offline because of --reproducible. The system's Python comes first, because
# Debian's python3-glad belongs to it.
find_program(CUMULET_GLAD_PYTHON NAMES python3 python HINTS /usr/bin REQUIRED)
set(CUMULET_GLAD_DIR ${PROJECT_BINARY_DIR}/glad)
if(NOT EXISTS ${CUMULET_GLAD_DIR}/src/gl.c)
  execute_process(
    COMMAND ${CUMULET_GLAD_PYTHON} -m glad --quiet --reproducible --api gl:core=4.5 --extensions "" --out-path
            ${CUMULET_GLAD_DIR} c --mx
    RESULT_VARIABLE glad_result OUTPUT_QUIET ERROR_VARIABLE glad_error)
  if(NOT glad_result EQUAL 0)
    message(FATAL_ERROR "glad 2 (Debian: python3-glad; pip: glad2) could not write the GL function table: ${glad_error}")
  endif()
endif()
add_library(cumulet_glad OBJECT ${CUMULET_GLAD_DIR}/src/gl.c)
target_include_directories(cumulet_glad SYSTEM PUBLIC ${CUMULET_GLAD_DIR}/include)

find_program(GLSLANG_VALIDATOR glslangValidator)
