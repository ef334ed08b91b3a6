#!/bin/bash
# An installed tree is complete and independent of the folders it was built in. No file names these, and programs search
# for libraries only next to themselves. Manual pages and completions list exactly the flags of --help. The desktop
# files are valid, and file types are recognized. Usage: install_test.sh BUILD_DIR SOURCE_DIR
set -euo pipefail
build=$1 source=$2
here=$(cd "$(dirname "$0")" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
fail() { echo "install_test: $*" >&2; exit 1; }
for tool in groff zsh desktop-file-validate appstreamcli update-mime-database gio; do
  command -v "$tool" >/dev/null || { echo "install_test: skipped: it needs $tool (scripts/packages.txt)"; exit 77; }
done

cmake --install "$build" --prefix "$work/tree" --strip >"$work/log" || { cat "$work/log"; fail "cmake --install failed"; }
tree=$work/tree share=$work/tree/share

# --- no file names a folder of the build ------------------------------------------------------------------------------
if found=$(grep -rlF -e "$(realpath "$build")" -e "$(realpath "$source")" "$tree"); then
  fail "folders of the build are named in $found"
fi
while read -r file; do
  head -c 4 "$file" | grep -q ELF || continue # a script
  path=$(readelf -d "$file" | sed -n 's/.*R\(UN\)*PATH).*\[\(.*\)\]/\2/p')
  # shellcheck disable=SC2016 # $ORIGIN is the loader's
  case $path in
    '$ORIGIN' | '$ORIGIN/../lib' | '$ORIGIN/../lib/'*-linux-gnu) ;;
    *) fail "$(basename "$file") looks for libraries in '$path'" ;;
  esac
done < <(find "$tree" -type f \( -path '*/bin/*' -o -name '*.so*' \))

# --- documents: each link leads to an installed file or heading -------------------------------------------------------
for page in README.md CHANGELOG.md CONTRIBUTING.md LICENSE docs/README.md; do
  [ -s "$share/doc/cumulet/$page" ] || fail "$page is not installed"
done
python3 -B "$source/tests/docs/links.py" --links-only "$share/doc/cumulet" || fail "links of installed pages are broken"

# --- manual pages and completions -------------------------------------------------------------------------------------
complete_bash() { # PROGRAM WORD...: prints the completions of the last word
  (
    cd "$work/files"
    # shellcheck disable=SC1090
    . "$share/bash-completion/completions/$1"
    COMP_WORDS=("$@") COMP_CWORD=$(($# - 1))
    "_${1//-/_}"
    printf '%s\n' "${COMPREPLY[@]}" | LC_ALL=C sort | tr '\n' ' '
  )
}
complete_zsh() { # PROGRAM TEXT: prints a terminal's command line after its completion
  (cd "$work/files" && zsh -f "$here/complete.zsh" "$share/zsh/site-functions" "$@")
}
expect() { # WANTED SAID WHAT
  [ "$1" = "$2" ] || fail "$3: '$2', not '$1'"
}

mkdir -p "$work/files/folder"
touch "$work"/files/{cloud.vdb,smoke.nvdb,notes.txt,model.glb,scene.json}
for program in "$tree"/bin/*; do
  program=$(basename "$program")
  # The flags that users see in --help: the first column.
  flags=$("$tree/bin/$program" --help | grep -oE '^  (-[a-z],)?--[a-z-]+|^  -[a-z]\b' | tr -d ' ' | tr ',' '\n' | LC_ALL=C sort)
  [ -n "$flags" ] || fail "$program --help names no flag"

  page=$share/man/man1/$program.1
  said=$(groff -man -Tutf8 -ww -z "$page" 2>&1)
  [ -z "$said" ] || fail "groff on $program.1: $said"
  in_page=$(groff -man -Tascii -P-cbou "$page" | grep -oE '^ {7}(-[a-z], )?--?[a-z-]+' | tr -d ' ' | tr ',' '\n' | LC_ALL=C sort)
  expect "$flags" "$in_page" "flags in the manual page of $program"
  if grep -qE '@[a-z_]+@' "$page"; then fail "$program.1 has a gap"; fi
  # Examples in the manual page and in the README use only existing flags.
  { groff -man -Tascii -P-cbou "$page" && cat "$source/README.md"; } |
    awk -v program="$program" 'more || $1 == program { sub(/ -- .*/, " "); print; more = /\\$/ }' |
    { grep -oE -- '--[a-z][a-z-]*' || true; } | LC_ALL=C sort -u | LC_ALL=C comm -23 - <(echo "$flags") >"$work/unknown"
  [ ! -s "$work/unknown" ] || fail "examples of $program have $(tr '\n' ' ' <"$work/unknown")"

  expect "$(tr '\n' ' ' <<<"$flags")" "$(complete_bash "$program" -)" "bash: $program -"
  zsh -n "$share/zsh/site-functions/_$program"
  for flag in $flags; do
    grep -qE -- "['{,*]${flag}[]=[},]" "$share/zsh/site-functions/_$program" || fail "zsh: _$program lacks $flag"
  done
