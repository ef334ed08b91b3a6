#!/bin/bash
# libcumulet exports exactly the C ABI that cumulet.abi lists. Usage: symbols_test.sh LIBCUMULET.so
set -euo pipefail
library=$1
here=$(cd "$(dirname "$0")" && pwd)

wanted=$(sed -n "s/.*<elf-symbol name='\([^']*\)'.*/\1/p" "$here/cumulet.abi" | LC_ALL=C sort)
exported=$(nm --dynamic --defined-only --format=posix "$library" | cut -d' ' -f1 | LC_ALL=C sort)
if ! diff -u --label cumulet.abi --label exported - <(echo "$exported") <<<"$wanted"; then
  echo "symbols_test: $library does not export what tests/package/cumulet.abi lists" >&2
  exit 1
fi
dynamic=$(readelf --dynamic "$library")
grep -q 'SONAME.*\[libcumulet\.so\.[0-9]*\]' <<<"$dynamic" ||
  { echo "symbols_test: $library has no SONAME libcumulet.so.N" >&2; exit 1; }
if needed=$(grep -E 'NEEDED.*\[lib(GL|EGL|OpenGL|OSMesa|X11|wayland)' <<<"$dynamic"); then
  echo "symbols_test: the core must not link OpenGL or a window system: $needed" >&2
  exit 1
fi
