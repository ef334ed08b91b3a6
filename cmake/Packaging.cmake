# `cmake --install` installs the library, its headers, a CMake package, a pkg-config file, the programs with their
# manual pages, completions and desktop files, the documents and the licenses, and the reference if it was built.
# `cpack -G TGZ` adds every shared library that the programs need and packs one portable .tar.gz (bundle.cmake).
# `cpack -G DEB` makes four Debian packages that depend on Debian's own libraries (debian.cmake). A host's package
# depends on libcumulet0, which has none of the programs' dependencies (windowing). libcumulet-dev has the files for
# compiling, cumulet has the programs, and python3-cumulet has the Python package.
# The target cumulet_wheel makes a wheel of the Python package, with all shared libraries that it needs.
include(CMakePackageConfigHelpers)

set(doc_dir ${CMAKE_INSTALL_DATADIR}/doc/cumulet)
set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/Cumulet)

# --- library search paths ---------------------------------------------------------------------------------------
# A file searches lib/ next to it. A portable tarball adds lib/host/N and lib/fallback for libraries that a GL driver
# also loads (bundle.cmake). Built files reserve space for those paths; installed files do not name them. No file names
# a folder of the build: with $ORIGIN a moved tree still works.
# The path is DT_RPATH (--disable-new-dtags), because DT_RPATH, unlike DT_RUNPATH, also applies to the dependencies of
# our libraries. The tarball can therefore bundle those unmodified.
file(RELATIVE_PATH bin_to_lib ${CMAKE_INSTALL_FULL_BINDIR} ${CMAKE_INSTALL_FULL_LIBDIR})
function(cumulet_rpath target lib)
  if(NOT UNIX OR APPLE)
    return()
  endif()
  set_target_properties(${target} PROPERTIES INSTALL_RPATH ${lib}
                        BUILD_RPATH "${lib};${lib}/host/1;${lib}/host/2;${lib}/host/3;${lib}/fallback")
  target_link_options(${target} PRIVATE -Wl,--disable-new-dtags)
endfunction()

set(programs)
foreach(program cumulet-render cumulet-merge cumulet-scene cumulet-demo)
  if(TARGET ${program})
    cumulet_rpath(${program} $ORIGIN/${bin_to_lib})
    list(APPEND programs ${program})
  endif()
endforeach()
if(NOT CUMULET_STATIC)
  cumulet_rpath(cumulet $ORIGIN)
endif()
set(libraries cumulet)
if(TARGET cumulet_headless_c)
  cumulet_rpath(cumulet_headless_c $ORIGIN)
  list(APPEND libraries cumulet_headless_c)
endif()

# --- install ---------------------------------------------------------------------------------------------------
install(TARGETS ${libraries} EXPORT Cumulet
        LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT library NAMELINK_COMPONENT development
        ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development
        RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT library)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/src/include/cumulet ${PROJECT_BINARY_DIR}/src/include/cumulet
        DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}
        COMPONENT development)
if(TARGET cumulet_headless_c)
  install(FILES ${PROJECT_SOURCE_DIR}/demo/headless/cumulet_headless.h
          DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/cumulet COMPONENT development)
endif()

