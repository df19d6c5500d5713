"""The client's machine gets another address, as when it changes from Wi-Fi to LTE."""

import subprocess
import sys

import pytest

from harness.domains import free_port, take_domains
from harness.programs import Bridge
from harness.wan import ADDRESS, OPERATOR, ROBOT, Wan
from harness.worker import Missing

OTHER_ADDRESS = "10.77.0.3"
SET_ADDRESS = """
import fcntl, socket, struct, sys
address = struct.pack("16sH2x4s8x", b"wan0", socket.AF_INET, socket.inet_aton(sys.argv[1]))
fcntl.ioctl(socket.socket(), 0x8916, address)  # SIOCSIFADDR
"""


@pytest.fixture
def wan(tmp_path):
    try:
        network = Wan(tmp_path)
    except Missing as error:
        pytest.skip(f"no emulated network on this machine: {error}")
    network.set(up=50e6, down=50e6, delay=0.01)
    yield network
    network.close()


@pytest.fixture
def bridge(wan, tmp_path):
    port = free_port()
    slow = {"allow_plaintext": True, "dead_after": 60.0}
    made = Bridge(
        *take_domains(2),
        port,
        server={**slow, "listen": {"address": ADDRESS[ROBOT], "port": port}},
        client={**slow, "url": f"ws://{ADDRESS[ROBOT]}:{port}"},
        folder=tmp_path,
        within=(wan.within(ROBOT), wan.within(OPERATOR)),
    )
    yield made
    made.stop()


def test_a_client_that_gets_another_address_dials_at_once(wan, bridge):
    """Long before silence would show it: the link comes back with the same session."""
    bridge.start()
    change = [sys.executable, "-c", SET_ADDRESS, OTHER_ADDRESS]
    subprocess.run([*wan.within(OPERATOR), *change], check=True)
    bridge.client.wait_for(rf"the address {ADDRESS[OPERATOR]} of this machine is gone", 20)
    bridge.client.wait_for(r"(?s)is gone.*: connected to ", 20)
    bridge.server.wait_for(rf"(?s): connected to .*{ADDRESS[OPERATOR]}.*{OTHER_ADDRESS}", 20)
