# `cmake --install`: the library, its header, a CMake package, a pkg-config file, the programs and the licences.
# `cpack`: the same and every shared library it needs in one portable .tar.gz (cmake/bundle.cmake).
include(CMakePackageConfigHelpers)

set(doc_dir ${CMAKE_INSTALL_DATADIR}/doc/cumulet)
set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/Cumulet)

# --- where an installed file finds its libraries ---------------------------------------------------------------
# Beside it: lib/. A portable tarball adds lib/host/N and lib/fallback, for what a GL driver loads too: bundle.cmake.
# It is DT_RPATH (--disable-new-dtags) since that, unlike DT_RUNPATH, also serves the libraries of our libraries, so
# that those are bundled as they are. $ORIGIN keeps a tree that was moved working.
file(RELATIVE_PATH bin_to_lib ${CMAKE_INSTALL_FULL_BINDIR} ${CMAKE_INSTALL_FULL_LIBDIR})
function(cumulet_rpath target lib)
  set_property(TARGET ${target} PROPERTY INSTALL_RPATH ${lib} ${lib}/host/1 ${lib}/host/2 ${lib}/host/3 ${lib}/fallback)
  target_link_options(${target} PRIVATE -Wl,--disable-new-dtags)
endfunction()

set(programs)
foreach(program cumulet-render cumulet-scene cumulet-demo)
  if(TARGET ${program})
    cumulet_rpath(${program} $ORIGIN/${bin_to_lib})
    list(APPEND programs ${program})
  endif()
endforeach()
cumulet_rpath(cumulet $ORIGIN)

# --- install ---------------------------------------------------------------------------------------------------
install(TARGETS cumulet EXPORT Cumulet
        LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}
        ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}
        RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
if(programs)
  install(TARGETS ${programs} RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
endif()
install(DIRECTORY ${PROJECT_SOURCE_DIR}/src/include/cumulet DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})

install(EXPORT Cumulet NAMESPACE Cumulet:: FILE CumuletTargets.cmake DESTINATION ${package_dir})
configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/CumuletConfig.cmake.in
                              ${CMAKE_CURRENT_BINARY_DIR}/CumuletConfig.cmake INSTALL_DESTINATION ${package_dir})
write_basic_package_version_file(${CMAKE_CURRENT_BINARY_DIR}/CumuletConfigVersion.cmake
                                 COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/CumuletConfig.cmake ${CMAKE_CURRENT_BINARY_DIR}/CumuletConfigVersion.cmake
        DESTINATION ${package_dir})

set(pkgconfig_dir ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
file(RELATIVE_PATH pc_to_prefix ${CMAKE_INSTALL_PREFIX}/${pkgconfig_dir} ${CMAKE_INSTALL_PREFIX})
configure_file(${CMAKE_CURRENT_LIST_DIR}/cumulet.pc.in ${CMAKE_CURRENT_BINARY_DIR}/cumulet.pc @ONLY)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/cumulet.pc DESTINATION ${pkgconfig_dir})

install(FILES ${PROJECT_SOURCE_DIR}/LICENSE ${PROJECT_SOURCE_DIR}/README.md DESTINATION ${doc_dir})
install(DIRECTORY ${PROJECT_SOURCE_DIR}/third_party_notes DESTINATION ${doc_dir})

# --- cpack -----------------------------------------------------------------------------------------------------
if(PROJECT_IS_TOP_LEVEL)
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
  set(CPACK_PRE_BUILD_SCRIPTS ${CMAKE_CURRENT_LIST_DIR}/bundle.cmake)
  set(CPACK_CUMULET_LIBDIR ${CMAKE_INSTALL_LIBDIR})
  set(CPACK_CUMULET_BINDIR ${CMAKE_INSTALL_BINDIR})
  set(CPACK_CUMULET_DOCDIR ${doc_dir})
  include(CPack)
endif()

# --- their tests -----------------------------------------------------------------------------------------------
if(CUMULET_BUILD_TESTS AND CUMULET_BUILD_APPS AND PROJECT_IS_TOP_LEVEL AND NOT CUMULET_SANITIZE)
  add_subdirectory(tests/package)
endif()
