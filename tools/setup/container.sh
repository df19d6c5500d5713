#!/usr/bin/env bash
# container.sh <folder with the packages>: the image of config/container/Containerfile from these packages, over the clean root of
# deb_root.sh and with the ROS 2 prefix mounted, since no image of ROS is needed then; robot and operator run in it as
# compose.yaml says, and a message crosses. As root, with podman; one minute.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
. "$root/tools/setup/common.sh"
folder=$(cd "$1" && pwd)
context=$folder/container
image=localhost/connect_bridge_test
[ "$(id -u)" = 0 ] || die "as root: the image runs as a user of its own"
command -v podman >/dev/null || die "there is no podman: apt-get install podman runc"
[ -f "$folder/root.tar" ] || die "there is no clean root in $folder: make deb-root"

rm -rf "$context"
mkdir -p "$context/packages"
cp "$folder"/connect-bridge_*.deb "$context/packages"
# Where the kernel's control groups are of both versions, the other runtime says no.
podman=(podman --runtime runc)
ended() {
  "${podman[@]}" rm -f connect_test_robot connect_test_operator >/dev/null 2>&1 || true
  kill $(jobs -p) "${keeper:-}" 2>/dev/null || true
  "${podman[@]}" rmi -f "$image" localhost/connect_clean_root >/dev/null 2>&1 || true
}
trap ended EXIT
"${podman[@]}" import "$folder/root.tar" localhost/connect_clean_root >"$folder/log-container" 2>&1
telling "[container] image" "$folder/log-container" "${podman[@]}" build --network host --build-context packages="$context" \
  --build-arg BASE=localhost/connect_clean_root -f "$root/config/container/Containerfile" -t "$image" "$context" ||
  { tail -n 20 "$folder/log-container" >&2; die "the image cannot be built"; }

printf 'CONNECT_BRIDGE_ROOT=%s\nCONNECT_BRIDGE_PREFIX=%s\n. %s/env.sh\n' "$root" "${CONNECT_BRIDGE_PREFIX:-kilted}" "$root" >"$context/ros.sh"
user=1500
for side in robot operator; do install -d -o "$user" -m 700 "$context/$side"; done
# in_container <side> <domain> <option>... <command>...: as compose.yaml says. Loopback is the only network that is used.
in_container() {
  local side=$1 domain=$2
  shift 2
  "${podman[@]}" run --rm --user "$user:$user" --network host --ipc host --read-only --tmpfs /tmp --cap-drop ALL \
    --security-opt no-new-privileges --ulimit nofile=1024:1024 --ulimit nproc=4096:4096 -v "$root:$root:ro" \
    -v "$(realpath "$root/.ros2"):$(realpath "$root/.ros2"):ro" -v "$context/ros.sh:/opt/ros.sh:ro" -v "$context/$side:/var/lib/connect_bridge" \
    -e ROS_SETUP=/opt/ros.sh -e ROS_DOMAIN_ID="$domain" -e ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST "$@"
}
# A port and two domains that nobody else takes while this runs.
exec {numbers}< <(cd "$root/tools" && exec python3 -B -c 'from harness.domains import free_port, take_domains; import time
print(free_port(), *take_domains(2), flush=True); time.sleep(3600)')
keeper=$!
read -r port robot_domain operator_domain <&"$numbers"
wait_for() {  # <log> <text>
  local left=300
  until grep -qs "$2" "$1"; do
    left=$((left - 1))
    [ "$left" -gt 0 ] || { cat "$1" >&2; die "no \"$2\" in $1"; }
    read -rt 0.1 <> <(:) || true
  done
}

in_container robot "$robot_domain" --entrypoint sh "$image" -c 'if touch /x 2>/dev/null; then echo "the root can be written" >&2; exit 1; fi; connect_bridge --version'
in_container robot "$robot_domain" --name connect_test_robot "$image" server --pair 127.0.0.1 --ros-args -p "listen.port:=$port" >"$context/robot.log" 2>&1 &
wait_for "$context/robot.log" "The invitation is in"
invitation=$(grep -rhos -m 1 "wss+pair://[^']*" "$context/robot" | head -n 1)
in_container operator "$operator_domain" --name connect_test_operator "$image" client "$invitation" >"$context/operator.log" 2>&1 &
wait_for "$context/operator.log" ": connected to "
as_user() { exec setpriv --reuid "$user" --regid "$user" --clear-groups env HOME="$context/robot" ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST "$@"; }
(. "$context/ros.sh" && export ROS_DOMAIN_ID="$robot_domain"; as_user ros2 topic pub --rate 10 /chatter std_msgs/msg/String "{data: from a container}") >"$context/pub.log" 2>&1 &
(. "$context/ros.sh" && export ROS_DOMAIN_ID="$operator_domain"; as_user timeout 60 ros2 topic echo --once /chatter) >"$context/echo.log" 2>&1 || die "nothing arrived"
grep -q "from a container" "$context/echo.log" || die "something else arrived"
say "2 passed, 0 failed: nobody's image with a read-only root starts; a message crosses from container to container"
