"""Machines on which a message package has another version."""

import os
import pathlib
import subprocess

from lacking import TEST_PACKAGE

CMAKE = """cmake_minimum_required(VERSION 3.16)
project(@PACKAGE@)
find_package(ament_cmake REQUIRED)
find_package(rosidl_default_generators REQUIRED)
rosidl_generate_interfaces(${PROJECT_NAME} "msg/Blob.msg")
ament_package()
"""
PACKAGE = f"""<?xml version="1.0"?>
<package format="3">
  <name>{TEST_PACKAGE}</name>
  <version>2.0.0</version>
  <description>Another version of the messages of the tests.</description>
  <maintainer email="nobody@example.com">nobody</maintainer>
  <license>Apache-2.0</license>
  <buildtool_depend>ament_cmake</buildtool_depend>
  <build_depend>rosidl_default_generators</build_depend>
  <member_of_group>rosidl_interface_packages</member_of_group>
</package>
"""
TARGETS = (
    "rosidl_typesupport_c",
    "rosidl_typesupport_introspection_c",
    "rosidl_typesupport_fastrtps_c",
)


def with_another_blob(folder, text):
    """The environment of a program on a machine whose package has only a Blob.msg with this text;
    generates it in the folder."""
    source, build, prefix = (pathlib.Path(folder) / part for part in ("source", "build", "prefix"))
    (source / "msg").mkdir(parents=True)
    (source / "CMakeLists.txt").write_text(CMAKE.replace("@PACKAGE@", TEST_PACKAGE))
    (source / "package.xml").write_text(PACKAGE)
    (source / "msg" / "Blob.msg").write_text(text)
    python = pathlib.Path(os.environ.get("CONNECT_BRIDGE_OWN_PREFIX", "/usr")) / "bin/python3"
    options = [f"-DPython3_EXECUTABLE={python}", f"-DPYTHON_EXECUTABLE={python}"]
    flags = ["-DCMAKE_BUILD_TYPE=None", "-DCMAKE_C_FLAGS=-O0", "-DBUILD_TESTING=OFF"]
    targets = [f"{TEST_PACKAGE}__{target}" for target in TARGETS]
    for command in (
        ["cmake", "-S", source, "-B", build, "-G", "Ninja", *options, *flags],
        ["cmake", "--build", build, "--target", *targets],
    ):
        done = subprocess.run(command, text=True, capture_output=True, check=False)
        assert done.returncode == 0, done.stdout[-4000:] + done.stderr[-4000:]
    index = prefix / "share/ament_index/resource_index/packages"
    index.mkdir(parents=True)
    (index / TEST_PACKAGE).touch()
    (prefix / "lib").mkdir()
    for library in build.glob(f"lib{TEST_PACKAGE}__*.so"):
        (prefix / "lib" / library.name).symlink_to(library)
    return {
        "AMENT_PREFIX_PATH": f"{prefix}:{os.environ['AMENT_PREFIX_PATH']}",
        "LD_LIBRARY_PATH": f"{prefix / 'lib'}:{os.environ['LD_LIBRARY_PATH']}",
    }
