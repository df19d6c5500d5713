"""The server. Every parameter is an argument: ros2 launch connect_bridge server.launch.py params_file:=robot.yaml listen.port:=9091"""

import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).parent))
from connect_side import side  # noqa: E402


def generate_launch_description():
    return side("server")
