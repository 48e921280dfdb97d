#!/usr/bin/env bash
# Fetches MeshLab's source tree (for its headers and vcglib: there is no -dev package) from Debian's source
# packages.
#   fetch_headers.sh 2020.09|2022.02|2025.07 DIR     leaves DIR/<version>
# Needs Debian or Ubuntu with apt; touches nothing of the system's package lists. Elsewhere, clone it:
#   git clone --depth 1 --branch MeshLab-2025.07 --recurse-submodules \
#     https://github.com/cnr-isti-vclab/meshlab DIR/2025.07
# SPDX-License-Identifier: GPL-3.0-or-later
set -euo pipefail
version=${1:?version of MeshLab: 2020.09, 2022.02 or 2025.07}
dir=$(mkdir -p "${2:?folder to put it in}" && cd "$2" && pwd)
case $version in
  2020.09) suite=bookworm ;;
  2022.02) suite=trixie ;;
  2025.07) suite=sid ;; # it moves on: then take 2022.02, or clone
  *) echo "no source package is known for MeshLab $version: 2020.09, 2022.02 or 2025.07" >&2; exit 2 ;;
esac
if [ -d "$dir/$version/src/common" ]; then exit 0; fi
command -v apt-get >/dev/null || {
  echo "apt-get is missing: clone MeshLab as the head of this script says" >&2
  exit 1
}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir -p "$work/sources" "$work/lists/partial"
cat > "$work/sources/meshlab.sources" <<EOF
Types: deb-src
URIs: http://deb.debian.org/debian
Suites: $suite
Components: main
Signed-By: /usr/share/keyrings/debian-archive-keyring.gpg
EOF
options=(-q -o Dir::Etc::SourceList=/dev/null -o "Dir::Etc::SourceParts=$work/sources"
  -o "Dir::State::Lists=$work/lists" -o APT::Sandbox::User=root)
cd "$work"
apt-get "${options[@]}" update >/dev/null
found=$(apt-cache "${options[@]}" showsrc meshlab \
  | sed -n "s/^Version: \(${version/./\\.}.*\)/\1/p" | head -1)
[ -n "$found" ] || {
  echo "Debian $suite no longer has the source of MeshLab $version:" \
    "clone it as the head of this script says" >&2
  exit 1
}
apt-get "${options[@]}" source --tar-only "meshlab=$found" >/dev/null
mkdir -p "$dir/$version.part"
tar -xf meshlab_*.orig.tar.* -C "$dir/$version.part" --strip-components=1
mv "$dir/$version.part" "$dir/$version"
