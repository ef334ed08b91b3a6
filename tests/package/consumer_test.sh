#!/bin/bash
# A C and a C++ program build against an install tree, by find_package and by pkg-config, also after it was moved.
# Usage: consumer_test.sh BUILD_DIR VERSION
set -euo pipefail
build=$1 version=$2
here=$(cd "$(dirname "$0")" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

cmake --install "$build" --prefix "$work/first" >"$work/install.log" || { cat "$work/install.log"; exit 1; }
mv "$work/first" "$work/moved"
prefix=$work/moved

expect_version() { # PROGRAM: it runs and prints the version
  local said
  said=$("$1")
  [ "$said" = "$version" ] || { echo "consumer_test: $1 printed '$said', not '$version'" >&2; exit 1; }
}

cmake -S "$here/consumer" -B "$work/build" -G Ninja -DCMAKE_PREFIX_PATH="$prefix" -DWANTED_VERSION="$version"
cmake --build "$work/build"
expect_version "$work/build/consumer_c"
expect_version "$work/build/consumer_cpp"

config=$(find "$prefix" -name cumulet.pc -printf %h)
export PKG_CONFIG_PATH=$config
[ "$(pkg-config --modversion cumulet)" = "$version" ]
library_dir=$(pkg-config --variable=libdir cumulet)
read -ra flags <<<"$(pkg-config --cflags --libs cumulet)"
cc -std=c99 -pedantic -Wall -Wextra -Werror "$here/consumer/main.c" -o "$work/pc_c" "${flags[@]}" \
  "-Wl,-rpath,$library_dir"
c++ -std=c++11 -pedantic -Wall -Wextra -Werror "$here/consumer/main.cpp" -o "$work/pc_cpp" "${flags[@]}" \
  "-Wl,-rpath,$library_dir"
expect_version "$work/pc_c"
expect_version "$work/pc_cpp"
