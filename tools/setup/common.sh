# Sourced by the set-up scripts. Needs $root.
mkdir -p "$root/.ros2"

say() { printf '[setup] %s\n' "$*"; }
die() { printf '[setup] error: %s\n' "$*" >&2; exit 1; }

# A ROS 2 distribution of the user, not a prefix made by these scripts.
ros_is_sourced() {
  [ -n "${ROS_DISTRO:-}" ] && [ -n "${AMENT_PREFIX_PATH:-}" ] && [ -z "${CONNECT_BRIDGE_OWN_PREFIX:-}" ]
}

stamp_is_fresh() { [ -f "$1" ] && [ "$(cat "$1")" = "$2" ]; }
stamp_write() { printf '%s\n' "$2" >"$1"; }

# One number for the content of files and folders.
content_hash() { find "$@" -type f -print0 | LC_ALL=C sort -z | xargs -0 sha256sum | sed "s#$root/##" | sha256sum | cut -c1-32; }
