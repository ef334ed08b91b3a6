#!/bin/bash
# The panel of the README's example shows the sample cloud. Usage: readme_test.sh README_HOST CUMULET-SCENE
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"$2" --only cumulus --voxels 20000 "$work" >/dev/null
"$1" "$work/cumulus.vdb"
