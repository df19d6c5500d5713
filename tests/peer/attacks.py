#!/usr/bin/env python3
"""One attack on a server of this machine: attacks.py NAME JSON, with the arguments of an Attack.

Prints what it has done, as JSON. Run by attack_scene.py."""

import asyncio
import json
import pathlib
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.dont_write_bytecode = True
sys.path[:0] = [str(HERE), str(HERE.parent / "e2e"), str(HERE.parents[1] / "tools")]

import attack_peers as peers  # noqa: E402
import attack_strangers as strangers  # noqa: E402
from attack_web import Attack  # noqa: E402

ATTACKS = {
    "silent": strangers.silent,
    "slow_login": strangers.slow_login,
    "resets": strangers.resets,
    "wrong_logins": strangers.wrong_logins,
    "tls_handshakes": strangers.tls_handshakes,
    "bomb": peers.bomb,
    "large": peers.large,
    "unfinished": peers.unfinished,
    "malformed": peers.malformed,
    "never_reads": peers.never_reads,
    "origins": peers.origins,
    "channels": peers.channels,
    "texts": peers.texts,
    "listeners": peers.listeners,
    "mirrors": peers.mirrors,
    "lost": peers.lost,
    "gone": peers.gone,
    "readers": peers.readers,
    "unplaced": peers.unplaced,
    "toggles": peers.toggles,
    "frames": peers.frames,
}


def main():
    attack = Attack(**json.loads(sys.argv[2]))
    asyncio.run(ATTACKS[sys.argv[1]](attack))
    print(json.dumps(attack.done))


if __name__ == "__main__":
    main()
