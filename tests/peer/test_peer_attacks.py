"""A link's commands while others attack: none is lost, and memory and log stay within bounds.

A few seconds of each; `tools/bench/attack` has the long version, with times."""

import pytest

from attack_scene import ATTACKS, LOG_BYTES_PER_HOUR, RESIDENT_BYTES_MAX, Scene
from attack_ways import DIRECT, TOLD, TOLD_ONE, UNTOLD
from sanitizer import not_under_a_sanitizer

SECONDS = 3.0
# The log lines that many logins at once may write before they are limited.
LOG_BYTES_AT_ONCE = 16 << 10
PARTS = 5
# Where the address of a connection matters.
BEHIND_A_PROXY = [
    ("silent", TOLD),
    ("tls_handshakes", TOLD),
    ("tls_handshakes", TOLD_ONE),
    ("wrong_logins", TOLD_ONE),
    ("resets", UNTOLD),
    ("silent", UNTOLD),
]


@pytest.mark.slow
@pytest.mark.parametrize("attack, way", [(attack, DIRECT) for attack in ATTACKS] + BEHIND_A_PROXY)
def test_the_others_go_on(tmp_path, attack, way):
    scene = Scene(tmp_path, attack, way=way)
    try:
        seen = scene.attacked(SECONDS)
        assert sum(seen.done.values()) > 0, "nothing was tried"
        assert seen.lost == 0 and seen.in_order
        log_bytes = LOG_BYTES_PER_HOUR * seen.seconds / 3600 + LOG_BYTES_AT_ONCE
        assert seen.log_bytes < log_bytes, scene.server.text()[-4000:]
        not_under_a_sanitizer("the server's memory beside an attack")
        assert seen.resident_bytes < RESIDENT_BYTES_MAX
    finally:
        scene.close()
