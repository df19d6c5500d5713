"""The client. Every parameter is an argument: ros2 launch connect_bridge client.launch.py params_file:=operator.yaml prefix:=/robot1"""

import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).parent))
from connect_side import side  # noqa: E402


def generate_launch_description():
    return side("client")
