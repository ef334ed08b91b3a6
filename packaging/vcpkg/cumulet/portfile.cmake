# An overlay port: it builds the source tree that contains it. Python 3 with glad 2 (pip install glad2) must be installed.
get_filename_component(SOURCE_PATH "${CMAKE_CURRENT_LIST_DIR}/../../.." ABSOLUTE)

vcpkg_check_features(OUT_FEATURE_OPTIONS FEATURE_OPTIONS FEATURES
                     draco CUMULET_DRACO
                     meshopt CUMULET_MESHOPT
                     nanovdb CUMULET_NANOVDB
                     openvdb CUMULET_OPENVDB
                     tiff CUMULET_TIFF
                     webp CUMULET_WEBP)
string(COMPARE EQUAL "${VCPKG_LIBRARY_LINKAGE}" "static" CUMULET_STATIC)
vcpkg_cmake_configure(SOURCE_PATH "${SOURCE_PATH}"
                      OPTIONS ${FEATURE_OPTIONS} -DCUMULET_STATIC=${CUMULET_STATIC} -DCUMULET_BUILD_APPS=OFF
                              -DCUMULET_BUILD_HOSTS=OFF -DCUMULET_BUILD_TESTS=OFF -DCUMULET_BUILD_BENCH=OFF
                              -DCUMULET_WERROR=OFF)
vcpkg_cmake_install()
vcpkg_cmake_config_fixup(PACKAGE_NAME Cumulet CONFIG_PATH lib/cmake/Cumulet)
vcpkg_fixup_pkgconfig()
file(REMOVE_RECURSE "${CURRENT_PACKAGES_DIR}/debug/include" "${CURRENT_PACKAGES_DIR}/debug/share"
     "${CURRENT_PACKAGES_DIR}/share/doc")
vcpkg_install_copyright(FILE_LIST "${SOURCE_PATH}/LICENSE")
