"""Real reverse proxies with the configurations of docs/proxies.md, on loopback."""

import base64
import contextlib
import hashlib
import os
import pathlib
import re
import shutil
import signal
import socket
import subprocess
import tempfile

import pytest

from graph import until
from harness.domains import free_port
from harness.programs import ROOT, Program

PAGE = ROOT / "docs" / "proxies.md"
# The folder where tools/setup/proxies.sh puts proxies that are not installed.
FETCHED = pathlib.Path(os.environ.get("CONNECT_PROXIES") or ROOT / ".ros2" / "proxies")
_BLOCK = re.compile(r"^<!-- test: (.*?) -->\n```\w+\n(.*?)^```$", re.M | re.S)


def blocks():
    """The examples of the page by the names above them."""
    return dict(_BLOCK.findall(PAGE.read_text(encoding="utf-8")))


def find(program):
    """The path of a program, or nothing."""
    folders = [*os.get_exec_path(), "/usr/sbin", FETCHED / "usr/sbin", FETCHED / "usr/bin"]
    return shutil.which(program, path=os.pathsep.join(map(str, folders)))


class Proxy:
    """One proxy that listens on `port` and forwards to `server_port`; `seconds` replaces the page's
    60 for timeouts of a connection. Subclasses define how it is run."""

    program = ""
    block = ""
    keeps = True  # whether it keeps connections when it reloads
    reload_signal = None

    @classmethod
    def made(cls, *arguments):
        """One, or the test is skipped."""
        if not find(cls.program):
            pytest.skip(f"{cls.program} is not installed (tools/setup/proxies.sh)")
        return cls(*arguments)

    def __init__(self, folder, port, server_port, authority, seconds=60):
        self.folder = pathlib.Path(folder)
        self.port = port
        self.seconds = seconds
        self.binary = find(self.program)
        key = (authority / "server.key").read_text(encoding="ascii")
        certificate = (authority / "server.pem").read_text(encoding="ascii")
        (self.folder / "robot.pem").write_text(certificate + key, encoding="ascii")
        self.changes = {
            "9090": str(server_port),
            "443": str(port),
            "robot.example": "localhost",
            "/etc/ssl/robot.crt": str(authority / "server.pem"),
            "/etc/ssl/robot.key": str(authority / "server.key"),
            "/etc/ssl/robot.pem": str(self.folder / "robot.pem"),
            "/etc/haproxy/robot.pem": str(self.folder / "robot.pem"),
        }
        self.config = self.folder / f"{self.block}.conf"
        self.config.write_text(self.whole(self.shown()), encoding="utf-8")
        libraries = ":".join(map(str, FETCHED.glob("usr/lib/*-linux-gnu")))
        env = dict(os.environ, LD_LIBRARY_PATH=libraries, HOME=str(self.folder))
        self.running = Program(self.block, self.command(), env, self.folder)

    def shown(self):
        """The page's configuration for this place."""
        text = blocks()[self.block]
        for old, new in self.changes.items():
            text = re.sub(rf"(?<![\w.]){re.escape(old)}(?!\w)", new, text)
        return re.sub(r"\b60(?=s?;?$)", str(self.seconds), text, flags=re.M)

    def start(self):
        self.running.start()
        until(self._listens, lambda: f"{self.block} listens\n{self.running.text()}", 60.0)
        return self

    def _listens(self):
        assert self.running.running(), self.running.text()
        with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", self.port), 5):
            return True
        return False

    def reload(self):
        self.running.process.send_signal(self.reload_signal)

    def restart(self):
        self.stop()
        self.start()

    def stop(self):
        self.running.stop(timeout=30)  # httpd gives its old processes 10 s


class Nginx(Proxy):
    program, block = "nginx", "nginx"
    reload_signal = signal.SIGHUP

    def whole(self, shown):
        temporary = "".join(
            f"    {kind}_temp_path {self.folder / kind};\n"
            for kind in ("client_body", "proxy", "fastcgi", "uwsgi", "scgi")
        )
        return (
            f"daemon off;\npid {self.folder}/nginx.pid;\nevents {{}}\n"
            f"http {{\n    access_log off;\n{temporary}{shown}}}\n"
        )

    def command(self):
        return [self.binary, "-p", self.folder, "-e", "stderr", "-c", self.config]


class HaProxy(Proxy):
    program, block = "haproxy", "haproxy"
    reload_signal = signal.SIGUSR2

    def whole(self, shown):
        return shown

    def command(self):
        return [self.binary, "-W", "-f", self.config]


class HaProxyTcp(HaProxy):
    block = "haproxy_tcp"


class Apache(Proxy):
    program, block = "apache2", "apache"
    reload_signal = signal.SIGUSR1

    modules = ("ssl", "headers", "reqtimeout", "proxy", "proxy_http")

    def whole(self, shown):
        folder = pathlib.Path(self.binary).parents[1] / "lib/apache2/modules"
        names = ("mpm_event", "authz_core", *self.modules)
        loaded = "".join(f"LoadModule {name}_module {folder}/mod_{name}.so\n" for name in names)
        if os.getuid() == 0:
            loaded += "User nobody\nGroup nogroup\n"
        return (
            f"ServerRoot {self.folder}\nServerName localhost\nPidFile {self.folder}/apache.pid\n"
            f"DefaultRuntimeDir {self.folder}\nMutex file:{self.folder}\n"
            f"ErrorLog /dev/stderr\nListen {self.port}\n{loaded}{shown}"
        )

    def command(self):
        return [self.binary, "-f", self.config, "-D", "FOREGROUND"]


class ForwardProxy(Apache):
    """An HTTP proxy for clients: it requires a login, and connects to one port only."""

    block = "forward"
    modules = ("authn_core", "authn_file", "auth_basic", "authz_user", "proxy", "proxy_connect")
    login = "anna:open sesame"

    def shown(self):
        name, password = self.login.split(":")
        digest = base64.b64encode(hashlib.sha1(password.encode()).digest()).decode()
        # If it is started as root, it reads the file as another user.
        with tempfile.NamedTemporaryFile("w", encoding="ascii", delete=False) as users:
            users.write(f"{name}:{{SHA}}{digest}\n")
        self.users = pathlib.Path(users.name)
        self.users.chmod(0o644)
        return (
            f"ProxyRequests On\nAllowCONNECT {self.changes['9090']}\n<Proxy *>\n"
            f"AuthType Basic\nAuthName proxy\nAuthUserFile {self.users}\n"
            "Require valid-user\n</Proxy>\n"
        )


class Caddy(Proxy):
    program, block = "caddy", "caddy"
    keeps = False

    def whole(self, shown):
        self.admin = f"localhost:{free_port()}"
        own = f"    admin {self.admin}\n    auto_https disable_redirects\n"
        return shown.replace("{\n", "{\n" + own, 1)

    def command(self):
        return [self.binary, "run", "--config", self.config, "--adapter", "caddyfile"]

    def reload(self):
        words = ["--config", self.config, "--adapter", "caddyfile", "--address", self.admin]
        command = [self.binary, "reload", "--force", *words]
        subprocess.run(
            command, env=self.running.env, check=True, capture_output=True, timeout=60
        )


PROXIES = (Nginx, HaProxy, HaProxyTcp, Apache, Caddy)
