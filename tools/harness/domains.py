"""Free ROS domain ids and ports, so that tests, demo and other ROS users do not meet."""

import fcntl
import os
import pathlib
import random
import re
import socket
import tempfile
import time

# Domain ids whose ports lie below Linux's ephemeral range; low ones are what people use by hand.
# tests/ros/domain.cpp takes from the same, by the same locks.
_CANDIDATES = range(40, 102)
_PORTS_PER_DOMAIN = 250
_PATIENCE = 120.0  # seconds; many tests run side by side
# Below those of the domains, for a proxy with HTTP/3 takes the UDP port of its number, too. And
# below the ephemeral range: no connection is given one of them.
_PORTS = range(16900, 17400)
_held = {}  # the lock of each, and whether it is a robot's
_held_ports = {}


def _lock(kind, number):
    """The open file that reserves this number, or nothing if somebody has it."""
    folder = os.path.join(tempfile.gettempdir(), f"connect-bridge-{kind}-{os.getuid()}")
    os.makedirs(folder, exist_ok=True)
    lock = open(os.path.join(folder, str(number)), "w", encoding="ascii")
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        lock.close()
        return None
    return lock


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


def _sweep(domain):
    """Deletes what a killed program of Fast DDS left for the ports of a domain that nobody uses: a
    file that was made and not given a size would hold up each later program of this domain."""
    first = 7400 + _PORTS_PER_DOMAIN * domain
    for file in pathlib.Path("/dev/shm").glob("*fast*_port*"):
        number = re.search(r"fast(?:dds|rtps)_port(\d+)", file.name)
        if number and 0 <= int(number[1]) - first < _PORTS_PER_DOMAIN:
            file.unlink(missing_ok=True)


def _try_domains(count):
    in_use = {(port - 7400) // _PORTS_PER_DOMAIN for port in _bound_udp_ports() if port >= 7400}
    taken = []
    # In any order: where a test has just ended, others may still believe in its nodes.
    for domain in random.sample(_CANDIDATES, len(_CANDIDATES)):
        if len(taken) == count:
            break
        if domain in in_use or domain in _held:
            continue
        lock = _lock("domains", domain)
        if lock:
            _sweep(domain)
            _held[domain] = (lock, not taken)
            taken.append(domain)
    if len(taken) < count:
        release_domains(taken)
        return None
    return taken


def take_domains(count):
    """Reserves this many domain ids for the life of this process; nobody else uses them now. The
    first is the robot's graph, the others are operators'."""
    end = time.monotonic() + _PATIENCE
    while True:
        taken = _try_domains(count)
        if taken is not None:
            return taken
        if time.monotonic() > end:
            raise RuntimeError(
                f"no {count} free ROS domain ids between {_CANDIDATES[0]} and {_CANDIDATES[-1]}"
            )
        time.sleep(0.2)


def release_domains(domains):
    for domain in domains:
        _held.pop(domain)[0].close()


def is_operators(domain):
    """Whether this process has taken it for the graph of an operator."""
    return domain in _held and not _held[domain][1]


def free_port():
    """A TCP port, reserved for the life of this process."""
    for port in random.sample(_PORTS, len(_PORTS)):
        lock = None if port in _held_ports else _lock("ports", port)
        if not lock:
            continue
        with socket.socket() as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                probe.bind(("127.0.0.1", port))
            except OSError:
                lock.close()
                continue
        _held_ports[port] = lock
        return port
    raise RuntimeError(f"no free TCP port between {_PORTS[0]} and {_PORTS[-1]}")
