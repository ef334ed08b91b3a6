#!/bin/bash
# The tutorial's CMakeLists.txt builds the tutorial's host against an installed library.
# Usage: tutorial_project_test.sh BUILD_DIR SOURCE_DIR
set -euo pipefail
build=$(realpath "$1") source=$(realpath "$2")
blocks=$(realpath "$(dirname "$0")")/c_blocks.py
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cmake --install "$build" --prefix "$work/tree" >"$work/install.log" || { cat "$work/install.log"; exit 1; }
mkdir "$work/host"
cd "$source"
python3 -B "$blocks" docs/tutorial.md "$work/host/host.c" --whole
python3 -B "$blocks" docs/tutorial.md "$work/host/CMakeLists.txt" --block cmake_minimum_required
cmake -S "$work/host" -B "$work/build" -G Ninja -DCMAKE_PREFIX_PATH="$work/tree" -DCMAKE_C_FLAGS="-Wall -Wextra -Werror"
cmake --build "$work/build"
[ -x "$work/build/host" ]
