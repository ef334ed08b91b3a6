#!/bin/bash
# Writes the first C block of the README to a file. The block must not exceed 20 lines. Usage: readme_extract.sh
# README.md OUT.c
set -euo pipefail
block=$(awk '/^```c$/ { on = 1; next } on && /^```$/ { exit } on' "$1")
lines=$(grep -c '' <<<"$block")
if [ -z "$block" ] || [ "$lines" -gt 20 ]; then
  echo "readme_extract: the C block of $1 has $lines lines, not 1 to 20" >&2
  exit 1
fi
echo "$block" >"$2"