# The Python package. Outside of Debian's library folder it finds the libraries through a link.
set(python_dir lib/python3/dist-packages/cumulet)
get_property(python_modules GLOBAL PROPERTY CUMULET_PYTHON_MODULES)
if(TARGET cumulet_python)
  install(FILES ${python_modules} DESTINATION ${python_dir} COMPONENT python)
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/python/examples/ DESTINATION ${doc_dir}/examples/python COMPONENT python
          PATTERN __pycache__ EXCLUDE)
  file(RELATIVE_PATH python_to_lib ${CMAKE_INSTALL_PREFIX}/${python_dir} ${CMAKE_INSTALL_FULL_LIBDIR})
  install(CODE "file(CREATE_LINK ${python_to_lib} \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/${python_dir}/lib\" SYMBOLIC)"
          COMPONENT python)

  set(wheel_stage ${CMAKE_BINARY_DIR}/wheel)
  add_custom_target(cumulet_wheel
    COMMAND ${CMAKE_COMMAND} -E rm -rf ${wheel_stage}
    COMMAND ${CMAKE_COMMAND} --install ${CMAKE_BINARY_DIR} --component library --prefix ${wheel_stage} --strip
    COMMAND ${CMAKE_COMMAND} -DCPACK_GENERATOR=TGZ -DCPACK_TEMPORARY_INSTALL_DIRECTORY=${wheel_stage}
            -DCPACK_CUMULET_LIBDIR=${CMAKE_INSTALL_LIBDIR} -DCPACK_CUMULET_BINDIR=${CMAKE_INSTALL_BINDIR}
            -DCPACK_CUMULET_DOCDIR=doc -P ${CMAKE_CURRENT_LIST_DIR}/bundle.cmake
    COMMAND ${CUMULET_GLAD_PYTHON} -B ${CMAKE_CURRENT_LIST_DIR}/wheel.py --version ${PROJECT_VERSION}
            --license ${PROJECT_SOURCE_DIR}/LICENSE --package ${CMAKE_BINARY_DIR}/python/cumulet
            --libraries ${wheel_stage}/${CMAKE_INSTALL_LIBDIR} --licenses ${wheel_stage}/doc/licences
            --out ${CMAKE_BINARY_DIR}
    VERBATIM)
  add_dependencies(cumulet_wheel cumulet cumulet_headless_c cumulet_python)
endif()

if(TARGET cumulet-file-dialog)  # only cumulet-demo starts it
  install(TARGETS cumulet-file-dialog RUNTIME DESTINATION ${CMAKE_INSTALL_LIBEXECDIR}/cumulet COMPONENT programs)
endif()

# The manual page and the completions of each program, generated from its own table of options.
set(manual_files)
set(scripts)
if(CUMULET_FARM_PROGRAM)
  set(scripts cumulet-farm)
endif()
foreach(program ${programs} ${scripts})
  set(page ${PROJECT_SOURCE_DIR}/docs/man/${program}.1.in)
  set(made ${CMAKE_BINARY_DIR}/manual/${program})
  if(TARGET ${program})
    set(file $<TARGET_FILE:${program}>)
    set(of_program ${program})
    install(TARGETS ${program} RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT programs)
  else()
    set(file ${CUMULET_FARM_PROGRAM})
    set(of_program ${file})
    install(PROGRAMS ${file} DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT programs)
  endif()
  add_custom_command(OUTPUT ${made}.1 ${made}.bash ${made}.zsh
                     COMMAND ${CUMULET_GLAD_PYTHON} ${CMAKE_CURRENT_LIST_DIR}/manual.py ${file} ${page}
                             ${CMAKE_BINARY_DIR}/manual ${PROJECT_VERSION}
                     DEPENDS ${of_program} ${page} ${CMAKE_CURRENT_LIST_DIR}/manual.py VERBATIM)
  list(APPEND manual_files ${made}.1)
  install(FILES ${made}.1 DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT programs)
  install(FILES ${made}.bash RENAME ${program} DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions
          COMPONENT programs)
  install(FILES ${made}.zsh RENAME _${program} DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/site-functions
          COMPONENT programs)
endforeach()
if(programs)
  add_custom_target(cumulet_manual ALL DEPENDS ${manual_files})
endif()
if(TARGET cumulet-demo)
  set(desktop ${PROJECT_SOURCE_DIR}/demo/desktop)
  install(FILES ${desktop}/cumulet-demo.desktop DESTINATION ${CMAKE_INSTALL_DATADIR}/applications COMPONENT programs)
  install(FILES ${desktop}/cumulet.xml DESTINATION ${CMAKE_INSTALL_DATADIR}/mime/packages COMPONENT programs)
  install(FILES ${desktop}/cumulet.thumbnailer DESTINATION ${CMAKE_INSTALL_DATADIR}/thumbnailers COMPONENT programs)
  install(FILES ${desktop}/org.cumulet.cumulet.metainfo.xml DESTINATION ${CMAKE_INSTALL_DATADIR}/metainfo
          COMPONENT programs)
  install(FILES ${desktop}/cumulet.svg DESTINATION ${CMAKE_INSTALL_DATADIR}/icons/hicolor/scalable/apps
          COMPONENT programs)
