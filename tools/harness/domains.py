"""Free ROS domain ids and ports, so that tests, demo and other ROS users do not meet."""

import fcntl
import os
import socket
import tempfile

# Domain ids whose ports lie below Linux's ephemeral range; low ones are what people use by hand.
_CANDIDATES = range(40, 102)
_PORTS_PER_DOMAIN = 250
_held = {}


def _bound_udp_ports():
    ports = set()
    for table in ("/proc/net/udp", "/proc/net/udp6"):
        try:
            with open(table, encoding="ascii") as lines:
                next(lines)
                ports.update(int(line.split()[1].rsplit(":", 1)[1], 16) for line in lines)
        except OSError:
            pass
    return ports


def take_domains(count):
    """Reserves this many domain ids for the life of this process; nobody else uses them now."""
    folder = os.path.join(tempfile.gettempdir(), f"connect-bridge-domains-{os.getuid()}")
    os.makedirs(folder, exist_ok=True)
    in_use = {(port - 7400) // _PORTS_PER_DOMAIN for port in _bound_udp_ports() if port >= 7400}
    taken = []
    for domain in _CANDIDATES:
        if len(taken) == count:
            break
        if domain in in_use or domain in _held:
            continue
        lock = open(os.path.join(folder, str(domain)), "w", encoding="ascii")
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            lock.close()
            continue
        _held[domain] = lock
        taken.append(domain)
    if len(taken) < count:
        release_domains(taken)
        raise RuntimeError(
            f"no {count} free ROS domain ids between {_CANDIDATES[0]} and {_CANDIDATES[-1]}"
        )
    return taken


def release_domains(domains):
    for domain in domains:
        _held.pop(domain).close()


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]
