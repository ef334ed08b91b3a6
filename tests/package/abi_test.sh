#!/bin/bash
# The C ABI (functions, structs, enums and their values) equals tests/package/cumulet.abi, and cumulet.hpp covers all of
# it. After an intended change, CUMULET_BLESS=1 writes a new cumulet.abi.
# Usage: abi_test.sh INCLUDE_DIR
set -euo pipefail
include=$1
here=$(cd "$(dirname "$0")" && pwd)
committed=$here/cumulet.abi
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

if ! command -v abidw >/dev/null || [ "$(uname -m)" != x86_64 ]; then
  echo "abi_test: skipped: it needs abidw (Debian: abigail-tools) on x86_64"
  exit 77
fi

# The header's types define the ABI, and the compiler checks the library against them. The test therefore describes a
# library of stubs, one for each prototype, so that libcumulet needs no debug information. -ffreestanding makes the
# integer types the compiler's own, not the C library's. Enums of flags, which no prototype names, are included because
# the stubs use them.
header=$include/cumulet/cumulet.h
{
  echo "#include <cumulet/cumulet.h>"
  awk '/^CUMULET_API/ { on = 1 }
       on { line = line " " $0 }
       on && /;/ { sub(/;.*/, "", line); print line " { __builtin_trap(); }"; line = ""; on = 0 }' "$header"
  echo "const unsigned long uses[] = {"
  grep -oE 'CUMULET_[A-Z0-9_]+ = ' "$header" | sed 's/\(.*\) = /sizeof \1,/'
  echo "};"
} >"$work/stubs.c"
cc -std=c11 -g -shared -fPIC -fvisibility=hidden -ffreestanding -I "$include" -x c - -o "$work/stubs.so" \
  <"$work/stubs.c"
abidw --headers-dir "$include/cumulet" --drop-private-types --load-all-types --no-show-locs --no-comp-dir-path \
  --no-corpus-path --no-elf-needed --no-write-default-sizes --out-file "$work/cumulet.abi" "$work/stubs.so"

if [ "${CUMULET_BLESS:-}" = 1 ]; then
  cp "$work/cumulet.abi" "$committed"
  echo "abi_test: wrote $committed"
fi
status=0
difference=$(abidiff --harmless --non-reachable-types "$committed" "$work/cumulet.abi") || status=$?
if [ -n "$difference" ] || [ "$status" -ne 0 ]; then
  echo "$difference"
  echo "abi_test: the ABI is not tests/package/cumulet.abi's; if that is meant, run this test with CUMULET_BLESS=1" >&2
  exit 1
fi

# Each name in the ABI occurs in cumulet.hpp or in the part that is derived from cumulet.h.
python3 "$here/../../cmake/descriptors.py" --out "$work/descriptors.hpp" "$header"
missing=$(sed -nE "s/.*<(elf-symbol|enumerator|var-decl) name='([^']*)'.*/\2/p" "$committed" | LC_ALL=C sort -u |
  LC_ALL=C comm -23 - <(grep -oE '[A-Za-z_][A-Za-z0-9_]*' "$include/cumulet/cumulet.hpp" "$work/descriptors.hpp" -h |
    LC_ALL=C sort -u))
if [ -n "$missing" ]; then
  echo "abi_test: cumulet.hpp lacks $(tr '\n' ' ' <<<"$missing")" >&2
  exit 1
fi
