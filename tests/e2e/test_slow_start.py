"""A side that cannot start, since a ROS program was killed, says so."""

import os
import pathlib

import pytest

from harness.programs import Side, uses_rmw

OLD = ("humble", "iron", "jazzy")
# Not one that other tests take (harness/domains.py): if this test is killed, what it left would
# hold them up.
DOMAIN = 102


@pytest.mark.skipif(
    not uses_rmw("rmw_fastrtps_cpp") or os.environ.get("ROS_DISTRO", "") in OLD,
    reason="how Fast DDS names its files since Kilted",
)
def test_what_a_killed_program_left_is_told(tmp_path):
    first = 7400 + 250 * DOMAIN + 11  # of the first program (RTPS 2.2, section 9.6.1.1)
    # Of others, too: the first one's port may be somebody's who is no program of ROS.
    left = [pathlib.Path(f"/dev/shm/fastdds_port{first + 2 * i}") for i in range(5)]
    for file in left:
        file.unlink(missing_ok=True)
        file.touch()  # made, and not given a size
    side = Side("client", DOMAIN, {"url": "ws://127.0.0.1:1"}, tmp_path).start()
    try:
        side.wait_for("delete /dev/shm/fastdds_*", 30)
        assert side.text().startswith("ROS has not started within 10 s")
    finally:
        side.kill()
        for file in left:
            file.unlink()
