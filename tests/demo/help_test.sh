#!/bin/bash
# The output of --help fits a terminal of 100 columns and has no trailing blanks. Usage: help_test.sh PROGRAM...
set -euo pipefail
for program in "$@"; do
  help=$("$program" --help)
  [ "$(wc -l <<<"$help")" -gt 10 ] || { echo "$program --help says next to nothing"; exit 1; }
  if grep -nE '.{101}| $' <<<"$help"; then
    echo "these lines of $program --help are wider than 100 columns, or end with a blank"
    exit 1
  fi
done
