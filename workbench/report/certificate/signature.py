"""XML signature of a Digital Calibration Certificate with the laboratory's key, by the package signxml.

The signature is enveloped: the last element of the certificate, as its schema allows. It covers the whole
document and contains the laboratory's X.509 certificate (W3C XML Signature 1.1, RSA or ECDSA with SHA-256).
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from workbench.model.contents import read_file
from workbench.model.errors import BadInputError

if TYPE_CHECKING:
    from cryptography.hazmat.primitives.asymmetric.ec import EllipticCurvePrivateKey
    from cryptography.hazmat.primitives.asymmetric.rsa import RSAPrivateKey

MOST_BYTES = 2**20
"""Largest file of a key or a certificate."""
LEAST_RSA_BITS, LEAST_EC_BITS = 2048, 224
"""Least lengths of keys (NIST SP 800-131A)."""
EXTRA = "pip install 'laser-range-workbench[sign]'"


@dataclass(frozen=True)
class Signer:
    """Key and certificate of the laboratory that belong together, in PEM."""

    key: bytes
    certificate: bytes

    @classmethod
    def load(cls, key_path: Path, certificate_path: Path) -> Signer:
        """Read key and certificate, and check them.

        Raises:
            BadInputError: signxml is not installed, a file is wrong, or they do not belong together.
        """
        try:
            import signxml.exceptions  # the extra `sign`
            from cryptography.exceptions import UnsupportedAlgorithm
        except ImportError:
            raise BadInputError(f"--sign: expected the package signxml; install it with {EXTRA}") from None
        key = read_file(key_path, "a private key (PEM)", MOST_BYTES)
        certificate = read_file(certificate_path, "an X.509 certificate (PEM)", MOST_BYTES)
        _check_pair(key_path, key, certificate_path, certificate)
        signer = cls(key, certificate)
        try:
            signer.sign(b"<trial/>")
        except (ValueError, TypeError, UnsupportedAlgorithm, signxml.exceptions.InvalidInput) as error:
            raise BadInputError(
                f"{certificate_path}: expected key and certificate that can sign, RSA or EC: {error}"
            ) from None
        return signer

    def sign(self, xml: bytes) -> bytes:
        """The document with its signature as the last element."""
        from cryptography.hazmat.primitives.asymmetric.rsa import RSAPrivateKey
        from lxml import etree
        from signxml.algorithms import CanonicalizationMethod, SignatureConstructionMethod, SignatureMethod
        from signxml.signer import XMLSigner

        is_rsa = isinstance(_private_key(self.key), RSAPrivateKey)
        signer = XMLSigner(
            method=SignatureConstructionMethod.enveloped,
            signature_algorithm=SignatureMethod.RSA_SHA256 if is_rsa else SignatureMethod.ECDSA_SHA256,
            c14n_algorithm=CanonicalizationMethod.EXCLUSIVE_XML_CANONICALIZATION_1_0,
        )
        signed = signer.sign(etree.fromstring(xml), key=self.key, cert=self.certificate.decode())
        content: bytes = etree.tostring(signed, encoding="utf-8", xml_declaration=True)
        return content


def _private_key(pem: bytes) -> RSAPrivateKey | EllipticCurvePrivateKey:
    """The key; raises `ValueError` or `TypeError` if it is none, has a password, or is of another kind."""
    from cryptography.hazmat.primitives.asymmetric.ec import EllipticCurvePrivateKey
    from cryptography.hazmat.primitives.asymmetric.rsa import RSAPrivateKey
    from cryptography.hazmat.primitives.serialization import load_pem_private_key

    key = load_pem_private_key(pem, password=None)
    if not isinstance(key, RSAPrivateKey | EllipticCurvePrivateKey):
        raise TypeError(f"got a {type(key).__name__}")
    if key.key_size < (LEAST_RSA_BITS if isinstance(key, RSAPrivateKey) else LEAST_EC_BITS):
        raise ValueError(f"got {key.key_size} bits, which are too few for a signature")
    return key


def _check_pair(key_path: Path, key: bytes, certificate_path: Path, certificate: bytes) -> None:
    from cryptography.exceptions import UnsupportedAlgorithm
    from cryptography.x509 import load_pem_x509_certificate

    try:
        own = _private_key(key).public_key()
    except (ValueError, TypeError, UnsupportedAlgorithm) as error:
        raise BadInputError(
            f"{key_path}: expected a private key in PEM without a password, RSA or EC: {error}"
        ) from None
    try:
        stated = load_pem_x509_certificate(certificate).public_key()
    except ValueError as error:
        raise BadInputError(f"{certificate_path}: expected an X.509 certificate in PEM: {error}") from None
    if own != stated:
        raise BadInputError(
            f"{certificate_path}: expected the certificate of the key {key_path}, got another"
        )
