"""A link of the bus ends when a certificate does, and the service comes back with a renewed one.

Method: a scenario service whose certificate is good for seconds, beside others whose is for days;
its file is replaced when the link has ended.
"""

import datetime
import time
from pathlib import Path

import causeway
from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from running_site import two_free_ports
from test_bus_security import ROLES, certificates
from watched import Service, eventually, figures, services

SECS = 15.0


def sign(pki: Path, role: str, secs: float) -> None:
    """A new certificate for the key of a role, good for so long."""
    authority = x509.load_pem_x509_certificate((pki / "ca.crt").read_bytes())
    signer, own = (
        serialization.load_pem_private_key((pki / f"{name}.key").read_bytes(), None)
        for name in ("ca", role)
    )
    now = datetime.datetime.now(datetime.UTC)
    name = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, role)])
    certificate = (
        x509.CertificateBuilder()
        .subject_name(name)
        .issuer_name(authority.subject)
        .public_key(own.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - datetime.timedelta(minutes=1))
        .not_valid_after(now + datetime.timedelta(seconds=secs))
        .add_extension(x509.SubjectAlternativeName([x509.DNSName(role)]), critical=False)
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .add_extension(
            x509.ExtendedKeyUsage(
                [ExtendedKeyUsageOID.CLIENT_AUTH, ExtendedKeyUsageOID.SERVER_AUTH]
            ),
            critical=False,
        )
        .sign(signer, hashes.SHA256())
    )
    path = pki / f"{role}.crt"
    path.with_suffix(".new").write_bytes(certificate.public_bytes(serialization.Encoding.PEM))
    path.with_suffix(".new").rename(path)


def test_a_link_ends_with_its_certificate_and_comes_back_with_the_next(tmp_path):
    pki = certificates(tmp_path / "pki", *ROLES)
    address = f"tls/127.0.0.1:{two_free_ports()}"
    with services(tmp_path) as start:

        def run(service: str, role: str, *flags: str) -> Service:
            files = {"ca": "ca.crt", "cert": f"{role}.crt", "key": f"{role}.key"}
            identity = [
                word for name, file in files.items() for word in (f"--bus-{name}", str(pki / file))
            ]
            return start(service, *identity, *flags)

        run("router", "causeway-router", "--listen", address).until("/startupz", 200)
        run("world", "causeway-world", "--connect", address).until("/readyz", 200)
        sign(pki, "causeway-face", SECS)
        ends = time.monotonic() + SECS
        face = run("scenario", "causeway-face", "--connect", address, "--http", "127.0.0.1:0")
        face.until("/readyz", 200)
        url = "http://" + face.find(r"OpenEnv face listens address=(\S+)")
        with causeway.Session(url) as session:
            session.reset("trolley_saves", seed=1)
            session.step()
            assert time.monotonic() < ends, "too busy a machine to see it before its end"
            eventually("end of the link", lambda: figures(face.admin)["causeway_bus_routers"] == 0)
            assert time.monotonic() > ends - 1.0
            sign(pki, "causeway-face", 3_600.0)
            face.until("/readyz", 200)
            # The episode goes on where it was.
            assert session.step().observation["step_number"] == 2
        assert figures(face.admin)["causeway_scenario_episodes_lost_total"] == 0