done
expect "bricks dense tetrahedral " "$(complete_bash cumulet-render --grid-type "")" "bash: --grid-type"
expect "dense " "$(complete_bash cumulet-render --grid-type = d)" "bash: --grid-type=d"
expect "cloud.vdb folder smoke.nvdb " "$(complete_bash cumulet-render --volume "")" "bash: --volume"
expect "scene.json " "$(complete_bash cumulet-demo --scene s)" "bash: --scene s"
expect "cloud.vdb folder model.glb scene.json smoke.nvdb " "$(complete_bash cumulet-demo "")" "bash: cumulet-demo"
expect "folder " "$(complete_bash cumulet-scene f)" "bash: cumulet-scene f"
expect " " "$(complete_bash cumulet-render --spp "")" "bash: --spp"
expect "cumulet-render --grid-type dense" "$(complete_zsh "cumulet-render --grid-type d")" "zsh: --grid-type d"
expect "cumulet-render --volume cloud.vdb" "$(complete_zsh "cumulet-render --volume c")" "zsh: --volume c"
expect "cumulet-demo --replay=" "$(complete_zsh "cumulet-demo --rep")" "zsh: --rep"
expect "cumulet-render --light point --light" "$(complete_zsh "cumulet-render --light point --lig")" "zsh: --light again"
expect "cumulet-scene folder/" "$(complete_zsh "cumulet-scene f")" "zsh: cumulet-scene f"

# --- the desktop files ------------------------------------------------------------------------------------------------
desktop-file-validate "$share/applications/cumulet-demo.desktop"
icon=$(sed -n 's/^Icon=//p' "$share/applications/cumulet-demo.desktop")
[ -s "$share/icons/hicolor/scalable/apps/$icon.svg" ] || fail "no icon '$icon'"
run=$(sed -n 's/^Exec=\([^ ]*\).*/\1/p' "$share/applications/cumulet-demo.desktop")
[ -x "$tree/bin/$run" ] || fail "no program '$run'"
# The system's file types must remain defined next to ours.
mkdir -p "$share/mime/packages"
cp /usr/share/mime/packages/freedesktop.org.xml "$share/mime/packages"
export XDG_DATA_HOME=$work/none XDG_DATA_DIRS=$share
update-mime-database "$share/mime" 2>&1 | tee "$work/mime.log"
[ ! -s "$work/mime.log" ] || fail "update-mime-database has something to say"
type_of() { # FILE
  gio info -a standard::content-type "$1" | sed -n 's/.*standard::content-type: //p'
}
printf ' BDV\0\0\0\0' >"$work/files/unnamed_openvdb"
printf 'NanoVDB0' >"$work/files/unnamed_nanovdb"
printf '\1\2\3' | tee "$work/files/cloud.vdb" >"$work/files/smoke.nvdb" # recognized by their names
expect application/x-openvdb "$(type_of "$work/files/cloud.vdb")" "type of cloud.vdb"
expect application/x-openvdb "$(type_of "$work/files/unnamed_openvdb")" "type of an OpenVDB file without a name"
expect application/x-nanovdb "$(type_of "$work/files/smoke.nvdb")" "type of smoke.nvdb"
expect application/x-nanovdb "$(type_of "$work/files/unnamed_nanovdb")" "type of a NanoVDB file without a name"
for type in $(sed -n 's/^MimeType=//p' "$share/applications/cumulet-demo.desktop" | tr ';' ' '); do
  [ -s "$share/mime/$type.xml" ] || fail "cumulet-demo.desktop takes '$type', which nobody defines"
done

# --- the thumbnailer and the AppStream file ---------------------------------------------------------------------------
thumbnailer=$share/thumbnailers/cumulet.thumbnailer
[ "$(head -n 1 "$thumbnailer")" = "[Thumbnailer Entry]" ] || fail "cumulet.thumbnailer has another group"
if grep -vE '^(TryExec|Exec|MimeType)=.+$|^\[Thumbnailer Entry\]$' "$thumbnailer"; then fail "cumulet.thumbnailer has unknown lines"; fi
run=$(sed -n 's/^TryExec=//p' "$thumbnailer")
[ -x "$tree/bin/$run" ] || fail "no program '$run'"
read -ra command <<<"$(sed -n 's/^Exec=//p' "$thumbnailer")"
[ "${command[0]}" = "$run" ] || fail "cumulet.thumbnailer tries '$run' and runs '${command[0]}'"
for type in $(sed -n 's/^MimeType=//p' "$thumbnailer" | tr ';' ' '); do
  [ -s "$share/mime/$type.xml" ] || fail "cumulet.thumbnailer takes '$type', which nobody defines"
done
"$tree/bin/cumulet-scene" --only cumulus --voxels 20000 "$work/scene" >/dev/null
# As a file manager runs it: the name of the output has no ending.
command=("${command[@]/#%s/48}")
command=("${command[@]/#%o/$work/thumbnail}")
command=("${command[@]/#%i/$work/scene/cumulus.vdb}")
XDG_CACHE_HOME=$work/cache "$tree/bin/${command[0]}" "${command[@]:1}" || fail "the thumbnailer fails"
size=$(head -c 24 "$work/thumbnail" | tail -c 8 | od -An -tx1 | tr -d ' ')
expect 0000003000000030 "$size" "width and height of the thumbnail"
metainfo=$share/metainfo/org.cumulet.cumulet.metainfo.xml
appstreamcli validate --no-net "$metainfo" || fail "the AppStream file is not valid"
launched=$(sed -n 's/.*<launchable type="desktop-id">\(.*\)<.*/\1/p' "$metainfo")
[ -s "$share/applications/$launched" ] || fail "no desktop file '$launched'"
version=$("$tree/bin/cumulet-render" --version)
grep -q "<release version=\"${version##* }\"" "$metainfo" || fail "the AppStream file lacks $version"
for type in $(sed -n 's/.*<mediatype>\(.*\)<.*/\1/p' "$metainfo" | tr '\n' ' '); do
  grep -q "$type;" "$share/applications/cumulet-demo.desktop" || fail "cumulet-demo.desktop lacks '$type'"
done