endif()

install(EXPORT Cumulet NAMESPACE Cumulet:: FILE CumuletTargets.cmake DESTINATION ${package_dir}
        COMPONENT development)
configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/CumuletConfig.cmake.in
                              ${CMAKE_CURRENT_BINARY_DIR}/CumuletConfig.cmake INSTALL_DESTINATION ${package_dir})
write_basic_package_version_file(${CMAKE_CURRENT_BINARY_DIR}/CumuletConfigVersion.cmake
                                 COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/CumuletConfig.cmake ${CMAKE_CURRENT_BINARY_DIR}/CumuletConfigVersion.cmake
        DESTINATION ${package_dir} COMPONENT development)
# pkg-config could not name all dependencies of a static library.
if(CUMULET_STATIC)
  install(FILES ${CMAKE_CURRENT_LIST_DIR}/CumuletLibraries.cmake DESTINATION ${package_dir} COMPONENT development)
endif()

set(pkgconfig_dir ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
file(RELATIVE_PATH pc_to_prefix ${CMAKE_INSTALL_PREFIX}/${pkgconfig_dir} ${CMAKE_INSTALL_PREFIX})
configure_file(${CMAKE_CURRENT_LIST_DIR}/cumulet.pc.in ${CMAKE_CURRENT_BINARY_DIR}/cumulet.pc @ONLY)
if(NOT CUMULET_STATIC)
  install(FILES ${CMAKE_CURRENT_BINARY_DIR}/cumulet.pc DESTINATION ${pkgconfig_dir} COMPONENT development)
endif()

# These pages link to each other; tests/package/install_test.sh follows the links.
set(pages)
foreach(page LICENSE README.md CHANGELOG.md CONTRIBUTING.md)
  list(APPEND pages ${PROJECT_SOURCE_DIR}/${page})
endforeach()
install(FILES ${pages} DESTINATION ${doc_dir} COMPONENT programs)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/docs ${PROJECT_SOURCE_DIR}/third_party_notes DESTINATION ${doc_dir}
        COMPONENT programs PATTERN man EXCLUDE)

include(Reference)

# Example hosts to copy from, a project of its own.
install(DIRECTORY ${PROJECT_SOURCE_DIR}/demo/embed/ DESTINATION ${doc_dir}/examples/embed COMPONENT development)

