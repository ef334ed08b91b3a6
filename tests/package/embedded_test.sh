#!/bin/bash
# Another project contains Cumulet by add_subdirectory: the defaults build only the library, and each feature can be
# turned off. It only configures. Usage: embedded_test.sh SOURCE_DIR
set -euo pipefail
source=$1
here=$(cd "$(dirname "$0")" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
configure() { # OPTION...
  rm -rf "$work/build"
  cmake -S "$here/embedded" -B "$work/build" -G Ninja -DCUMULET_SOURCE_DIR="$source" "$@" >"$work/log" 2>&1 || {
    cat "$work/log"
    echo "embedded_test: cannot configure with $*" >&2
    exit 1
  }
}
refuse() { # WANTED OPTION...: configuring fails with this text
  rm -rf "$work/build"
  if cmake -S "$source" -B "$work/build" -G Ninja "${@:2}" >"$work/log" 2>&1; then
    echo "embedded_test: configured with ${*:2}" >&2
    exit 1
  fi
  tr -s '\n ' ' ' <"$work/log" | grep -qF "$1" || { cat "$work/log"; exit 1; }
}

configure
if grep -q 'libcumulet' "$work/build/cumulet/cmake_install.cmake"; then
  echo "embedded_test: the library is installed by default" >&2
  exit 1
fi

# Another OpenVDB: the system's, in a folder of its own.
cached() { # NAME: prints the value of a variable
  sed -n "s/^$1:[A-Z]*=//p" "$work/build/CMakeCache.txt"
}
root=$work/prefix
mkdir -p "$root/include" "$root/lib/cmake"
cp -r "$(cached CUMULET_OPENVDB_MODULE_DIR)" "$root/lib/cmake/OpenVDB"
ln -s "$(cached OpenVDB_openvdb_INCLUDE_DIR)/openvdb" "$(cached CUMULET_NANOVDB_INCLUDE_DIR)/nanovdb" "$root/include"
ln -s "$(cached 'OpenVDB_openvdb_LIBRARY\(_RELEASE\)*' | head -n 1)" "$root/lib"
configure "-DCUMULET_OPENVDB_ROOT=$root"
for path in "-isystem $root/include" "$root/lib/libopenvdb"; do
  grep -qF -e "$path" "$work/build/build.ninja" || { echo "embedded_test: $path is not used" >&2; exit 1; }
done

for feature in OPENVDB NANOVDB DRACO MESHOPT TIFF WEBP; do
  configure "-DCUMULET_$feature=OFF"
  lower=$(tr '[:upper:]' '[:lower:]' <<<"$feature")
  grep -q "without_$lower.cpp" "$work/build/build.ninja"
done
configure -DCUMULET_STATIC=ON -DCUMULET_INSTALL=ON -DCUMULET_PKG_CONFIG=OFF -DCUMULET_WEBP=OFF \
  -DCMAKE_DISABLE_FIND_PACKAGE_TinyGLTF=ON
grep -q "generated/tinygltf.cpp" "$work/build/build.ninja" # TinyGLTF as a header
refuse "The tests need a shared library with all features" -DCUMULET_STATIC=ON
refuse "Cumulet needs libwebp, or CUMULET_WEBP=OFF" -DCUMULET_PKG_CONFIG=OFF -DCMAKE_DISABLE_FIND_PACKAGE_WebP=ON
