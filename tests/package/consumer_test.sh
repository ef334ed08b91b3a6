#!/bin/bash
# Programs build against a moved install tree, with find_package and with pkg-config: C, C++, and C++ with its own
# OpenVDB, found in OPENVDB_MODULE_PATH; and so do the installed example hosts.
# Usage: consumer_test.sh BUILD_DIR VERSION OPENVDB_MODULE_PATH
set -euo pipefail
build=$1 version=$2 openvdb_module_path=$3
here=$(cd "$(dirname "$0")" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

cmake --install "$build" --prefix "$work/first" >"$work/install.log" || { cat "$work/install.log"; exit 1; }
mv "$work/first" "$work/moved"
prefix=$work/moved

expect_version() { # PROGRAM: checks that it runs and prints the version
  local said
  said=$("$1")
  [ "$said" = "$version" ] || { echo "consumer_test: $1 printed '$said', not '$version'" >&2; exit 1; }
}

cmake -S "$here/consumer" -B "$work/build" -G Ninja -DCMAKE_PREFIX_PATH="$prefix" -DWANTED_VERSION="$version" \
  -DOPENVDB_MODULE_PATH="$openvdb_module_path"
cmake --build "$work/build"
expect_version "$work/build/consumer_c"
expect_version "$work/build/consumer_cpp"
"$work/build/consumer_openvdb"

# The example hosts, from their installed sources.
cmake -S "$prefix/share/doc/cumulet/examples/embed" -B "$work/hosts" -G Ninja -DCMAKE_PREFIX_PATH="$prefix"
cmake --build "$work/hosts" --target cumulet-embed-egl cumulet-embed-glfw
"$work/hosts/egl/cumulet-embed-egl" 2>"$work/usage" && exit 1
grep -q "usage: " "$work/usage" || {
  cat "$work/usage"
  echo "consumer_test: the installed host does not run" >&2
  exit 1
}

config=$(find "$prefix" -name cumulet.pc -printf %h)
export PKG_CONFIG_PATH=$config
[ "$(pkg-config --modversion cumulet)" = "$version" ]
library_dir=$(pkg-config --variable=libdir cumulet)
read -ra flags <<<"$(pkg-config --cflags --libs cumulet)"
build_by_pkg_config() { # COMPILER STANDARD LANGUAGE SOURCE: builds it without warnings and runs it
  "$1" "-std=$2" -pedantic -Wall -Wextra -Werror -x "$3" "$here/consumer/$4" -x none -o "$work/pc" "${flags[@]}" \
    "-Wl,-rpath,$library_dir"
  expect_version "$work/pc"
}
build_by_pkg_config cc c99 c main.c
build_by_pkg_config c++ c++11 c++ main.c
build_by_pkg_config c++ c++20 c++ main.cpp