# --- cpack -----------------------------------------------------------------------------------------------------
if(PROJECT_IS_TOP_LEVEL)
  set(CUMULET_MAINTAINER "Cumulet <cumulet@localhost>" CACHE STRING "Whom a Debian package names for questions")
  string(TOLOWER ${CMAKE_SYSTEM_NAME} system)
  set(CPACK_GENERATOR TGZ)
  set(CPACK_PACKAGE_NAME cumulet)
  set(CPACK_PACKAGE_VENDOR Cumulet)
  set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
  set(CPACK_PACKAGE_FILE_NAME cumulet-${PROJECT_VERSION}-${system}-${CMAKE_SYSTEM_PROCESSOR})
  set(CPACK_PACKAGE_CHECKSUM SHA256)
  set(CPACK_RESOURCE_FILE_LICENSE ${PROJECT_SOURCE_DIR}/LICENSE)
  set(CPACK_STRIP_FILES ON)
  set(CPACK_VERBATIM_VARIABLES ON)
  set(CPACK_THREADS 0)
  set(CPACK_PRE_BUILD_SCRIPTS ${CMAKE_CURRENT_LIST_DIR}/bundle.cmake ${CMAKE_CURRENT_LIST_DIR}/debian.cmake)
  set(CPACK_CUMULET_LIBDIR ${CMAKE_INSTALL_LIBDIR})
  set(CPACK_CUMULET_BINDIR ${CMAKE_INSTALL_BINDIR})
  set(CPACK_CUMULET_DOCDIR ${doc_dir})
  set(CPACK_CUMULET_DATADIR ${CMAKE_INSTALL_DATADIR})
  set(CPACK_CUMULET_LICENSE ${PROJECT_SOURCE_DIR}/LICENSE)

  set(CPACK_COMPONENTS_ALL library development programs python)
  set(CPACK_DEB_COMPONENT_INSTALL ON)
  set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
  set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
  set(CPACK_DEBIAN_PACKAGE_MAINTAINER ${CUMULET_MAINTAINER})
  set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
  set(same_version "libcumulet0 (= ${PROJECT_VERSION}-1)")

  set(CPACK_DEBIAN_LIBRARY_PACKAGE_NAME libcumulet0)
  set(CPACK_DEBIAN_LIBRARY_PACKAGE_SECTION libs)
  set(CPACK_DEBIAN_LIBRARY_PACKAGE_SHLIBDEPS ON)
  set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ON)
  set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS_POLICY "=")  # the ABI may change before 1.0
  set(CPACK_DEBIAN_LIBRARY_DESCRIPTION "path-traced volumes inside an OpenGL context - library
Cumulet path-traces OpenVDB and NanoVDB volumes, and glTF surfaces in them,
inside an OpenGL 4.5 context that its host has made. Volumes become adaptive
tetrahedral grids, which compute shaders trace.")

  set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME libcumulet-dev)
  set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
  set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS "${same_version}")
  set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SUGGESTS libopenvdb-dev)
  set(CPACK_DEBIAN_DEVELOPMENT_DESCRIPTION "path-traced volumes inside an OpenGL context - headers
What it takes to compile against Cumulet: C and C++ headers, a CMake package
and a pkg-config file.")

  set(CPACK_DEBIAN_PROGRAMS_PACKAGE_NAME cumulet)
  set(CPACK_DEBIAN_PROGRAMS_PACKAGE_SECTION graphics)
  set(CPACK_DEBIAN_PROGRAMS_PACKAGE_SHLIBDEPS ON)
  set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${CMAKE_LIBRARY_OUTPUT_DIRECTORY})
  # Dependencies that dpkg-shlibdeps cannot see: EGL and a font, which are loaded by name, and the Python interpreter of
  # cumulet-farm. The machine provides the GL driver.
  set(CPACK_DEBIAN_PROGRAMS_PACKAGE_DEPENDS "${same_version}, libegl1, fonts-dejavu-core, python3:any")
  set(CPACK_DEBIAN_PROGRAMS_PACKAGE_RECOMMENDS libgl1-mesa-dri)
  set(CPACK_DEBIAN_PROGRAMS_PACKAGE_SUGGESTS "libosmesa6, slurm-client")
  set(CPACK_DEBIAN_PROGRAMS_DESCRIPTION "path-traced volumes - viewer and command line renderer
cumulet-demo shows OpenVDB and NanoVDB volumes and glTF models in a window,
path-traced as they are turned and changed. cumulet-render makes pictures of
them without a display, cumulet-merge one of parts, cumulet-farm makes them
on many machines. cumulet-scene writes a sample scene.")

  set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-cumulet)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_ARCHITECTURE all)
  # EGL is loaded by name.
  set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS "${same_version}, python3:any (>= 3.8), libegl1")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_RECOMMENDS libgl1-mesa-dri)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_CONTROL_EXTRA ${CMAKE_CURRENT_LIST_DIR}/debian/postinst
                                                ${CMAKE_CURRENT_LIST_DIR}/debian/prerm)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_SUGGESTS "libosmesa6, python3-numpy, python3-tqdm")
  set(CPACK_DEBIAN_PYTHON_DESCRIPTION "path-traced volumes - Python package
import cumulet renders OpenVDB and NanoVDB volumes, NumPy arrays and glTF
models in Python, in the OpenGL context of a host or without a window.")
  set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "")  # otherwise it precedes these descriptions
  include(CPack)
endif()

# --- tests of the packages --------------------------------------------------------------------------------------
if(CUMULET_BUILD_TESTS AND CUMULET_BUILD_APPS AND PROJECT_IS_TOP_LEVEL AND NOT CUMULET_SANITIZE)
  add_subdirectory(tests/package)
endif()
