"""What tools/ros2 shows where there is no ros2cli, apart from what test_readme.py runs."""

import pytest
from sensor_msgs.msg import LaserScan

from harness.programs import ROOT, Program, ros_environment


@pytest.fixture
def started(tmp_path, domains, make_graph):
    """A function that starts a command beside a publisher of scans, 20 a second."""
    (domain,) = domains(1)
    graph = make_graph(domain)
    node = graph.node("lidar")
    publisher = graph.publisher(LaserScan, "/scan", node=node)
    scan = LaserScan(ranges=[float(i) for i in range(200)])
    scan.header.frame_id = "laser"
    node.create_timer(0.05, lambda: publisher.publish(scan))
    programs = []

    def start(*words):
        command = [ROOT / "tools" / "ros2" / "ros2", *words]
        programs.append(Program("ros2", command, ros_environment(domain), tmp_path).start())
        return programs[-1]

    yield start
    for program in programs:
        program.kill()


def test_a_rate(started):
    hz = started("topic", "hz", "/scan")
    assert int(hz.wait_for(r"rate: ([1-9]\d*) Hz", 40).group(1)) < 60
    assert hz.stop() == 0, hz.text()


def test_messages_until_the_end_with_long_sequences_cut(started):
    echo = started("topic", "echo", "/scan")
    said = echo.wait_for(r"(?sm)^header:.*?^---\n.*?^---\n", 40).group(0)
    assert "  frame_id: laser\n" in said
    assert "- 127.0\n- '...'\n" in said and "- 128.0" not in said
    assert echo.stop() == 0, echo.text()
