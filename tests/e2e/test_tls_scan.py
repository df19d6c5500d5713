"""What a public scanner says of a server's TLS: it is as Mozilla's "intermediate" asks.

Skipped where the scanner is not there (tools/setup/scanner.sh fetches it)."""

import json
import os
import pathlib
import subprocess

import pytest

from harness.domains import free_port
from harness.programs import build_dir

SCANNER = pathlib.Path(__file__).resolve().parents[2] / ".ros2/sslyze/bin/python"

pytestmark = pytest.mark.skipif(
    not SCANNER.exists(), reason="NOT TESTED: there is no sslyze (tools/setup/scanner.sh)"
)


def scan(port, authority, report):
    command = [SCANNER, "-m", "sslyze", "--mozilla_config", "intermediate"]
    command += ["--certinfo_ca_file", authority, "--json_out", report, f"localhost:{port}"]
    # The scanner has an interpreter of its own.
    clean = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    return subprocess.run(command, text=True, capture_output=True, env=clean, timeout=120)


def run(*command):
    subprocess.run(command, check=True, capture_output=True)


def ecdsa(folder):
    run(build_dir() / "ctl", "certs", folder, "--host", "localhost")
    server = {"certificate": str(folder / "server.crt"), "private_key": str(folder / "server.key")}
    return server, folder / "ca.crt"


def rsa(folder):
    """The other kind of key that public authorities sign."""
    _, authority = ecdsa(folder)
    key, request, certificate = (folder / f"rsa.{end}" for end in ("key", "csr", "crt"))
    run(
        *("openssl", "req", "-newkey", "rsa:2048", "-nodes", "-subj", "/CN=localhost"),
        *("-keyout", key, "-out", request),
    )
    extensions = folder / "extensions"
    extensions.write_text(
        "subjectAltName=DNS:localhost\nauthorityKeyIdentifier=keyid\nextendedKeyUsage=serverAuth\n"
    )
    run(
        *("openssl", "x509", "-req", "-in", request, "-CA", authority, "-CAkey", folder / "ca.key"),
        *("-days", "30", "-sha256", "-extfile", extensions, "-out", certificate),
    )
    return {"certificate": str(certificate), "private_key": str(key)}, authority


@pytest.mark.parametrize("make", (ecdsa, rsa))
def test_a_scanner_finds_nothing(make, tmp_path, domains, make_side):
    tls, authority = make(tmp_path / "certs")
    port = free_port()
    parameters = {"listen": {"port": port}, "tls": tls, "auth": {"token": "x" * 20}}
    make_side("server", domains(1)[0], parameters).start().wait_listening()
    report = tmp_path / "scan.json"
    done = scan(port, authority, report)
    assert "OK - Compliant" in done.stdout, done.stdout + done.stderr
    offered = json.loads(report.read_text())["server_scan_results"][0]["scan_result"]
    for old in ("ssl_2_0", "ssl_3_0", "tls_1_0", "tls_1_1"):
        assert not offered[f"{old}_cipher_suites"]["result"]["accepted_cipher_suites"], old
    suites = offered["tls_1_2_cipher_suites"]["result"]["accepted_cipher_suites"]
    assert suites and not [one for one in suites if "_CBC_" in one["cipher_suite"]["name"]]
