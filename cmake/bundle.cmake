# cpack runs this on the staged tree before it makes the archive; the target cumulet_wheel runs it on a tree of libraries.
# Adds every shared library that the programs and
# libcumulet need, except those of the C library and of OpenGL, and the licenses of the added libraries.
cmake_minimum_required(VERSION 3.25)
if(NOT CPACK_GENERATOR STREQUAL "TGZ")
  return()
endif()

set(stage ${CPACK_TEMPORARY_INSTALL_DIRECTORY})
set(lib_dir ${stage}/${CPACK_CUMULET_LIBDIR})
set(licence_dir ${stage}/${CPACK_CUMULET_DOCDIR}/licences)

# Always taken from the system: the C library must match its loader, and GL, EGL and windowing must match the driver.
set(system_libraries
    "^ld-linux" "^linux-vdso" "^lib(c|m|pthread|dl|rt|util|resolv|anl|mvec|nsl)\\.so"
    "^lib(GL|GLX|GLdispatch|OpenGL|EGL|GLES[^.]*|OSMesa|gbm|drm[^.]*|glapi)\\.so"
    "^lib(X|xcb|xshmfence|wayland|xkbcommon)")
# The driver uses these too: Mesa needs LLVM, and LLVM needs these, perhaps newer versions than ours. A process loads
# one copy of each. The host's copies therefore come first, through links in lib/host/N, which dangle if the host has no
# copy there. Our copies in lib/fallback come last.
# (The host's library folders themselves are not searched, because that would override a developer's LD_LIBRARY_PATH to
# another driver.)
set(fallback_libraries "^lib(stdc\\+\\+|gcc_s|z|zstd|lzma)\\.so")
set(host_dirs /usr/lib/x86_64-linux-gnu /usr/lib64 /usr/lib)

file(GLOB programs ${stage}/${CPACK_CUMULET_BINDIR}/*)
list(FILTER programs EXCLUDE REGEX "/cumulet-farm$")  # a script
file(GLOB libraries ${lib_dir}/libcumulet*.so.*.*)
file(GET_RUNTIME_DEPENDENCIES
     EXECUTABLES ${programs} LIBRARIES ${libraries}
     RESOLVED_DEPENDENCIES_VAR resolved UNRESOLVED_DEPENDENCIES_VAR unresolved CONFLICTING_DEPENDENCIES_PREFIX conflicting
     PRE_EXCLUDE_REGEXES ${system_libraries})
if(unresolved)
  message(FATAL_ERROR "Cannot bundle, not found on this system: ${unresolved}")
endif()
# If a library is both in the staged tree and on the system, the staged one is ours and is already in place.
foreach(name ${conflicting_FILENAMES})
  if(NOT name MATCHES "^libcumulet")
    list(GET conflicting_${name} 0 first)
    list(APPEND resolved ${first})
  endif()
endforeach()

find_program(dpkg_query dpkg-query)
set(packages)
set(count 0)
foreach(library ${resolved})
  get_filename_component(name ${library} NAME)
  if(name MATCHES "^libcumulet")
    continue()
  endif()
  set(destination ${lib_dir})
  foreach(pattern ${fallback_libraries})
    if(name MATCHES ${pattern})
      set(destination ${lib_dir}/fallback)
      set(n 0)
      foreach(dir ${host_dirs})
        math(EXPR n "${n} + 1")
        file(MAKE_DIRECTORY ${lib_dir}/host/${n})
        file(CREATE_LINK ${dir}/${name} ${lib_dir}/host/${n}/${name} SYMBOLIC)
      endforeach()
    endif()
  endforeach()
  # Copies the file itself, under the name that the loader requests.
  get_filename_component(real ${library} REALPATH)
  file(MAKE_DIRECTORY ${destination})
  file(COPY_FILE ${real} ${destination}/${name})
  file(CHMOD ${destination}/${name} PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE
                                                WORLD_READ WORLD_EXECUTE)
  math(EXPR count "${count} + 1")
  # A DT_RUNPATH would hide our search path from the library's own dependencies.
  file(READ_ELF ${destination}/${name} RUNPATH runpath)
  if(runpath)
    message(FATAL_ERROR "Cannot bundle ${library}: it has a DT_RUNPATH (${runpath}). Remove that with patchelf.")
  endif()
  if(dpkg_query)
    execute_process(COMMAND ${dpkg_query} -S ${real} OUTPUT_VARIABLE owner ERROR_QUIET)
    if(NOT owner)  # merged /usr: dpkg may list the file under /lib
      string(REGEX REPLACE "^/usr" "" unmerged ${real})
      execute_process(COMMAND ${dpkg_query} -S ${unmerged} OUTPUT_VARIABLE owner ERROR_QUIET)
    endif()
    string(REGEX REPLACE ":.*" "" owner "${owner}")
    if(owner AND EXISTS /usr/share/doc/${owner}/copyright)
      list(APPEND packages ${owner})
    else()
      message(WARNING "No licence found for ${library}")
    endif()
  endif()
endforeach()

# Debian's copyright files refer to common license texts. Copies the texts that they name.
list(REMOVE_DUPLICATES packages)
foreach(package ${packages})
  get_filename_component(copyright /usr/share/doc/${package}/copyright REALPATH)
  file(MAKE_DIRECTORY ${licence_dir})
  file(COPY_FILE ${copyright} ${licence_dir}/${package}.txt)
  file(STRINGS ${licence_dir}/${package}.txt lines REGEX "common-licenses/")
  string(REGEX MATCHALL "common-licenses/[A-Za-z0-9.+-]*[A-Za-z0-9]" names "${lines}")
  foreach(name ${names})
    if(EXISTS /usr/share/${name})
      get_filename_component(text /usr/share/${name} REALPATH)
      file(MAKE_DIRECTORY ${licence_dir}/common-licenses)
      get_filename_component(base ${name} NAME)
      file(COPY_FILE ${text} ${licence_dir}/common-licenses/${base} ONLY_IF_DIFFERENT)
    endif()
  endforeach()
endforeach()
message(STATUS "Bundled ${count} shared libraries")

# The search path of our programs and libraries, in this order.
foreach(file ${programs} ${libraries})
  if(NOT IS_SYMLINK ${file})
    file(READ_ELF ${file} RPATH installed)
    set(rpath ${installed})
    foreach(folder host/1 host/2 host/3 fallback)
      string(APPEND rpath ":${installed}/${folder}")
    endforeach()
    file(RPATH_CHANGE FILE ${file} OLD_RPATH ${installed} NEW_RPATH ${rpath})
  endif()
endforeach()
