#!/bin/bash
# Packs a folder of links and runs it with small sizes. Checks that the table has rows of each section and no failure.
# Usage: rehearse.sh BUILD_DIR OUT
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
rm -rf "$2"
"$here/pack.sh" --links "$1" "$2"
"$2/run.sh" --rehearse
for section in machine picture headline hdda grid pace tests end; do
  grep -q "^$section," "$2/results/table.csv" || { echo "rehearse.sh: the table has no row of $section" >&2; exit 1; }
done
