#!/usr/bin/env bash
# rmw_cyclonedds.sh <sources>: builds rmw_cyclonedds_cpp for the prefix in use, whose wheels have Fast DDS alone, and an
# rmw_implementation that chooses at run time. <sources> holds checkouts named cyclonedds (0.10.x), rmw_cyclonedds and
# rmw_implementation, of the versions of the distribution. Result: .ros2/rmw-<distribution>, or CONNECT_BRIDGE_RMW_PREFIX.
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
. "$root/tools/setup/common.sh"
ros_is_sourced && die "a ROS 2 distribution is sourced: install its package ros-$ROS_DISTRO-rmw-cyclonedds-cpp"
[ -d "${1:-}" ] || die "SOURCES=dir names the folder with the checkouts cyclonedds, rmw_cyclonedds and rmw_implementation"
sources=$(cd "$1" && pwd)
target=${CONNECT_BRIDGE_RMW_PREFIX:-$root/.ros2/rmw-$ROS_DISTRO}
mkdir -p "$target/build" "$target/lib/chooser"

# source_of <checkout> <package>: a repository's package is the checkout itself, or a folder in it.
source_of() {
  local folder
  for folder in "$sources/$1/$2" "$sources/$1"; do
    if [ -f "$folder/CMakeLists.txt" ]; then
      echo "$folder"
      return
    fi
  done
  die "there is no checkout $sources/$1"
}

build() {
  local source=$1 to=$target/build/$2
  shift 2
  if command -v ccache >/dev/null; then
    set -- "$@" -DCMAKE_C_COMPILER_LAUNCHER=ccache -DCMAKE_CXX_COMPILER_LAUNCHER=ccache
  fi
  cmake -S "$source" -B "$to" -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_INSTALL_PREFIX="$target" -DBUILD_TESTING=OFF "$@" &&
    cmake --build "$to" -j "${JOBS:-$(nproc)}" && cmake --install "$to"
}

# step <checkout> <package> <cmake option>...
step() {
  local source package=$2
  source=$(source_of "$1" "$2")
  shift 2
  telling "[setup] $package" "$target/log-$package" build "$source" "$package" "$@" ||
    { tail -n 30 "$target/log-$package" >&2; die "cannot build $package"; }
}

step cyclonedds cyclonedds -DENABLE_SHM=OFF -DENABLE_SSL=OFF -DENABLE_SECURITY=OFF -DBUILD_IDLC=OFF -DBUILD_DDSPERF=OFF
# The wheels' tracetools names the static library of a tracer that it does not use.
[ -f "$target/lib/liblttng-ust.a" ] || ar cr "$target/lib/liblttng-ust.a"
export CMAKE_PREFIX_PATH=$target:$CMAKE_PREFIX_PATH LIBRARY_PATH=$target/lib
step rmw_cyclonedds rmw_cyclonedds_cpp
step rmw_implementation rmw_implementation -DRMW_IMPLEMENTATION_DISABLE_RUNTIME_SELECTION=OFF
# The wheels' libraries name rmw_fastrtps_cpp as what they need: in this folder that is what chooses.
ln -sf ../librmw_implementation.so "$target/lib/chooser/librmw_fastrtps_cpp.so"
