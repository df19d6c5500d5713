"""A wide-area network on this machine: two places that see each other by build/bench/wan alone."""

from harness.programs import build_dir, ros_environment
from harness.worker import Missing, Worker

ROBOT, OPERATOR = "robot", "operator"
ADDRESS = {ROBOT: "10.77.0.1", OPERATOR: "10.77.0.2"}


def words(verb, values):
    return " ".join([verb, *(f"{key}={value}" for key, value in values.items())])


class Wan:
    """Raises Missing where the machine forbids network namespaces."""

    def __init__(self, folder):
        program = build_dir() / "bench" / "wan"
        if not program.exists():
            raise Missing(f"{program} is not built")
        self._worker = Worker("wan", [program], ros_environment(0), folder).start()
        try:
            self._pids = self._worker.ready(10)
        except Missing:
            self.close()
            raise

    def within(self, place):
        """The beginning of a command that runs at this place."""
        return ["nsenter", "--target", str(self._pids[place]), "--net", "--mount", "--"]

    def pid(self, place):
        """The process whose namespaces are the place."""
        return self._pids[place]

    def set(self, **shape):
        """up, down: bit/s; delay, jitter, queue: s; loss: 0 to 1 (tests/bench/wan.cpp)."""
        self._worker.ask(words("set", shape))

    def drive(self, **drive):
        """seed, or up and down: files of a recorded one; delay: s; queue_bytes."""
        self._worker.ask(words("drive", drive))

    def cut(self):
        self._worker.ask("cut")

    def heal(self):
        self._worker.ask("heal")

    def count(self):
        """What crossed, and what could have, since the last time; by direction."""
        return self._worker.ask("count")

    def close(self):
        self._worker.close()
