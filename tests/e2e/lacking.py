"""Machines on which some message packages are not installed."""

import os
import pathlib

import pytest

from harness.programs import uses_rmw

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
MIDDLEWARE = "rmw_zenoh_cpp"  # it has its configuration in its package

# What such tests need (docs/platforms.md): the other RMWs read requests by their fields, or join
# services by their types' hashes.
services_of_any_type = pytest.mark.skipif(
    "CONNECT_LACKING" in os.environ
    and (uses_rmw("rmw_cyclonedds_cpp") or uses_rmw("rmw_zenoh_cpp")),
    reason="NOT TESTED: with this RMW the types of services and actions must be installed",
)


def take_away(packages, side):
    """A side whose machine has not these packages."""
    side.env.update(_without(packages, side.log.parent / f"{side.name} lacks", side.env))


def _without(packages, folder, environment):
    """The environment of a program on a machine without these packages, else the one given; makes
    the folder."""
    prefixes = environment["AMENT_PREFIX_PATH"].split(":")
    folder.mkdir()
    shared = [f"share/{MIDDLEWARE}", f"share/ament_index/resource_index/packages/{MIDDLEWARE}"]
    for prefix in prefixes:
        for path in shared:
            if (pathlib.Path(prefix) / path).exists() and not (folder / path).exists():
                (folder / path).parent.mkdir(parents=True, exist_ok=True)
                (folder / path).symlink_to(pathlib.Path(prefix) / path)
    lacking = tuple(f"lib{package}__" for package in packages)
    for prefix in prefixes:
        for file in (pathlib.Path(prefix) / "lib").glob("*.so*"):
            if not file.name.startswith(lacking) and not (folder / file.name).exists():
                (folder / file.name).symlink_to(file)
    ours = {str(pathlib.Path(prefix) / "lib") for prefix in prefixes}
    # In their place: what stands before them chooses the middleware.
    paths = [str(folder) if p in ours else p for p in environment["LD_LIBRARY_PATH"].split(":")]
    return {
        "AMENT_PREFIX_PATH": str(folder),
        "LD_LIBRARY_PATH": ":".join(dict.fromkeys(paths)),
    }
