# The target `docs`: the reference of cumulet.h as HTML, by Doxygen. It is not part of `all`, and an install has the
# reference only if it was built.
set(CUMULET_REFERENCE_DIR ${PROJECT_BINARY_DIR}/reference)
if(NOT PROJECT_IS_TOP_LEVEL)
  return()
endif()

find_package(Doxygen 1.9 QUIET)
if(DOXYGEN_FOUND)
  set(CUMULET_REFERENCE_INCLUDE_DIR ${PROJECT_SOURCE_DIR}/src/include)
  set(CUMULET_REFERENCE_HEADER ${CUMULET_REFERENCE_INCLUDE_DIR}/cumulet/cumulet.h)
  configure_file(${CMAKE_CURRENT_LIST_DIR}/Doxyfile.in ${CUMULET_REFERENCE_DIR}/Doxyfile @ONLY)
  add_custom_command(OUTPUT ${CUMULET_REFERENCE_DIR}/html/index.html
                     COMMAND ${CMAKE_COMMAND} -E rm -rf ${CUMULET_REFERENCE_DIR}/html
                     COMMAND ${DOXYGEN_EXECUTABLE} ${CUMULET_REFERENCE_DIR}/Doxyfile
                     DEPENDS ${CUMULET_REFERENCE_HEADER} ${CUMULET_REFERENCE_DIR}/Doxyfile
                     COMMENT "Writing the reference of cumulet.h" VERBATIM)
  add_custom_target(docs DEPENDS ${CUMULET_REFERENCE_DIR}/html/index.html)
else()
  add_custom_target(docs COMMAND ${CMAKE_COMMAND} -E echo "docs: doxygen 1.9 is not installed; install it and configure again"
                    COMMAND ${CMAKE_COMMAND} -E false VERBATIM)
endif()
install(DIRECTORY ${CUMULET_REFERENCE_DIR}/html/ DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/cumulet/reference
        COMPONENT development OPTIONAL)
