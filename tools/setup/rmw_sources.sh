# Sourced by the scripts that build an RMW for the prefix in use, whose wheels have Fast DDS alone. Needs $root and
# $sources, the folder with the checkouts. Result: $target, which is .ros2/rmw-<distribution> or CONNECT_BRIDGE_RMW_PREFIX.
. "$root/tools/setup/common.sh"
target=${CONNECT_BRIDGE_RMW_PREFIX:-$root/.ros2/rmw-$ROS_DISTRO}

# with_checkouts <package> <checkout>...: ends if a distribution has the package, or if a checkout is missing.
with_checkouts() {
  local package=$1 checkout
  shift
  ros_is_sourced && die "a ROS 2 distribution is sourced: install its package ros-$ROS_DISTRO-$package"
  for checkout in "$@"; do
    [ -n "$sources" ] && [ -d "$sources/$checkout" ] || die "SOURCES=dir names the folder with the checkouts $*"
  done
  sources=$(cd "$sources" && pwd)
  mkdir -p "$target/build" "$target/lib/chooser"
  # The wheels' tracetools names the static library of a tracer that it does not use.
  [ -f "$target/lib/liblttng-ust.a" ] || ar cr "$target/lib/liblttng-ust.a"
  export CMAKE_PREFIX_PATH=$target:$CMAKE_PREFIX_PATH LIBRARY_PATH=$target/lib
}

# source_of <checkout> <package>: a repository's package is the checkout itself, or a folder in it.
source_of() {
  local folder
  for folder in "$sources/$1/$2" "$sources/$1"; do
    if [ -f "$folder/CMakeLists.txt" ]; then
      echo "$folder"
      return
    fi
  done
  die "there is no $2 in the checkout $sources/$1"
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

# step_chooser <RMW>: the wheels' rmw_implementation knows Fast DDS alone; this one chooses at run time. By default it takes
# the RMW that was built, since it would take itself for Fast DDS.
step_chooser() {
  AMENT_PREFIX_PATH=$target:$AMENT_PREFIX_PATH step rmw_implementation rmw_implementation \
    -DRMW_IMPLEMENTATION_DISABLE_RUNTIME_SELECTION=OFF "-DRMW_IMPLEMENTATION=$1"
  # The wheels' libraries name rmw_fastrtps_cpp as what they need: in this folder that is what chooses.
  ln -sf ../librmw_implementation.so "$target/lib/chooser/librmw_fastrtps_cpp.so"
}
