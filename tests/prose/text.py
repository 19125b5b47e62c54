"""Blocks of prose with their lines, of Markdown, and of docstrings, comments, strings and names."""

from __future__ import annotations

import ast
import io
import re
import tokenize
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

MIN_WORDS_OF_A_MESSAGE = 3
"""Strings of fewer words are keys, names and paths, not messages."""

CODE = "\N{SECTION SIGN}"
"""Placeholder of a piece of code in backquotes: one word, never a finding."""


_ITEM = r"(#+|[-*+]|\d+\.) |\|"
_BEGINS = (re.compile(_ITEM), re.compile(rf"{_ITEM}|\*{{0,2}}\w+(, \w+)*:( |$)"))
"""First characters of a new block in Markdown, in a docstring: there an argument's name or `Args:` too."""


@dataclass(frozen=True)
class Block:
    """One paragraph, list item, table cell, comment, message or name."""

    path: Path
    line: int
    """Line of the file on which the text begins; a line break in the text is one in the file."""
    kind: str
    """`markdown`, `docstring`, `comment`, `string` or `name`."""
    text: str
    opening: bool = False
    """Whether a docstring begins here."""

    def line_at(self, offset: int) -> int:
        """Line of the file that holds the character `offset` of the text."""
        return self.line + self.text.count("\n", 0, offset)


def blocks(path: Path) -> list[Block]:
    """All prose of one Markdown or Python file.

    Raises:
        SyntaxError: the Python file cannot be parsed.
    """
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".md":
        return list(_paragraphs(path, 1, "markdown", _without_fences(text)))
    return list(_python(path, text))


def _without_fences(text: str) -> str:
    """Markdown with the lines of fenced code and HTML comments blanked."""

    def blank(match: re.Match[str]) -> str:
        return "\n" * match.group().count("\n")

    text = re.sub(r"^[ \t]*(```+|~~~+).*?^[ \t]*\1[ \t]*$", blank, text, flags=re.MULTILINE | re.DOTALL)
    return re.sub(r"<!--.*?-->", blank, text, flags=re.DOTALL)


def _paragraphs(path: Path, first_line: int, kind: str, text: str) -> Iterator[Block]:
    """Paragraphs, headings, list items, table cells; indented code and doctests are left out."""
    held: list[str] = []
    begin = first_line
    indent = 0
    after_blank = True
    example = False
    for number, line in enumerate(text.split("\n"), start=first_line):
        stripped = line.strip()
        depth = len(line) - len(line.lstrip())
        code = after_blank and not held and depth >= indent + 4
        example = bool(stripped) and (example or stripped.startswith(">>> "))
        begins = bool(_BEGINS[kind == "docstring"].match(stripped))
        if not stripped or begins or code or example:
            yield from _block(path, begin, kind, held)
            held = []
        if not stripped:
            after_blank = True
            continue
        if code or example:
            continue
        if stripped.startswith("|"):
            for cell in stripped.strip("|").split("|"):
                yield from _block(path, number, kind, [cell])
        elif stripped.startswith("#"):
            yield from _block(path, number, kind, [stripped.lstrip("#")])
        else:
            if not held:
                begin = number
            marker = re.match(r"([-*+]|\d+\.) +", stripped)
            indent = depth + len(marker.group()) if marker else min(indent, depth)
            held.append(stripped[marker.end() :] if marker else stripped)
            if kind == "docstring" and re.fullmatch(r"\w+:", stripped):  # `Args:`
                yield from _block(path, begin, kind, held)
                held = []
        after_blank = False
    yield from _block(path, begin, kind, held)


def _block(path: Path, line: int, kind: str, lines: list[str]) -> Iterator[Block]:
    text = _plain("\n".join(lines))
    if text.strip():
        yield Block(path, line, kind, text)


def _plain(text: str) -> str:
    """Text without markup: code becomes one placeholder word, a link its label; line breaks stay."""

    def code(match: re.Match[str]) -> str:
        return CODE + "\n" * match.group().count("\n")

    text = re.sub(r"(`+)[^`]+\1", code, text)
    text = re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", text)
    return text.replace("**", "").replace("*", "")


def _python(path: Path, text: str) -> Iterator[Block]:
    tree = ast.parse(text, filename=str(path))
    docstrings = dict(_docstrings(tree))
    f_strings = [node for node in ast.walk(tree) if isinstance(node, ast.JoinedStr)]
    parts = {id(part) for f_string in f_strings for part in f_string.values}
    for node in ast.walk(tree):
        if id(node) in docstrings:
            yield from _docstring(path, docstrings[id(node)])
        elif isinstance(node, ast.JoinedStr | ast.Constant) and id(node) not in parts:
            message = _message(node)
            if len(re.findall(r"[A-Za-z]{2,}", message)) >= MIN_WORDS_OF_A_MESSAGE and " " in message:
                yield Block(path, node.lineno, "string", _plain(message.replace("\n", " ")))
        yield from _names(path, node)
    yield from _comments(path, text)


def _docstrings(tree: ast.Module) -> Iterator[tuple[int, ast.Constant]]:
    """Each string that stands alone as a statement: of modules, classes, functions and attributes."""
    for node in ast.walk(tree):
        if (
            isinstance(node, ast.Expr)
            and isinstance(node.value, ast.Constant)
            and isinstance(node.value.value, str)
        ):
            yield id(node.value), node.value


def _docstring(path: Path, node: ast.Constant) -> Iterator[Block]:
    lines = str(node.value).split("\n")
    indented = [line for line in lines[1:-1] if line.strip()] + lines[1:][-1:]  # the last closes the quotes
    margin = min((len(line) - len(line.lstrip()) for line in indented), default=0)
    text = "\n".join([lines[0], *(line[margin:] for line in lines[1:])])
    for index, block in enumerate(_paragraphs(path, node.lineno, "docstring", text)):
        yield Block(path, block.line, block.kind, block.text, opening=index == 0)


def _message(node: ast.JoinedStr | ast.Constant) -> str:
    """Text of a string; an expression in an f-string is the placeholder."""
    if isinstance(node, ast.Constant):
        return node.value if isinstance(node.value, str) else ""
    return "".join(_message(part) if isinstance(part, ast.Constant) else CODE for part in node.values)


def _names(path: Path, node: ast.AST) -> Iterator[Block]:
    """Names that the node defines, with a space between their words."""
    names: list[str] = []
    line = getattr(node, "lineno", 1)
    if isinstance(node, ast.FunctionDef | ast.ClassDef):
        names = [node.name]
    elif isinstance(node, ast.arg):
        names = [node.arg]
    elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
        names = [node.id]
    for name in names:
        words = re.findall(r"[A-Z]?[a-z0-9]+|[A-Z]+(?![a-z])", name)
        if words:
            yield Block(path, line, "name", " ".join(words).lower())


def _comments(path: Path, text: str) -> Iterator[Block]:
    """Comments; lines of comment that follow one another are one block."""
    held: list[str] = []
    begin = last = 0
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type != tokenize.COMMENT:
            continue
        line = token.start[0]
        alone = token.line.strip().startswith("#")
        if held and not (alone and line == last + 1):
            yield from _block(path, begin, "comment", held)
            held = []
        if not held:
            begin = line
        held.append(token.string.lstrip("#").strip())
        last = line
    yield from _block(path, begin, "comment", held)
