#!/usr/bin/env bash
# Runs inside a clean root (tools/setup/deb_root.sh): installs the packages of /tmp, and starts server, client and relay
# as their units would: the same command, user and environment.
set -euo pipefail
passed=0
ok() { printf 'ok: %s\n' "$*"; passed=$((passed + 1)); }
fail() { printf 'FAILED: %s\n' "$*" >&2; tail -n 20 /tmp/*.log >&2 2>/dev/null || true; exit 1; }

if [ "${1:-}" != started ]; then
  apt-get update -q >/tmp/install.log 2>&1 || fail "no lists of packages"
  apt-get install -y -q --no-install-recommends /tmp/connect-bridge*.deb >/tmp/install.log 2>&1 || fail "the packages do not install"
  # From here on the only network is loopback.
  exec unshare --net bash "$0" started
fi
ip link set lo up 2>/dev/null || python3 - <<'P'
import fcntl, socket, struct
with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as s:
    fcntl.ioctl(s, 0x8914, struct.pack("16sH14x", b"lo", 0x1 | 0x40))
P

ok "installed: $(dpkg-query -W -f '${Package} ${Version}, ' connect-bridge connect-bridge-relay)"

units=(/usr/lib/systemd/system/connect_bridge-server@.service /usr/lib/systemd/system/connect_bridge-client@.service
  /lib/systemd/system/connect_bridge-relay.service)
for unit in "${units[@]}"; do
  said=$(systemd-analyze verify --man=no "${unit/@./@root.}" 2>&1 | grep connect_bridge || true)
  [ -z "$said" ] || fail "$unit: $said"
  systemd-analyze security --offline=true --threshold=20 "$unit" >/tmp/security.log 2>&1 || fail "$unit is exposed: $(tail -n 1 /tmp/security.log)"
  ok "$(basename "$unit"): $(tail -n 1 /tmp/security.log | sed -E 's/.*: *([0-9.]+ [A-Z]+).*/exposure \1/')"
done

value() { sed -n "s/^$2=//p" "$1" | tail -n 1; }  # of a key in a unit or an environment file
# start <name> <unit> <user> [VARIABLE=value...]: the unit's command, in the background.
start() {
  local name=$1 unit=$2 user=$3
  shift 3
  mkdir -p "/var/lib/$name"  # StateDirectory
  chown "$user" "/var/lib/$name"
  (
    cd "/var/lib/$name"
    umask 077
    set -a
    [ -z "$(value "$unit" EnvironmentFile)" ] || . "$(value "$unit" EnvironmentFile)"
    exec setpriv --reuid "$user" --regid "$(id -g "$user")" --init-groups env HOME="/var/lib/$name" "$@" \
      bash -c "exec $(value "$unit" ExecStart)"
  ) >"/tmp/$name.log" 2>&1 &
}
wait_for() {  # <log> <text>
  local left=300
  until grep -q "$2" "$1"; do
    left=$((left - 1))
    [ "$left" -gt 0 ] || fail "no \"$2\" in $1"
    read -rt 0.1 <> <(:) || true
  done
}

connect_bridge --version >/tmp/version.log 2>&1 && fail "it starts without ROS_SETUP"
grep -q "ROS_SETUP" /tmp/version.log || fail "it does not say what it lacks"
ok "without ROS it says what it lacks"
sed -i 's|^ROS_SETUP=.*|ROS_SETUP=/opt/ros.sh|' /etc/default/connect_bridge
version=$(connect_bridge --version)
[[ $version == "connect_bridge $(dpkg-query -W -f '${Version}' connect-bridge) (protocol 1; package "* ]] || fail "$version"
ok "$version"

useradd --create-home robot
useradd --create-home anna
(umask 077 && connect_bridge ctl token anna --file /etc/connect_bridge/tokens.yaml >/etc/connect_bridge/anna.token 2>/tmp/token.log)
connect_bridge ctl check /etc/connect_bridge/server.yaml >/tmp/check.log 2>&1 || fail "the shipped server.yaml is wrong"
ok "the shipped server.yaml is understood"
python3 -c 'import importlib.metadata as m; m.entry_points(group="ros2cli.command")["connect"]' || fail "ros2 connect is not found"
ok "ros2 connect is found"
[ "$(stat -c %a /etc/connect_bridge)" = 751 ] || fail "other users can lock /etc/connect_bridge"
chown robot /etc/connect_bridge/tokens.yaml
chown anna /etc/connect_bridge/anna.token
printf '/**:\n  ros__parameters:\n    auth: {token_file: /etc/connect_bridge/tokens.yaml}\n    rules: [see]\n    rule: {see: {export_topics: [/chatter]}}\n' \
  >/etc/connect_bridge/server.yaml
printf '/**:\n  ros__parameters:\n    url: ws://127.0.0.1:9090/\n    auth: {token_file: /etc/connect_bridge/anna.token}\n' >/etc/connect_bridge/client.yaml
start connect_bridge-server@robot "${units[0]}" robot ROS_DOMAIN_ID=1
wait_for /tmp/connect_bridge-server@robot.log "listening on "
start connect_bridge-client@anna "${units[1]}" anna ROS_DOMAIN_ID=2
wait_for /tmp/connect_bridge-client@anna.log ": connected to "
ok "server as robot, client as anna: the link is open"

as() {  # <user> <domain> <command>...
  local user=$1 domain=$2
  shift 2
  setpriv --reuid "$user" --regid "$(id -g "$user")" --init-groups env HOME="/home/$user" ROS_DOMAIN_ID="$domain" \
    sh -c '. /opt/ros.sh && exec "$@"' sh "$@"
}
as robot 1 ros2 topic pub --rate 10 /chatter std_msgs/msg/String "{data: from the package}" >/tmp/pub.log 2>&1 &
as anna 2 timeout 60 ros2 topic echo --once /chatter >/tmp/echo.log 2>&1 || fail "nothing arrived"
grep -q "data: from the package" /tmp/echo.log || fail "something else arrived"
ok "a message of the robot's node arrived at anna's"

home=/var/lib/connect_bridge-relay
setpriv --reuid connect-relay --regid "$(id -g connect-relay)" --init-groups env HOME="$home" sh -c \
  'umask 077 && connect_bridge-relay --robot robot7@127.0.0.1:9443' >/tmp/robot.log 2>&1 || fail "the relay takes no robot"
start connect_bridge-relay "${units[2]}" connect-relay
wait_for /tmp/connect_bridge-relay.log "the relay listens on port 9443"
ok "the relay runs as $(value "${units[2]}" User)"

for word in "server --pa" "ctl che" "server -p listen.ad"; do
  completed=$(bash -c '. /usr/share/bash-completion/bash_completion; . /usr/share/bash-completion/completions/connect_bridge
    COMP_WORDS=(connect_bridge $1); COMP_CWORD=$((${#COMP_WORDS[@]} - 1)); _connect_bridge 2>/dev/null; echo "${COMPREPLY[*]}"' bash "$word")
  [ -n "$completed" ] || fail "\"$word\" is not completed"
  ok "\"$word\" is completed: $completed"
done
for page in connect_bridge.1 connect_bridge-server.1 connect_bridge-client.1 connect_bridge-ctl.1 connect_bridge-relay.1 connect_bridge.yaml.5; do
  # A minimal root may leave out manuals, but the package lists them.
  cat /var/lib/dpkg/info/connect-bridge*.list | grep -q "/$page.gz$" || fail "no page $page"
done
ok "manual pages"
python3 -c 'import json; d = json.load(open("/usr/share/connect_bridge/sbom.cdx.json")); assert d["components"]' || fail "no bill of materials"
ok "bill of materials"

kill $(jobs -p)
wait || true
apt-get purge -y -q connect-bridge connect-bridge-relay >/tmp/purge.log 2>&1 || fail "it cannot be removed"
rm -f /etc/connect_bridge/tokens.yaml /etc/connect_bridge/anna.token
[ ! -e /usr/bin/connect_bridge ] && [ ! -e /etc/connect_bridge/server.yaml ] && [ ! -e /etc/default/connect_bridge ] || fail "something stays after a purge"
ok "purged"
printf '%d passed, 0 failed\n' "$passed"
