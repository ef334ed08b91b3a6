# CUMULET_PRIVATE_DEPENDENCIES: libcumulet contains its third-party libraries. Its version script hides their symbols, so
# that other versions can be in the same process. Sets CUMULET_LINKED, the libraries that it links: for each target of
# CUMULET_LIBRARIES its static libraries, or the target if it has none that a shared library can contain. One line names
# the targets that stay shared.

set(CUMULET_LINKED ${CUMULET_LIBRARIES})
if(NOT CUMULET_PRIVATE_DEPENDENCIES)
  return()
endif()
if(CUMULET_STATIC OR NOT UNIX OR APPLE)
  message(FATAL_ERROR "CUMULET_PRIVATE_DEPENDENCIES needs a shared library with a version script (ELF)")
endif()

# Static libraries per target. Names after "|" are libraries that these use; the shared ones do too.
set(archives_of_TBB::tbb "tbb")
set(archives_of_ZLIB::ZLIB "z")
set(archives_of_JPEG::JPEG "jpeg")
set(archives_of_Cumulet::Blosc "blosc|lz4|snappy|zstd|z")
set(archives_of_Cumulet::OpenEXR "OpenEXR;OpenEXRCore;IlmThread;Iex;Imath|deflate|z")
set(archives_of_OpenVDB::openvdb "openvdb|boost_iostreams|tbb|blosc|lz4|snappy|zstd|z")
set(archives_of_TinyGLTF::TinyGLTF "tinygltf")
set(archives_of_draco::draco "draco")
set(archives_of_meshoptimizer::meshoptimizer "meshoptimizer")
set(archives_of_TIFF::TIFF "tiff|webp|sharpyuv|zstd|lzma|Lerc|jbig|jpeg|deflate|z")
set(archives_of_Cumulet::WebP "webp|sharpyuv")

# Sets CUMULET_ARCHIVE_NAME to a static library of position-independent code, or to a name that ends in NOTFOUND.
function(cumulet_find_archive name)
  if(DEFINED CACHE{CUMULET_ARCHIVE_${name}})
    return()
  endif()
  find_library(CUMULET_ARCHIVE_${name} NAMES lib${name}.a lib${name}-3_1.a lib${name}-3_2.a lib${name}-3_3.a
               HINTS ${CUMULET_OPENVDB_ROOT} PATH_SUFFIXES lib)
  if(NOT CUMULET_ARCHIVE_${name})
    return()
  endif()
  file(WRITE ${PROJECT_BINARY_DIR}/private/probe.c "int cumulet_probe;\n")
  try_compile(suits ${PROJECT_BINARY_DIR}/private/${name} SOURCES ${PROJECT_BINARY_DIR}/private/probe.c
              LINK_OPTIONS -shared
              LINK_LIBRARIES -Wl,--whole-archive ${CUMULET_ARCHIVE_${name}} -Wl,--no-whole-archive)
  if(NOT suits)
    set(CUMULET_ARCHIVE_${name} CUMULET_ARCHIVE_${name}-NOTFOUND CACHE FILEPATH
        "Its code is not position-independent" FORCE)
  endif()
endfunction()

# Appends the static libraries of a target to `inside` and `used`, and sets `whole` to whether all were found.
function(cumulet_take_archives target)
  string(REPLACE "|" ";" parts "${archives_of_${target}}")
  string(REGEX REPLACE "\\|.*" "" own "${archives_of_${target}}")
  set(found)
  foreach(name IN LISTS parts)
    cumulet_find_archive(${name})
    if(CUMULET_ARCHIVE_${name})
      list(APPEND found ${CUMULET_ARCHIVE_${name}})
    elseif(name IN_LIST own)
      set(whole OFF PARENT_SCOPE)
      return()
    else()
      find_library(CUMULET_SHARED_${name} ${name})
      if(CUMULET_SHARED_${name})
        list(APPEND found ${CUMULET_SHARED_${name}})
      endif()
    endif()
  endforeach()
  set(whole ON PARENT_SCOPE)
  set(inside ${inside} ${found} PARENT_SCOPE)
endfunction()

set(inside)
set(shared)
set(stays)
foreach(target IN LISTS CUMULET_LIBRARIES)
  if(target STREQUAL "Threads::Threads")
    list(APPEND shared ${target})
    continue()
  endif()
  get_target_property(type ${target} TYPE)
  if(type STREQUAL "STATIC_LIBRARY")
    list(APPEND shared ${target}) # a static library already
    continue()
  endif()
  cumulet_take_archives(${target})
  if(NOT whole)
    list(APPEND shared ${target})
    string(REGEX REPLACE ".*::" "" name ${target})
    list(APPEND stays ${name})
  endif()
endforeach()
list(REMOVE_DUPLICATES inside)

# Shared libraries come first. Debian's libdraco.a contains an older tinygltf, which must not replace libtinygltf. The
# linker would take it together with functions of stb, which libtinygltf.so needs and that archive contains too. As no
# code of Cumulet calls these, a linker that drops unneeded libraries would drop libstb.
if("TinyGLTF::TinyGLTF" IN_LIST shared)
  find_library(CUMULET_SHARED_stb stb)
  if(CUMULET_SHARED_stb)
    list(APPEND shared -Wl,--no-as-needed ${CUMULET_SHARED_stb} -Wl,--as-needed)
  endif()
endif()
set(CUMULET_LINKED ${shared})
if(inside)
  list(JOIN inside "," group)
  list(APPEND CUMULET_LINKED "$<LINK_GROUP:RESCAN,${group}>")
endif()
# Targets may name libraries again that are inside already.
list(APPEND CUMULET_LINKED -Wl,--as-needed)
file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/private_libraries.txt CONTENT "@inside@" @ONLY)
if(stays)
  list(JOIN stays ", " stays)
  message(NOTICE "CUMULET_PRIVATE_DEPENDENCIES: ${stays} stay shared libraries, because there are no static ones of "
                 "position-independent code")
endif()
