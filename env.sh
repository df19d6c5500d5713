# Source this file (bash, zsh; any POSIX shell from inside the repository or with CONNECT_BRIDGE_ROOT set):
#   . ./env.sh
# It gives the shell a ROS 2 prefix with a small ros2 command, and the programs of build/. A ROS 2 distribution that is sourced already stays as it is.
# CONNECT_BRIDGE_PREFIX=jazzy selects the other prefix, BUILD=<dir> another build directory, and
# CONNECT_BRIDGE_RMW=rmw_cyclonedds_cpp what `make rmw-cyclonedds` has built (rmw_zenoh_cpp: `make rmw-zenoh`), into
# CONNECT_BRIDGE_RMW_PREFIX if that is set.

_connect_root=${CONNECT_BRIDGE_ROOT:-}
if [ -n "${BASH_SOURCE:-}" ]; then
  _connect_root=$(cd "$(dirname "$BASH_SOURCE")" && pwd)
elif [ -n "${ZSH_VERSION:-}" ]; then
  _connect_root=$(eval 'cd "$(dirname "${(%):-%x}")"' && pwd)
elif [ -z "$_connect_root" ]; then
  _connect_root=$PWD
  while [ "$_connect_root" != / ] && [ ! -f "$_connect_root/tools/setup/prefix.sh" ]; do
    _connect_root=$(dirname "$_connect_root")
  done
fi

# _connect_path <value> <folder>...: the value without our own entries of an earlier call, with the folders in front.
_connect_path() {
  _connect_rest=$1:
  shift
  _connect_kept=
  while [ -n "$_connect_rest" ]; do
    _connect_entry=${_connect_rest%%:*}
    _connect_rest=${_connect_rest#*:}
    case $_connect_entry in
      '' | "$_connect_root"/.ros2/* | "$_connect_root"/build* | "$_connect_root"/tools/ros2) ;;
      *) _connect_kept=$_connect_kept:$_connect_entry ;;
    esac
  done
  _connect_new=
  for _connect_entry in "$@"; do _connect_new=$_connect_new:$_connect_entry; done
  _connect_new=$_connect_new$_connect_kept
  printf '%s' "${_connect_new#:}"
}

case ${BUILD:-build} in
  /*) _connect_build=${BUILD} ;;
  *) _connect_build=$_connect_root/${BUILD:-build} ;;
esac

if [ -n "${ROS_DISTRO:-}" ] && [ -n "${AMENT_PREFIX_PATH:-}" ] && [ -z "${CONNECT_BRIDGE_OWN_PREFIX:-}" ]; then
  PATH=$(_connect_path "$PATH" "$_connect_build")
  # Messages that only the tests use, generated for this distribution.
  if [ -d "$_connect_root/.ros2/overlay-$ROS_DISTRO/share" ]; then
    _connect_prefix=$_connect_root/.ros2/overlay-$ROS_DISTRO
    AMENT_PREFIX_PATH=$(_connect_path "$AMENT_PREFIX_PATH" "$_connect_prefix")
    CMAKE_PREFIX_PATH=$(_connect_path "${CMAKE_PREFIX_PATH:-}" "$_connect_prefix")
    LD_LIBRARY_PATH=$(_connect_path "${LD_LIBRARY_PATH:-}" "$_connect_prefix/lib")
    for _connect_entry in "$_connect_prefix"/lib/python3* "$_connect_prefix"/local/lib/python3*; do
      [ -d "$_connect_entry/site-packages" ] && PYTHONPATH=$(_connect_path "${PYTHONPATH:-}" "$_connect_entry/site-packages")
      [ -d "$_connect_entry/dist-packages" ] && PYTHONPATH=$(_connect_path "${PYTHONPATH:-}" "$_connect_entry/dist-packages")
    done
    export AMENT_PREFIX_PATH CMAKE_PREFIX_PATH LD_LIBRARY_PATH PYTHONPATH
  fi
  export PATH
elif [ ! -f "$_connect_root/.ros2/${CONNECT_BRIDGE_PREFIX:-kilted}/bin/python3" ]; then
  echo "env.sh: there is no prefix $_connect_root/.ros2/${CONNECT_BRIDGE_PREFIX:-kilted}; 'make prefix' makes it" >&2
else
  ROS_DISTRO=${CONNECT_BRIDGE_PREFIX:-kilted}
  CONNECT_BRIDGE_OWN_PREFIX=$_connect_root/.ros2/$ROS_DISTRO
  VIRTUAL_ENV=$CONNECT_BRIDGE_OWN_PREFIX
  ROS_VERSION=2
  ROS_PYTHON_VERSION=3
  RMW_IMPLEMENTATION=${CONNECT_BRIDGE_RMW:-rmw_fastrtps_cpp}
  PATH=$(_connect_path "$PATH" "$_connect_build" "$CONNECT_BRIDGE_OWN_PREFIX/bin" "$_connect_root/tools/ros2")
  AMENT_PREFIX_PATH=$(_connect_path "${AMENT_PREFIX_PATH:-}" "$CONNECT_BRIDGE_OWN_PREFIX")
  CMAKE_PREFIX_PATH=$(_connect_path "${CMAKE_PREFIX_PATH:-}" "$CONNECT_BRIDGE_OWN_PREFIX")
  LD_LIBRARY_PATH=$(_connect_path "${LD_LIBRARY_PATH:-}" "$CONNECT_BRIDGE_OWN_PREFIX/lib" \
    "$CONNECT_BRIDGE_OWN_PREFIX"/lib/python3.*/site-packages/ros_*.libs)
  if [ "$RMW_IMPLEMENTATION" != rmw_fastrtps_cpp ]; then
    _connect_rmw=${CONNECT_BRIDGE_RMW_PREFIX:-$_connect_root/.ros2/rmw-$ROS_DISTRO}
    [ -f "$_connect_rmw/lib/lib$RMW_IMPLEMENTATION.so" ] && [ -d "$_connect_rmw/lib/chooser" ] || echo "env.sh: there is no $RMW_IMPLEMENTATION in $_connect_rmw (CONNECT_BRIDGE_RMW_PREFIX names another folder); 'make rmw-cyclonedds SOURCES=dir' or 'make rmw-zenoh SOURCES=dir' builds it from checkouts in dir" >&2
    LD_LIBRARY_PATH=$_connect_rmw/lib/chooser:$_connect_rmw/lib:$LD_LIBRARY_PATH
    AMENT_PREFIX_PATH=$_connect_rmw:$AMENT_PREFIX_PATH
  fi
  export ROS_DISTRO ROS_VERSION ROS_PYTHON_VERSION RMW_IMPLEMENTATION CONNECT_BRIDGE_OWN_PREFIX VIRTUAL_ENV
  export PATH AMENT_PREFIX_PATH CMAKE_PREFIX_PATH LD_LIBRARY_PATH
fi

unset _connect_root _connect_build _connect_prefix _connect_rest _connect_kept _connect_entry _connect_new _connect_rmw
unset -f _connect_path
