#!/usr/bin/env python3
"""The middleware (RMW) of a process: where it is, and what it needs besides.

As a program it runs a command with what its middleware needs: middleware.py <command>...
CONNECT_BRIDGE_RMW_ROBOT and CONNECT_BRIDGE_RMW_OPERATOR: with one for each side.
"""

import json
import os
import pathlib
import sys
import tempfile

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))

from harness.domains import free_port  # noqa: E402
from harness.programs import ROOT, SIDES, Program  # noqa: E402
from harness.two_middlewares import two_middlewares  # noqa: E402

# A publisher that keeps its last samples drops one, reliable or not, when a reader of its socket is
# late by 1 ms (50 ms for a large sample). On a busy machine all are. In microseconds:
_DROP = "transport/link/tx/queue/congestion_control/drop"
_PATIENCE = (f"{_DROP}/wait_before_drop=100000", f"{_DROP}/max_wait_before_drop_fragments=500000")
_router = {}  # of this process: its program, its port


def _meeting_point(environment):
    """Nodes with rmw_zenoh_cpp find each other by a router. One is started here, which ends with
    this process. It is enough for many graphs: the domain id is a part of all names."""
    if not _router:
        prefixes = environment["AMENT_PREFIX_PATH"].split(":")
        programs = [pathlib.Path(p, "lib/rmw_zenoh_cpp/rmw_zenohd") for p in prefixes]
        command = [program for program in programs if program.exists()][:1]
        if not command:
            sys.exit("rmw_zenoh_cpp needs a router: no prefix has lib/rmw_zenoh_cpp/rmw_zenohd")
        at = f'endpoints=["tcp/127.0.0.1:{free_port()}"]'
        env = dict(os.environ, **environment, ZENOH_CONFIG_OVERRIDE=f"listen/{at}")
        with tempfile.TemporaryDirectory() as folder:  # it still has its log when that is gone
            router = Program("router", command, env, folder).start()
            router.wait_for("Started Zenoh router", 60)
        _router.update(program=router, at=at)
    return {"ZENOH_CONFIG_OVERRIDE": ";".join([f"connect/{_router['at']}", *_PATIENCE])}


def rmw_environment(name):
    """The environment that makes a process use this middleware; None: it is not installed."""
    folders = [f for f in os.environ.get("LD_LIBRARY_PATH", "").split(":") if f]
    prefixes = [p for p in os.environ.get("AMENT_PREFIX_PATH", "").split(":") if p]
    if os.environ.get("CONNECT_BRIDGE_OWN_PREFIX"):
        at = os.environ.get("CONNECT_BRIDGE_RMW_PREFIX")
        built = pathlib.Path(at or ROOT / ".ros2" / f"rmw-{os.environ['ROS_DISTRO']}")
        # What chooses would take itself for Fast DDS (tools/setup/rmw_sources.sh).
        folders = [f for f in folders if not f.startswith(str(built))]
        prefixes = [p for p in prefixes if p != str(built)]
        if name != "rmw_fastrtps_cpp":
            folders = [str(built / "lib/chooser"), str(built / "lib"), *folders]
            prefixes = [str(built), *prefixes]
    if not any(pathlib.Path(folder, f"lib{name}.so").exists() for folder in folders):
        return None
    environment = {
        "RMW_IMPLEMENTATION": name,
        "LD_LIBRARY_PATH": ":".join(folders),
        "AMENT_PREFIX_PATH": ":".join(prefixes),
    }
    if name == "rmw_zenoh_cpp":
        environment.update(_meeting_point(environment))
    return environment


def _prepare_sides(rmws):
    """The environment of each side's programs, and in this process, whose nodes are of both sides,
    a library that has both (harness.two_middlewares)."""
    environments = [rmw_environment(rmw) for rmw in rmws]
    prefix = os.environ.get("CONNECT_BRIDGE_OWN_PREFIX")
    for rmw, environment in zip(rmws, environments):
        if environment is None or not prefix:
            sys.exit(f"sides with middlewares of their own: no {rmw}, or not with this ROS 2")
    libraries = {"rmw_fastrtps_cpp": f"{prefix}/lib/librmw_fastrtps_cpp.so"}
    for rmw, environment in zip(rmws, environments):
        folders = environment["LD_LIBRARY_PATH"].split(":")
        files = [pathlib.Path(folder, f"lib{rmw}.so") for folder in folders]
        libraries.setdefault(rmw, next(str(file) for file in files if file.exists()))
    folder = two_middlewares(prefix, libraries, ROOT / ".ros2/two-middlewares")
    most = max(environments, key=lambda environment: len(environment["LD_LIBRARY_PATH"]))
    ours = {**most, "RMW_IMPLEMENTATION": rmws[0]}
    ours["LD_LIBRARY_PATH"] = f"{folder}:{most['LD_LIBRARY_PATH']}"
    os.environ.update(ours)
    os.environ[SIDES] = json.dumps(environments)


def prepare():
    """What the middleware needs that this process, and all that it starts, use by default."""
    usual = os.environ.get("RMW_IMPLEMENTATION", "rmw_fastrtps_cpp")
    sides = ("CONNECT_BRIDGE_RMW_ROBOT", "CONNECT_BRIDGE_RMW_OPERATOR")
    rmws = [os.environ.get(side) or usual for side in sides]
    if rmws != [usual, usual]:
        _prepare_sides(rmws)
    elif usual == "rmw_zenoh_cpp":
        os.environ.update(rmw_environment("rmw_zenoh_cpp") or {})


if __name__ == "__main__":
    prepare()
    os.execvp(sys.argv[1], sys.argv[1:])
