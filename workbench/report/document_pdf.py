"""PDF of a document's HTML page, by WeasyPrint; equal pages give equal bytes."""

from __future__ import annotations

import hashlib
from pathlib import Path

from workbench.model.errors import BadInputError

PANGO = (
    "the PDF needs the system library pango; install it (Debian: libpango-1.0-0 libpangoft2-1.0-0"
    " libharfbuzz-subset0; macOS: brew install pango), or write the HTML page alone and print it from a"
    " browser"
)
FACES = (
    ("Document Sans", "normal", "normal", "DejaVuSans.ttf"),
    ("Document Sans", "bold", "normal", "DejaVuSans-Bold.ttf"),
    ("Document Sans", "normal", "italic", "DejaVuSans-Oblique.ttf"),
    ("Document Mono", "normal", "normal", "DejaVuSansMono.ttf"),
)
"""Family, weight, style and file of the fonts, which matplotlib contains: no installed font is needed."""


def document_pdf(html: str) -> bytes:
    """PDF of the page.

    Raises:
        BadInputError: the system library pango is missing.
    """
    try:
        from weasyprint import CSS, HTML
        from weasyprint.text.fonts import FontConfiguration
    except OSError:
        raise BadInputError(f"--pdf: {PANGO}") from None
    fonts = FontConfiguration()
    style = CSS(string=_font_faces(), font_config=fonts)
    identifier = hashlib.sha256(html.encode()).digest()[:16]
    document = HTML(string=html)
    content: bytes = document.write_pdf(stylesheets=[style], font_config=fonts, pdf_identifier=identifier)
    return content


def _font_faces() -> str:
    from matplotlib import get_data_path

    folder = Path(get_data_path()) / "fonts/ttf"
    return "\n".join(
        f'@font-face {{ font-family: "{family}"; font-weight: {weight}; font-style: {style};'
        f" src: url({(folder / file).as_uri()}) }}"
        for family, weight, style, file in FACES
    )
