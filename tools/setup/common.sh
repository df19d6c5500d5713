# Sourced by the set-up scripts. Needs $root.
mkdir -p "$root/.ros2"

say() { printf '[setup] %s\n' "$*"; }
die() { printf '[setup] error: %s\n' "$*" >&2; exit 1; }

# A ROS 2 distribution of the user, not a prefix made by these scripts.
ros_is_sourced() {
  [ -n "${ROS_DISTRO:-}" ] && [ -n "${AMENT_PREFIX_PATH:-}" ] && [ -z "${CONNECT_BRIDGE_OWN_PREFIX:-}" ]
}

# telling <what> <log> <command>...: runs the command with its output in the log. Every 20 s a line says how far it is,
# by the log's last line, so that neither a person nor a CI with a limit on silence takes it for stuck.
telling() {
  local what=$1 log=$2 status=0 teller
  shift 2
  : >"$log"
  (
    begun=$SECONDS
    exec 8<> <(:)  # nothing ever comes from there: a pause without a process that would outlive this one
    while ! read -rt "${CONNECT_TELL_EVERY:-20}" -u 8 && kill -0 $$; do
      printf '%s: %d s, %s\n' "$what" $((SECONDS - begun)) "$(tail -n 1 "$log" | tr '\r' '\n' | tail -n 1 | cut -c1-90)"
    done
  ) &
  teller=$!
  disown "$teller"
  "$@" >"$log" 2>&1 </dev/null || status=$?
  kill "$teller" 2>/dev/null || true
  return "$status"
}

stamp_is_fresh() { [ -f "$1" ] && [ "$(cat "$1")" = "$2" ]; }
stamp_write() { printf '%s\n' "$2" >"$1"; }

# One number for the content of files and folders.
content_hash() { find "$@" -type f -print0 | LC_ALL=C sort -z | xargs -0 sha256sum | sed "s#$root/##" | sha256sum | cut -c1-32; }
