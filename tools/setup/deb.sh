#!/usr/bin/env bash
# deb.sh <folder>: Debian packages of the committed sources, for the ROS 2 of the environment, in the folder.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
. "$root/tools/setup/common.sh"
mkdir -p "$1"
folder=$(cd "$1" && pwd)
field() { sed -nE "s|.*<$1.*>(.*)</$1>.*|\1|p" "$root/package.xml"; }
version=$(field version)
maintainer="$(field maintainer) <$(sed -nE 's|.*email="([^"]*)".*|\1|p' "$root/package.xml")>"
source=$folder/connect-bridge-$version

command -v dh >/dev/null || die "there is no debhelper: apt-get install debhelper lintian"
mkdir -p "$source"
# All but what was compiled before.
find "$source" -mindepth 1 -maxdepth 1 ! -name "obj*" -exec rm -rf {} +
git -C "$root" archive HEAD | tar -x -C "$source"
cp -r "$source/packaging/debian" "$source/debian"
sed -i "s|@MAINTAINER@|$maintainer|" "$source/debian/control"
# The publisher's repository, without a login in its URL; a clone of a folder has none.
homepage=$(git -C "$root" remote get-url origin 2>/dev/null | sed -nE 's|^https://([^/@]*@)?(.*)$|https://\2|p' | sed 's|\.git$||')
[ -n "$homepage" ] || sed -i '/@HOMEPAGE@/d' "$source/debian/control"
sed -i "s|@HOMEPAGE@|${homepage:-the repository from which the package was built}|" "$source/debian/control" "$source/debian/copyright"
printf 'connect-bridge (%s) unstable; urgency=medium\n\n  * CHANGELOG.rst says what is new in %s.\n\n -- %s  %s\n' \
  "$version" "$version" "$maintainer" "$(git -C "$root" log -1 --format=%cD)" >"$source/debian/changelog"

# To a compiler cache it is the code of every other build.
export CCACHE_BASEDIR=$source CCACHE_NOHASHDIR=1
rm -f "$folder"/*.deb
cd "$source"
telling "[deb] $version" "$folder/log" dpkg-buildpackage -b -d -us -uc ||
  { tail -n 40 "$folder/log" >&2; die "the package cannot be built, all of it is in $folder/log"; }
say "lintian"
lintian --fail-on error,warning --info "$folder"/*.changes
ls -l "$folder"/*.deb
