"""Reader of Digital Calibration Certificates that is not ours: pydcc, without network and signatures."""

from __future__ import annotations

import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any
from xml.etree import ElementTree as ET

import pytest


def read_dcc(path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    """Read a certificate with pydcc.

    Its package `certvalidator` does not know the version numbers of OpenSSL from 3.0.10 on and fails on
    import; its schema validator downloads PTB's list of releases. Neither reads an unsigned certificate.
    """
    stub = ModuleType("certvalidator")
    for name in ("CertificateValidator", "ValidationContext", "errors"):
        setattr(stub, name, SimpleNamespace())
    monkeypatch.setitem(sys.modules, "certvalidator", stub)
    from dcc import dcc

    monkeypatch.setattr(dcc, "DCCXMLValidator", SimpleNamespace)
    return dcc.DCC(str(path), signature_verification=False)


def parsed(content: bytes) -> ET.Element:
    """Root element of a certificate."""
    return ET.fromstring(content)  # noqa: S314 - our own file
