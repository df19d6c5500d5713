"""A link's commands while others attack: none is lost, and memory and log stay within bounds.

A few seconds of each; `tools/bench/attack` has the long version, with times."""

import pytest

from attack_scene import ATTACKS, Scene
from attack_ways import DIRECT, TOLD, TOLD_ONE, UNTOLD
from sanitizer import not_under_a_sanitizer

SECONDS = 3.0
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
        assert not seen.problems(memory=False), scene.server.text()[-4000:]
        not_under_a_sanitizer("the server's memory beside an attack")
        assert not seen.problems()
    finally:
        scene.close()
