"""Machines on which some message packages are not installed."""

import os
import pathlib

TEST_PACKAGE = "connect_bridge_test_interfaces"
# The packages that the nodes of the tests use. CONNECT_LACKING=all runs tests with a bridge without
# them.
PACKAGES = (
    TEST_PACKAGE,
    "std_msgs",
    "std_srvs",
    "geometry_msgs",
    "sensor_msgs",
    "tf2_msgs",
)


def without(packages, folder, libraries=None):
    """The environment of a program on a machine without these packages, whose LD_LIBRARY_PATH is
    else `libraries`, or ours; makes the folder."""
    libraries = libraries or os.environ["LD_LIBRARY_PATH"]
    prefixes = os.environ["AMENT_PREFIX_PATH"].split(":")
    folder = pathlib.Path(folder)
    folder.mkdir()
    lacking = tuple(f"lib{package}__" for package in packages)
    for prefix in prefixes:
        for file in (pathlib.Path(prefix) / "lib").glob("*.so*"):
            if not file.name.startswith(lacking) and not (folder / file.name).exists():
                (folder / file.name).symlink_to(file)
    ours = {str(pathlib.Path(prefix) / "lib") for prefix in prefixes}
    # In their place: what stands before them chooses the middleware.
    paths = [str(folder) if p in ours else p for p in libraries.split(":")]
    return {
        "AMENT_PREFIX_PATH": str(folder),
        "LD_LIBRARY_PATH": ":".join(dict.fromkeys(paths)),
    }
