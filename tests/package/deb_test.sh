#!/bin/bash
# The Debian packages bundle no libraries, and their dependencies are complete. The test unpacks them in a root folder
# that contains only the files of those dependencies, and runs the programs there. tests/package/deb_fresh.sh installs
# them with apt in a new Debian. Usage: deb_test.sh BUILD_DIR VERSION
# shellcheck source=tests/package/root.sh
. "$(dirname "$0")/root.sh"
version=$2
for tool in dpkg-shlibdeps dpkg-deb apt-get; do
  command -v "$tool" >/dev/null || { echo "$name: skipped: it needs $tool (Debian)"; exit 77; }
done

pack "$1" DEB
debs=("$work"/pack/*.deb)
[ "${#debs[@]}" -eq 4 ] || fail "cpack wrote ${#debs[@]} packages, not 4"
root=$work/root
mkdir -p "$root"/{usr/{bin,sbin,lib,lib64},tmp,dev}
ln -s usr/{bin,sbin,lib,lib64} "$root"
: >"$root/dev/null"
for deb in "${debs[@]}"; do
  echo "$(basename "$deb"): $(dpkg-deb -f "$deb" Depends)"
  [ "$(dpkg-deb -f "$deb" Version)" = "$version-1" ] || fail "$(basename "$deb") is not of version $version"
  mkdir "$work/unpacked"
  dpkg-deb -x "$deb" "$work/unpacked"
  if find "$work/unpacked" -name '*.so*' ! -name 'libcumulet*.so*' | grep .; then fail "$(basename "$deb") bundles that"; fi
  if rpaths "$work/unpacked" | grep .; then fail "$(basename "$deb") has a search path of its own"; fi
  # apt unpacks all packages into the same root, so no file may be in two of them.
  (cd "$work/unpacked" && find . ! -type d) | while read -r file; do
    [ ! -e "$root/$file" ] || fail "two packages have $file"
  done
  cp -a "$work/unpacked/." "$root"
  rm -r "$work/unpacked"
done
for file in usr/bin/cumulet-{render,merge,farm,demo,scene} usr/share/man/man1/cumulet-render.1.gz \
  usr/share/thumbnailers/cumulet.thumbnailer usr/share/metainfo/org.cumulet.cumulet.metainfo.xml \
  usr/share/zsh/vendor-completions/_cumulet-render usr/share/doc/{libcumulet0,libcumulet-dev,cumulet,python3-cumulet}/copyright \
  usr/share/doc/cumulet/{README,CHANGELOG,CONTRIBUTING}.md usr/share/doc/cumulet/examples/python/metaballs.py; do
  [ -s "$root/$file" ] || fail "no package has $file"
done
# Modules that Python has compiled are removed with the package.
[[ $(dpkg-deb -I "$work"/pack/python3-cumulet_*.deb prerm) == *py3clean* ]] || fail "python3-cumulet leaves files behind"
apt-get --simulate --no-download --no-install-recommends install "${debs[@]}" >"$work/apt.log" 2>&1 ||
  { cat "$work/apt.log"; fail "apt cannot install them here"; }

# --- copies the installed files of the dependencies, and of their dependencies ----------------------------------------
names=()
for deb in "${debs[@]}"; do
  names+=("$(dpkg-deb -f "$deb" Depends)," "$(dpkg-deb -f "$deb" Recommends),")
done
dpkg-query -W -f '${db:Status-Status}\t${Package}\t${Provides}\t${Depends}, ${Pre-Depends}\n' >"$work/installed"
awk -F '\t' -v wanted="${names[*]}" '
  function trim(s) { gsub(/\([^)]*\)|:any|[[:space:]]/, "", s); return s }
  $1 == "installed" {
    needs[$2] = $4
    has[$2] = $2
    n = split($3, provided, ",")
    for (i = 1; i <= n; i++) if (!(trim(provided[i]) in has)) has[trim(provided[i])] = $2
  }
  END {
    queue[1] = wanted; last = 1
    for (first = 1; first <= last; first++) {
      n = split(queue[first], all, ",")
      for (i = 1; i <= n; i++) {
        m = split(all[i], either, "|")
        found = m == 0 || trim(all[i]) == "" || trim(all[i]) ~ /^libcumulet/
        for (j = 1; j <= m && !found; j++) {
          name = trim(either[j])
          if (!(name in has)) continue
          found = 1
          if (!(has[name] in seen)) { seen[has[name]] = 1; print has[name]; queue[++last] = needs[has[name]] }
        }
        if (!found) { print "deb_test: not installed here: " all[i] > "/dev/stderr"; exit 1 }
      }
    }
  }' "$work/installed" >"$work/packages"
echo "with what those need: $(wc -l <"$work/packages") packages of Debian"
xargs dpkg-query -L <"$work/packages" | grep -vE '^/usr/share/(doc|man|locale|info|perl|icons)/|^/var/|^$' | sort -u |
  while read -r file; do
    if [ -L "$file" ] || [ -f "$file" ]; then echo "${file#/}"; fi
  done >"$work/files"
tar -C / --create --file - --no-recursion --files-from "$work/files" |
  tar -C "$root" --extract --file - --keep-directory-symlink

# --- runs the programs ------------------------------------------------------------------------------------------------
in_root "$root" /usr/bin/cumulet-scene --only cumulus --voxels 20000 /tmp/scene || fail "cumulet-scene did not run"
in_root "$root" /usr/bin/cumulet-render --volume /tmp/scene/cumulus.vdb --size 32x32 --spp 1 -o /tmp/egl.png ||
  fail "cumulet-render made no picture"
[ -s "$root/tmp/egl.png" ] || fail "cumulet-render wrote no picture"
in_root "$root" /usr/bin/cumulet-render --thumbnail 32 -o /tmp/thumbnail /tmp/scene/cumulus.vdb || fail "no thumbnail"
[ -s "$root/tmp/thumbnail" ] || fail "cumulet-render wrote no thumbnail"
said=$(in_root "$root" /usr/bin/cumulet-demo --version) || fail "cumulet-demo did not start"
[ "$said" = "cumulet-demo $version" ] || fail "cumulet-demo is '$said'"

in_root "$root" /usr/bin/cumulet-farm run --samples 2 --parts 2 -o /tmp/farm.exr -- /tmp/scene/cumulus.vdb --size 32x32 ||
  fail "cumulet-farm made no picture"
[ -s "$root/tmp/farm.exr" ] || fail "cumulet-farm wrote no picture"

cat >"$root/tmp/render.py" <<'CODE'
import cumulet
picture = cumulet.render("/tmp/scene/cumulus.vdb", size=(32, 32), samples=1)
picture.save("/tmp/python.png")
CODE
in_root "$root" /usr/bin/python3 -B /tmp/render.py || fail "import cumulet made no picture"
[ -s "$root/tmp/python.png" ] || fail "Python wrote no picture"

# --- builds a host against the packages -------------------------------------------------------------------------------
export PKG_CONFIG_SYSROOT_DIR=$root
PKG_CONFIG_PATH=$(find "$root/usr/lib" -name cumulet.pc -printf %h)
export PKG_CONFIG_PATH
read -ra flags <<<"$(pkg-config --cflags --libs cumulet)"
cc -std=c11 "$(dirname "$0")/consumer/main.c" -o "$root/tmp/consumer" "${flags[@]}"
said=$(in_root "$root" /tmp/consumer) || fail "a host built against libcumulet-dev does not run with libcumulet0"
[ "$said" = "$version" ] || fail "a host finds version '$said', not '$version'"
