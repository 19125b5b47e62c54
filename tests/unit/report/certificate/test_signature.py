"""XML signature of the Digital Calibration Certificate, verified by signxml and by xmlsec."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

import pytest
from cryptography.hazmat.primitives.asymmetric import ec, ed25519, rsa
from cryptography.hazmat.primitives.serialization import (
    BestAvailableEncryption,
    Encoding,
    NoEncryption,
    PrivateFormat,
)
from lxml import etree

from tests.support.laboratory_key import Key, write_key
from tests.support.reference_session import certificate
from workbench.model.errors import BadInputError
from workbench.report.certificate.dcc import certificate_xml
from workbench.report.certificate.signature import Signer

signxml = pytest.importorskip("signxml", reason="the optional extra `sign` is not installed")
xmlsec = pytest.importorskip("xmlsec", reason="a second implementation, of the extra `dev`")

NOW = datetime(2026, 11, 30, tzinfo=UTC)
KEYS: dict[str, Key] = {
    "rsa": rsa.generate_private_key(65537, 2048),
    "ec": ec.generate_private_key(ec.SECP256R1()),
}


@pytest.mark.parametrize("kind", KEYS)
def test_two_implementations_verify_the_signature_and_find_a_change(tmp_path: Path, kind: str) -> None:
    key, cert = write_key(tmp_path, KEYS[kind])
    plain = certificate_xml(certificate(), NOW)
    signed = Signer.load(key, cert).sign(plain)
    verified = signxml.XMLVerifier().verify(signed, x509_cert=cert.read_text())
    assert etree.tostring(verified.signed_xml, method="c14n2", strip_text=True) == etree.tostring(
        etree.fromstring(plain), method="c14n2", strip_text=True
    )
    verify_by_xmlsec(signed, cert)
    number = b"2026-0001</"
    changed = signed.replace(number, b"2026-0002</", 1)
    assert changed != signed
    with pytest.raises(signxml.exceptions.InvalidSignature):
        signxml.XMLVerifier().verify(changed, x509_cert=cert.read_text())
    with pytest.raises(xmlsec.Error):
        verify_by_xmlsec(changed, cert)


def verify_by_xmlsec(document: bytes, cert: Path) -> None:
    root = etree.fromstring(document)
    context = xmlsec.SignatureContext()
    context.key = xmlsec.Key.from_file(str(cert), xmlsec.constants.KeyDataFormatCertPem)
    context.verify(xmlsec.tree.find_node(root, xmlsec.constants.NodeSignature))


def test_the_signature_is_the_last_element(tmp_path: Path) -> None:
    signed = Signer.load(*write_key(tmp_path, KEYS["ec"])).sign(certificate_xml(certificate(), NOW))
    root = etree.fromstring(signed)
    assert root[-1].tag == "{http://www.w3.org/2000/09/xmldsig#}Signature"
    assert root.tag == "{https://ptb.de/dcc}digitalCalibrationCertificate"


def test_a_short_key_and_a_certificate_that_cannot_be_embedded_are_named(tmp_path: Path) -> None:
    short = rsa.generate_private_key(65537, 1024)  # noqa: S505  # it is to be refused
    with pytest.raises(BadInputError, match="1024"):
        Signer.load(*write_key(tmp_path, short))
    key, cert = write_key(tmp_path, KEYS["ec"])
    cert.write_bytes(b"Pr\xfcfung\n" + cert.read_bytes())
    with pytest.raises(BadInputError, match=str(cert)):
        Signer.load(key, cert)


def test_wrong_files_are_named(tmp_path: Path) -> None:
    key, cert = write_key(tmp_path, KEYS["rsa"])
    (tmp_path / "other").mkdir()
    other, _ = write_key(tmp_path / "other", KEYS["ec"])
    for paths, named in (
        ((other, cert), cert),
        ((cert, cert), cert),
        ((key, key), key),
        ((tmp_path / "missing", cert), tmp_path / "missing"),
    ):
        with pytest.raises(BadInputError, match=str(named)):
            Signer.load(*paths)
    encrypted = KEYS["rsa"].private_bytes(Encoding.PEM, PrivateFormat.PKCS8, BestAvailableEncryption(b"x"))
    foreign = ed25519.Ed25519PrivateKey.generate()
    for content in (encrypted, foreign.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption())):
        key.write_bytes(content)
        with pytest.raises(BadInputError, match="without a password"):
            Signer.load(key, cert)
