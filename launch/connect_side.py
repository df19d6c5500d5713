"""What server.launch.py and client.launch.py have in common."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch_ros.actions import Node

ARGUMENTS = {
    "params_file": ("", "Parameter file; an argument of a parameter's name wins over it"),
    "name": ("connect_{}", "Name of the node"),
    "namespace": ("", "Namespace of the node"),
    "log_level": ("info", "debug, info, warn, error or fatal"),
    "respawn": ("true", "Whether it is started again when it ends"),
}


def side(program):
    def start(context):
        given = dict(context.launch_configurations)
        own = {name: given.pop(name) for name in ARGUMENTS}
        # What else was given as NAME:=VALUE is a parameter; launch keeps facts of its own there, too.
        known = [word for key, value in given.items() if not key.startswith(("ros_", "launch_"))
                 for word in ("-p", f"{key}:={value}")]
        file = ["--params-file", own["params_file"]] if own["params_file"] else []
        return [Node(
            package="connect_bridge", executable=program, name=own["name"],
            namespace=own["namespace"], output="screen", respawn=own["respawn"] == "true",
            respawn_delay=5.0,
            # The last one that names a parameter decides.
            arguments=["--ros-args", "--log-level", own["log_level"], *file, *known])]

    declared = [DeclareLaunchArgument(name, default_value=default.format(program), description=text)
                for name, (default, text) in ARGUMENTS.items()]
    return LaunchDescription([*declared, OpaqueFunction(function=start)])
