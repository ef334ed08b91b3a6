# cpack runs this on the staged trees of the Debian packages, one folder per component. Applies Debian's requirements,
# which an installation elsewhere does not have. Debian's loader searches the library folder anyway, so no file gets a
# search path.
cmake_minimum_required(VERSION 3.25)
if(NOT CPACK_GENERATOR STREQUAL "DEB")
  return()
endif()

foreach(component library development programs python)
  string(TOUPPER ${component} upper)
  set(package ${CPACK_DEBIAN_${upper}_PACKAGE_NAME})
  set(usr ${CPACK_TEMPORARY_INSTALL_DIRECTORY}/${component}/usr)

  file(GLOB binaries ${usr}/${CPACK_CUMULET_BINDIR}/* ${usr}/${CPACK_CUMULET_LIBDIR}/libcumulet*.so.*)
  foreach(file ${binaries})
    if(NOT IS_SYMLINK ${file} AND NOT file MATCHES "/cumulet-farm$")  # a script
      file(RPATH_REMOVE FILE ${file})
    endif()
  endforeach()

  file(REMOVE ${usr}/lib/python3/dist-packages/cumulet/lib)  # the loader finds the libraries

  set(data ${usr}/${CPACK_CUMULET_DATADIR})
  file(MAKE_DIRECTORY ${data}/doc/${package})
  file(COPY_FILE ${CPACK_CUMULET_LICENSE} ${data}/doc/${package}/copyright)
  file(REMOVE ${data}/doc/${package}/LICENSE)
  if(EXISTS ${data}/zsh/site-functions)
    file(RENAME ${data}/zsh/site-functions ${data}/zsh/vendor-completions)
  endif()
  file(GLOB pages ${data}/man/man1/*.1)
  foreach(page ${pages})
    execute_process(COMMAND gzip -9n ${page} COMMAND_ERROR_IS_FATAL ANY)
  endforeach()
endforeach()
