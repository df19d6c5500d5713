"""Two ends that nobody can dial, on this machine: each behind a NAT of its own, and a host with an
address between them."""

import os
import shutil
import subprocess

from harness.programs import dies_with_us, ros_environment
from harness.wan import OPERATOR as FAR, ROBOT, Wan
from harness.worker import Missing

OPERATOR, PUBLIC, ROBOT_NAT, OPERATOR_NAT = "operator", "public", "robot's NAT", "operator's NAT"
ADDRESS = "192.0.2.1"  # of the host that both can dial
ROBOT_LEG, OPERATOR_LEG = "198.51.100.", "203.0.113."
FORGETS = 30  # s: a connection on which nothing passes

_PLACE = """
mount --make-rprivate / && mount -t tmpfs tmpfs /dev/shm && ip link set lo up multicast on &&
ip route add 224.0.0.0/4 dev lo && echo ready && exec sleep infinity
"""
# What is not from within, or an answer to it, does not pass; neither does what it has forgotten.
_NAT = """
echo 1 >/proc/sys/net/ipv4/ip_forward
cd /proc/sys/net/netfilter
echo {forgets} >nf_conntrack_tcp_timeout_established
echo 0 >nf_conntrack_tcp_loose
iptables -t nat -A POSTROUTING -o out0 -j MASQUERADE
iptables -P FORWARD DROP
iptables -A INPUT -i out0 -j DROP
iptables -A FORWARD -m conntrack --ctstate INVALID -j DROP
iptables -A FORWARD -i {inside} -o out0 -j ACCEPT
iptables -A FORWARD -m conntrack --ctstate ESTABLISHED,RELATED -j ACCEPT
ip addr add {address}2/24 dev out0
ip link set out0 up
ip route add default via {address}1
"""


class Nat:
    """The robot's leg is the emulated one (`wan`). Raises Missing where the machine forbids it."""

    def __init__(self, folder):
        for tool in ("ip", "iptables", "unshare", "nsenter"):
            if not shutil.which(tool):
                raise Missing(f"{tool} is not installed")
        self._holders = []
        self.wan = Wan(folder)
        try:
            self._pids = {
                ROBOT: self.wan.pid(ROBOT),
                ROBOT_NAT: self.wan.pid(FAR),
                **{place: self._hold() for place in (PUBLIC, OPERATOR_NAT, OPERATOR)},
            }
            self._build()
        except BaseException:
            self.close()
            raise

    def _hold(self):
        command = dies_with_us(["unshare", "--net", "--mount", "sh", "-c", _PLACE])
        holder = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        self._holders.append(holder)
        if holder.stdout.readline() != b"ready\n":
            raise Missing(f"no namespace: {holder.stderr.read().decode().strip()}")
        return holder.pid

    def within(self, place):
        """The beginning of a command that runs at this place."""
        return ["nsenter", "--target", str(self._pids[place]), "--net", "--mount", "--"]

    def run(self, place, script):
        done = subprocess.run(
            [*self.within(place), "sh", "-ec", script], capture_output=True, text=True, check=False
        )
        if done.returncode:
            raise Missing(f"{place}: {script.strip()}: {done.stderr.strip()}")

    def _cable(self, end, device, other_end, other_device):
        self.run(
            PUBLIC,
            f"ip link add {device}x type veth peer name {other_device}y\n"
            f"ip link set {device}x netns {self._pids[end]} name {device}\n"
            f"ip link set {other_device}y netns {self._pids[other_end]} name {other_device}\n",
        )

    def _build(self):
        self._cable(ROBOT_NAT, "out0", PUBLIC, "robot0")
        self._cable(OPERATOR_NAT, "out0", PUBLIC, "operator0")
        self._cable(OPERATOR, "in0", OPERATOR_NAT, "inside0")
        self.run(
            PUBLIC,
            f"echo 1 >/proc/sys/net/ipv4/ip_forward\nip addr add {ADDRESS}/32 dev lo\n"
            f"ip addr add {ROBOT_LEG}1/24 dev robot0\nip link set robot0 up\n"
            f"ip addr add {OPERATOR_LEG}1/24 dev operator0\nip link set operator0 up\n",
        )
        self.run(ROBOT_NAT, _NAT.format(forgets=FORGETS, inside="wan0", address=ROBOT_LEG))
        self.run(
            OPERATOR_NAT,
            "ip addr add 10.78.0.1/24 dev inside0\nip link set inside0 up\n"
            + _NAT.format(forgets=FORGETS, inside="inside0", address=OPERATOR_LEG),
        )
        self.run(
            OPERATOR,
            "ip addr add 10.78.0.2/24 dev in0\nip link set in0 up\n"
            "ip route add default via 10.78.0.1\n",
        )
        self.run(ROBOT, "ip route add default via 10.77.0.2\n")

    def readdress(self, nat, host):
        """A NAT gets another address outside, and has forgotten all connections."""
        leg = ROBOT_LEG if nat == ROBOT_NAT else OPERATOR_LEG
        self.run(
            nat,
            f"ip addr flush dev out0\nip addr add {leg}{host}/24 dev out0\n"
            f"ip route replace default via {leg}1\n",
        )

    def close(self):
        for holder in self._holders:
            holder.kill()
            holder.wait()
        self.wan.close()


def environment(domain, home):
    """Of a program of the user who has this home."""
    os.makedirs(home, exist_ok=True)
    return ros_environment(domain, HOME=home, ROS_HOME=f"{home}/ros")
