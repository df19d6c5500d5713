"""The cases of tools/bench/wan by a relay, beside the direct way over the same legs, and beside
`ssh -R`, with which people join two ends today. The relay stands at one of the ends: so one leg is
the emulated network, and the other one is none."""

import contextlib
import os
import pathlib
import shutil
import subprocess
import tempfile

from harness.domains import free_port
from harness.programs import ROOT, Program, build_dir
from harness.wan import ADDRESS, OPERATOR, ROBOT
from harness.worker import Missing
from wan_cases import LOSSY, NET, OVERLOAD, Row, pinged

NAME = "robot7"
FETCHED = pathlib.Path(os.environ.get("CONNECT_PROXIES") or ROOT / ".ros2" / "proxies")
# As a container has it: sshd wants its user, and changes nothing of this machine.
_SSHD = """
mount -t tmpfs tmpfs /run && mkdir -m 755 /run/sshd && cp /etc/passwd {folder}/passwd &&
echo 'sshd:x:65533:65534::/run/sshd:/usr/sbin/nologin' >>{folder}/passwd &&
mount --bind {folder}/passwd /etc/passwd && exec {sshd} -D -e -f {folder}/sshd_config
"""


def relayed(bed, effort):
    rows, direct = [], {}
    for way, where in (("direct, TLS", None), ("relay", OPERATOR), ("relay", ROBOT)):
        leg = {None: "", OPERATOR: ", network before it", ROBOT: ", network behind it"}[where]
        with _way(bed, where) as (server, client):
            bed.open("priorities", server, client)
            for what, net in (("", NET), (", 1 % loss", LOSSY)):
                bed.wan.set(**net)
                if not what:
                    rows.append(Row(f"{way}{leg}: idle", pinged(bed, effort["seconds"])))
                result = pinged(bed, effort["seconds"], {"up": OVERLOAD})
                row = Row(f"{way}{leg}: 500 kB at 10 Hz up{what}", result)
                rows.append(_beside(row, direct.setdefault(what, result), where, what))
            bed.clear()
    try:
        rows.append(_by_ssh(bed, effort, direct[""]))
    except Missing as error:
        print(f"NOT MEASURED: ssh -R: {error}", flush=True)
    return rows


def _beside(row, direct, where, lossy):
    if where is None:
        return row
    if lossy:
        share = sum(row.result.goodput("up")) / sum(direct.goodput("up"))
        return row.judge("large / direct", share, ">=", 0.95 if where == OPERATOR else 0.8)
    row.judge("p50 beyond direct, ms", row.result.ms(50) - direct.ms(50), "<=", 1)
    row.judge("p99 beyond direct, ms", row.result.ms(99) - direct.ms(99), "<=", 5)
    return row.judge("lost", row.result.lost, "<=", 0)


def _ctl(*words):
    done = subprocess.run([build_dir() / "ctl", *map(str, words)], check=True, capture_output=True)
    return done.stdout.decode().strip()


@contextlib.contextmanager
def _way(bed, where):
    """The parameters of both ends; where: the place of the relay, or nothing."""
    folder = pathlib.Path(tempfile.mkdtemp(dir=bed.folder))
    _ctl("certs", folder / "robot", "--host", NAME)
    own = folder / "robot"
    keys = {"certificate": f"{own}/server.crt", "private_key": f"{own}/server.key"}
    trust = {"ca": f"{own}/ca.crt"}
    tls = {"allow_plaintext": False, "tls": keys}
    port = free_port()
    if where is None:
        url = f"wss://{ADDRESS[ROBOT]}:{port}"
        named = {**trust, "server_name": NAME}
        yield (
            {**tls, "listen": {"address": ADDRESS[ROBOT], "port": port}},
            {"allow_plaintext": False, "url": url, "tls": named},
        )
        return
    _ctl("certs", folder / "relay", "--host", ADDRESS[where])
    token = folder / "robot.token"
    token.write_text(_ctl("token", NAME, "--file", folder / "robots.yaml"))
    token.chmod(0o600)
    file = folder / "relay.yaml"
    file.write_text(
        f"listen: {{address: '*', port: {port}}}\nauth: {{token_file: {folder}/robots.yaml}}\n"
        f"tls: {{certificate: {folder}/relay/server.crt, private_key: {folder}/relay/server.key}}\n"
    )
    command = [*bed.wan.within(where), build_dir() / "relay", file]
    relay = Program("relay", command, dict(os.environ), folder).start()
    url = f"wss://{NAME}@{ADDRESS[where]}:{port}/"
    try:
        relay.wait_for("listens on port")
        waits = {"url": url, "token_file": str(token), "ca": f"{folder}/relay/ca.crt"}
        yield (
            {**tls, "listen": {"port": 0, "relay": waits}},
            {"allow_plaintext": False, "url": url, "tls": trust},
        )
    finally:
        relay.kill()


def _by_ssh(bed, effort, direct):
    """The relay's machine is the operator's, as above: the network is the robot's leg."""
    folder = pathlib.Path(bed.folder) / "ssh"
    folder.mkdir(mode=0o700)
    folders = f"{FETCHED}/usr/sbin:/usr/sbin:{os.environ['PATH']}"
    found = [shutil.which(name, path=folders) for name in ("sshd", "ssh", "ssh-keygen")]
    if not all(found):
        raise Missing("openssh-server is not installed (tools/setup/proxies.sh)")
    sshd, ssh, keygen = found
    for key in ("host", "robot"):
        subprocess.run([keygen, "-q", "-t", "ed25519", "-N", "", "-f", folder / key], check=True)
    port, tunnel, server_port = free_port(), free_port(), free_port()
    (folder / "sshd_config").write_text(
        f"Port {port}\nHostKey {folder}/host\nAuthorizedKeysFile {folder}/robot.pub\n"
        "StrictModes no\nPermitRootLogin yes\nUsePAM no\nPidFile none\n"
    )
    script = _SSHD.format(folder=folder, sshd=sshd)
    command = [*bed.wan.within(OPERATOR), "unshare", "-m", "sh", "-c", script]
    libraries = ":".join(map(str, FETCHED.glob("usr/lib/*-linux-gnu")))
    began = [Program("sshd", command, dict(os.environ, LD_LIBRARY_PATH=libraries), folder).start()]
    try:
        began[0].wait_for("Server listening")
        trusts = ("StrictHostKeyChecking=no", "UserKnownHostsFile=/dev/null")
        words = [word for option in trusts for word in ("-o", option)]
        ways = f"127.0.0.1:{tunnel}:127.0.0.1:{server_port}"
        words += ["-i", folder / "robot", "-p", port, "-N", "-v", "-R", ways]
        command = [*bed.wan.within(ROBOT), ssh, *words, f"root@{ADDRESS[OPERATOR]}"]
        began.append(Program("ssh", command, dict(os.environ), folder).start())
        began[1].wait_for("remote forward success")
        bed.wan.set(**NET)
        bed.open(
            "priorities",
            {"listen": {"address": "127.0.0.1", "port": server_port}},
            {"url": f"ws://127.0.0.1:{tunnel}"},
        )
        result = pinged(bed, effort["seconds"], {"up": OVERLOAD})
        bed.clear()
    except RuntimeError as error:
        raise Missing(str(error)) from None
    finally:
        for program in reversed(began):
            program.kill()
    row = Row("ssh -R: 500 kB at 10 Hz up", result)
    return row.judge("p50 / direct", result.ms(50) / direct.ms(50), ">=", 1)
