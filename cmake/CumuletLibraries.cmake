# The third-party libraries inside libcumulet. The build includes this file. The CMake package of a static libcumulet
# includes it too, because a program that links that library also links these.
# Sets CUMULET_LIBRARIES, the targets to link. A package with a CMake file is found by that file, others by pkg-config.

set(CMAKE_THREAD_PREFER_PTHREAD ON)
set(CUMULET_LIBRARIES)

# Adds the target Cumulet::NAME, unless it exists, for a module of pkg-config.
function(cumulet_find_by_pkg_config name module)
  if(TARGET Cumulet::${name} OR NOT CUMULET_PKG_CONFIG)
    return()
  endif()
  find_package(PkgConfig QUIET)
  if(PkgConfig_FOUND)
    pkg_check_modules(CUMULET_${name} QUIET IMPORTED_TARGET GLOBAL ${module})
  endif()
  if(CUMULET_${name}_FOUND)
    add_library(Cumulet::${name} INTERFACE IMPORTED GLOBAL)
    target_link_libraries(Cumulet::${name} INTERFACE PkgConfig::CUMULET_${name})
  endif()
endfunction()

# Adds the target Cumulet::NAME, unless it exists, for the target of a package with a CMake file.
macro(cumulet_find_by_config name package target)
  if(NOT TARGET Cumulet::${name})
    find_package(${package} CONFIG QUIET)
    if(TARGET ${target})
      add_library(Cumulet::${name} INTERFACE IMPORTED GLOBAL)
      target_link_libraries(Cumulet::${name} INTERFACE ${target})
    endif()
  endif()
endmacro()

function(cumulet_require name text)
  if(NOT TARGET Cumulet::${name})
    message(FATAL_ERROR "Cumulet needs ${text}")
  endif()
endfunction()

# find_package() would check the version too, but Conan's packages accept only versions of the same major number.
macro(cumulet_require_version package version)
  if(DEFINED ${package}_VERSION AND ${package}_VERSION VERSION_LESS ${version})
    message(FATAL_ERROR "Cumulet needs ${package} ${version} or later, not ${${package}_VERSION}")
  endif()
endmacro()

find_package(Threads REQUIRED)
find_package(TBB REQUIRED)
cumulet_require_version(TBB 2021)
find_package(ZLIB REQUIRED)
find_package(JPEG REQUIRED)
list(APPEND CUMULET_LIBRARIES Threads::Threads TBB::tbb ZLIB::ZLIB JPEG::JPEG)

find_path(CUMULET_BLOSC_INCLUDE_DIR blosc.h)
find_library(CUMULET_BLOSC_LIBRARY NAMES blosc libblosc)
if(NOT TARGET Cumulet::Blosc AND CUMULET_BLOSC_INCLUDE_DIR AND CUMULET_BLOSC_LIBRARY)
  add_library(Cumulet::Blosc UNKNOWN IMPORTED GLOBAL)
  set_target_properties(Cumulet::Blosc PROPERTIES IMPORTED_LOCATION ${CUMULET_BLOSC_LIBRARY}
                        INTERFACE_INCLUDE_DIRECTORIES ${CUMULET_BLOSC_INCLUDE_DIR})
endif()
cumulet_require(Blosc "blosc.h and its library: set CUMULET_BLOSC_INCLUDE_DIR and CUMULET_BLOSC_LIBRARY")
list(APPEND CUMULET_LIBRARIES Cumulet::Blosc)

# pkg-config comes first, because Debian 12's CMake package of Imath reports a missing library of Python.
cumulet_find_by_pkg_config(OpenEXR OpenEXR>=3)
cumulet_find_by_config(OpenEXR OpenEXR OpenEXR::OpenEXR)
cumulet_require(OpenEXR "OpenEXR 3 or later")
cumulet_require_version(OpenEXR 3)
list(APPEND CUMULET_LIBRARIES Cumulet::OpenEXR)

if(CUMULET_OPENVDB)
  # OpenVDB installs FindOpenVDB.cmake next to the library, where CMake does not search.
  find_path(CUMULET_OPENVDB_MODULE_DIR FindOpenVDB.cmake HINTS ${CUMULET_OPENVDB_ROOT}
            PATH_SUFFIXES lib/${CMAKE_LIBRARY_ARCHITECTURE}/cmake/OpenVDB lib/cmake/OpenVDB lib64/cmake/OpenVDB
                          share/openvdb)
  if(CUMULET_OPENVDB_ROOT)
    set(OpenVDB_ROOT ${CUMULET_OPENVDB_ROOT})
  endif()
  if(CUMULET_OPENVDB_MODULE_DIR)
    list(APPEND CMAKE_MODULE_PATH ${CUMULET_OPENVDB_MODULE_DIR})
  endif()
  if(NOT TARGET OpenVDB::openvdb)
    find_package(OpenVDB REQUIRED)
    cumulet_require_version(OpenVDB 10)
  endif()
  list(APPEND CUMULET_LIBRARIES OpenVDB::openvdb)
endif()

# TinyGLTF is a library (Debian) or only a header. The build compiles the header's functions into libcumulet.
find_package(TinyGLTF CONFIG QUIET)
set(CUMULET_TINYGLTF_IS_HEADER OFF)
if(TARGET TinyGLTF::TinyGLTF)
  get_target_property(type TinyGLTF::TinyGLTF TYPE)
  list(APPEND CUMULET_LIBRARIES TinyGLTF::TinyGLTF)
  if(type STREQUAL "INTERFACE_LIBRARY")
    set(CUMULET_TINYGLTF_IS_HEADER ON)
  endif()
else()
  find_path(CUMULET_TINYGLTF_INCLUDE_DIR tiny_gltf.h)
  set(CUMULET_TINYGLTF_IS_HEADER ON)
endif()

if(CUMULET_DRACO)
  find_package(draco CONFIG REQUIRED)
  list(APPEND CUMULET_LIBRARIES draco::draco)
endif()
if(CUMULET_MESHOPT)
  find_package(meshoptimizer CONFIG REQUIRED)
  list(APPEND CUMULET_LIBRARIES meshoptimizer::meshoptimizer)
endif()
if(CUMULET_WEBP)
  cumulet_find_by_config(WebP WebP WebP::webp)
  cumulet_find_by_pkg_config(WebP libwebp)
  cumulet_require(WebP "libwebp, or CUMULET_WEBP=OFF")
  list(APPEND CUMULET_LIBRARIES Cumulet::WebP)
endif()
