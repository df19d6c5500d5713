"""A robot whose nodes find each other by a discovery server of Fast DDS."""

import os
import shutil
import sys

import pytest
from std_msgs.msg import String

from graph import Graph
from harness.domains import free_port, release_domains, take_domains
from harness.programs import Bridge, Program, ros_environment, uses_rmw

RULES = {"rules": ["all"], "rule": {"all": {"export_topics": ["/t/**"]}}}
TALKER = """
import rclpy
from std_msgs.msg import String
rclpy.init()
node = rclpy.create_node("talker")
talker = node.create_publisher(String, "/t/talk", 10)
node.create_timer(0.1, lambda: talker.publish(String(data="hello")))
rclpy.spin(node)
"""

SERVER = shutil.which("fast-discovery-server")
# The program's own word for a plain server, since Fast DDS 3.
WORD = [] if os.environ.get("ROS_DISTRO") in ("humble", "iron", "jazzy") else ["42"]


@pytest.mark.skipif(not uses_rmw("rmw_fastrtps_cpp"), reason="only Fast DDS has it")
@pytest.mark.skipif(SERVER is None, reason="fast-discovery-server is not installed")
def test_what_only_the_discovery_server_knows_crosses(tmp_path):
    domains = take_domains(2)
    where = f"127.0.0.1:{free_port()}"
    found_by = {"ROS_DISCOVERY_SERVER": where}
    robot = ros_environment(domains[0], **found_by)
    command = [SERVER, *WORD, "-i", "0", "-l", "127.0.0.1", "-p", where.split(":")[1]]
    programs = [
        Program("discovery", command, robot, tmp_path),
        Program("talker", [sys.executable, "-c", TALKER], robot, tmp_path),
    ]
    bridge = Bridge(*domains, free_port(), RULES, {}, folder=tmp_path)
    bridge.server.env.update(found_by)
    operator = Graph(domains[1])
    try:
        for program in programs:
            program.start()
        bridge.start()
        heard = operator.collector(String, "/t/talk", 10)
        assert heard.wait(timeout=20)[0].data == "hello"
    finally:
        bridge.stop()
        operator.close()
        for program in reversed(programs):
            program.kill()
        release_domains(domains)
