#!/usr/bin/env bash
# interfaces.sh <prefix> <package>...: generates interface packages, in the given order, and installs them into the prefix.
# A package comes from tests/interfaces, else its definitions come from the pinned wheels that only Kilted has.
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
here=$root/tools/setup
. "$here/common.sh"
prefix=$1
shift
name=$(basename "$prefix")
work=$root/.ros2/interfaces-$name

package_hash() {
  if [ -d "$root/tests/interfaces/$1" ]; then
    content_hash "$root/tests/interfaces/$1" "$here/interfaces.sh"
  else
    content_hash "$here/requirements/messages.txt" "$here/interface_package.py" "$here/interfaces.sh"
  fi
}

stale=()
for package in "$@"; do
  stamp_is_fresh "$prefix/stamp-interfaces-$package" "$(package_hash "$package")" || stale+=("$package")
done
[ "${#stale[@]}" -gt 0 ] || exit 0
say "interface packages for $name: ${stale[*]}"
if [ "$name" != "overlay-${ROS_DISTRO:-}" ]; then
  unset ROS_DISTRO AMENT_PREFIX_PATH CMAKE_PREFIX_PATH LD_LIBRARY_PATH CONNECT_BRIDGE_OWN_PREFIX
fi
mkdir -p "$prefix" "$work"
set +u
. "$root/env.sh"
set -u

definitions() {  # the folder of package $1
  if [ -d "$root/tests/interfaces/$1" ]; then
    echo "$root/tests/interfaces/$1"
    return
  fi
  if [ ! -d "$work/wheels" ]; then
    telling "[setup] the wheels with messages" "$work/log-wheels" pip download --progress-bar off --disable-pip-version-check \
      --no-deps -d "$work/wheels.part" -r "$here/requirements/messages.txt" >&2 ||
      { tail -n 30 "$work/log-wheels" >&2; die "pip failed"; }
    mv "$work/wheels.part" "$work/wheels"
  fi
  python3 "$here/interface_package.py" "$work/wheels" "$1" "$work/src/$1"
  echo "$work/src/$1"
}

build() {
  local package=$1 source=$2 options=() python=/usr/bin/python3
  [ -x "$prefix/bin/python3" ] && python=$prefix/bin/python3
  if command -v ccache >/dev/null; then
    options+=(-DCMAKE_C_COMPILER_LAUNCHER=ccache -DCMAKE_CXX_COMPILER_LAUNCHER=ccache)
  fi
  rm -rf "$work/build/$package"
  cmake -S "$source" -B "$work/build/$package" -G Ninja -DCMAKE_BUILD_TYPE=None -DCMAKE_C_FLAGS=-O1 -DCMAKE_CXX_FLAGS=-O1 \
    -DCMAKE_INSTALL_PREFIX="$prefix" -DPython3_EXECUTABLE="$python" -DPYTHON_EXECUTABLE="$python" \
    -DBUILD_TESTING=OFF "${options[@]}" && cmake --build "$work/build/$package" && cmake --install "$work/build/$package"
}

for package in "${stale[@]}"; do
  # A distribution that is sourced may have tf2_msgs.
  if [ "$name" != "overlay-${ROS_DISTRO:-}" ] || [ "$package" != tf2_msgs ] || ! /usr/bin/python3 -c "import tf2_msgs" 2>/dev/null; then
    source=$(definitions "$package")
    telling "[setup] $package" "$work/log-$package" build "$package" "$source" || { tail -n 40 "$work/log-$package" >&2; die "cannot generate $package"; }
  fi
  stamp_write "$prefix/stamp-interfaces-$package" "$(package_hash "$package")"
done
