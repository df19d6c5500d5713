#!/usr/bin/env bash
# prefix.sh <kilted|jazzy> [programs|all]: makes .ros2/<distribution>, a ROS 2 prefix from pinned wheels, with the messages of
# the demo, or also with what the tests need. With a ROS 2 distribution sourced it makes only the messages, in
# .ros2/overlay-<distribution>.
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
here=$root/tools/setup
. "$here/common.sh"
exec 9>"$root/.ros2/lock"
flock 9

what=${2:-all}
messages=(tf2_msgs)
[ "$what" = programs ] || messages+=(connect_bridge_test_interfaces)

if ros_is_sourced; then
  exec bash "$here/interfaces.sh" "$root/.ros2/overlay-$ROS_DISTRO" "${messages[@]}"
fi

distro=${1:-kilted}
prefix=$root/.ros2/$distro
[ -f "$here/requirements/$distro.txt" ] || die "no such distribution: '$distro'; there are kilted and jazzy"

# The user's other Python versions do not count: Debian's own has the headers and ament's modules.
python=/usr/bin/python3
pip_install() {
  local log=$root/.ros2/log-$distro-$1
  telling "[setup] $1" "$log" "$prefix/bin/pip" install --progress-bar off --disable-pip-version-check --no-deps \
    -r "$here/requirements/$1.txt" || { tail -n 30 "$log" >&2; die "pip failed"; }
}

# Only another set of wheels makes a new prefix; other changes are applied to the one in use.
wanted=$(content_hash "$here/requirements/$distro.txt" "$here/requirements/messages.txt")-$($python -V)
if ! stamp_is_fresh "$prefix/stamp-wheels" "$wanted"; then
  say "ROS 2 ${distro^} from wheels into .ros2/$distro"
  rm -rf "$prefix"
  $python -m venv "$prefix"
  pip_install "$distro"
  stamp_write "$prefix/stamp-wheels" "$wanted"
fi
wanted=$(content_hash "$here/stubs" "$here/fix_prefix.py")
if ! stamp_is_fresh "$prefix/stamp-fixes" "$wanted"; then
  "$prefix/bin/python3" "$here/fix_prefix.py" "$prefix"
  stamp_write "$prefix/stamp-fixes" "$wanted"
fi
wanted=$(content_hash "$here/requirements/tests.txt")
if [ "$what" = all ] && ! stamp_is_fresh "$prefix/stamp-tests" "$wanted"; then
  pip_install tests
  stamp_write "$prefix/stamp-tests" "$wanted"
fi

[ "$distro" = kilted ] || messages=(std_msgs std_srvs geometry_msgs sensor_msgs "${messages[@]}")
# Its wheels have none of these; CI generates only what it uses.
[ "$distro" = kilted ] || [ -z "${CONNECT_JAZZY_MESSAGES:-}" ] || read -ra messages <<<"$CONNECT_JAZZY_MESSAGES"
CONNECT_BRIDGE_PREFIX=$distro bash "$here/interfaces.sh" "$prefix" "${messages[@]}"
