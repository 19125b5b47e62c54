"""The rules of `rules.toml`, applied to blocks of prose."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tests.prose.text import CODE, Block, blocks

RULES = Path(__file__).with_name("rules.toml")
PROSE_KINDS = ("markdown", "docstring", "comment", "string")

_ABBREVIATION = re.compile(r"(?:\b[A-Z]|\be\.g|\bi\.e|\bcf|\bvs|\bFig|\bEq|\bNo|\bDr|\betc|\bapprox)\.$")


@dataclass(frozen=True)
class Finding:
    """One breach of a rule."""

    path: Path
    line: int
    rule: str
    words: str
    instead: str

    def __str__(self) -> str:
        """`file:line: rule: words (what to write)`."""
        return f"{self.path}:{self.line}: {self.rule}: {self.words} ({self.instead})"


@dataclass(frozen=True)
class Avoid:
    """Phrases to avoid in some kinds of text."""

    name: str
    pattern: re.Pattern[str]
    instead: str
    kinds: Sequence[str]
    allowed: re.Pattern[str] | None

    def findings(self, block: Block) -> Iterator[Finding]:
        """Each phrase in the block that the rule's exceptions do not cover."""
        if block.kind not in self.kinds:
            return
        spans = [match.span() for match in self.allowed.finditer(block.text)] if self.allowed else []
        for match in self.pattern.finditer(block.text):
            if not any(low <= match.start() and match.end() <= high for low, high in spans):
                words = " ".join(match.group().split())
                yield Finding(block.path, block.line_at(match.start()), self.name, words, self.instead)


@dataclass(frozen=True)
class Allowed:
    """Accepted exception: findings of some words in one file, for a reason."""

    path: str
    words: str
    reason: str

    def covers(self, finding: Finding) -> bool:
        """Whether a finding is this exception."""
        return finding.path.as_posix().endswith(self.path) and finding.words == self.words


@dataclass(frozen=True)
class Rules:
    """Contents of `rules.toml`."""

    avoid: Sequence[Avoid]
    longest_sentence: int
    """Words."""
    sentence_kinds: Sequence[str]
    openings: frozenset[str] = field(default_factory=frozenset)
    paths: Sequence[str] = ()
    allow: Sequence[Allowed] = ()

    def findings(self, block: Block) -> Iterator[Finding]:
        """Findings in one block, without accepted exceptions."""
        for finding in self._all_findings(block):
            if not any(allowed.covers(finding) for allowed in self.allow):
                yield finding

    def _all_findings(self, block: Block) -> Iterator[Finding]:
        for rule in self.avoid:
            yield from rule.findings(block)
        if block.kind in self.sentence_kinds:
            yield from self._long_sentences(block)
        if block.opening:
            yield from self._opening(block)

    def _long_sentences(self, block: Block) -> Iterator[Finding]:
        for offset, sentence in sentences(block.text):
            count = len(_words(sentence))
            if count > self.longest_sentence:
                words = " ".join(sentence.split()[:6]) + " ..."
                line = block.line_at(offset)
                limit = f"at most {self.longest_sentence}"
                yield Finding(block.path, line, f"sentence of {count} words", words, limit)

    def _opening(self, block: Block) -> Iterator[Finding]:
        first = next((sentence for _, sentence in sentences(block.text)), "")
        words = _words(first)
        if first.rstrip().endswith("?") or (words and words[0].lower() in self.openings):
            begin = " ".join(first.split()[:6])
            yield Finding(block.path, block.line, "opening", begin, "a noun phrase or an imperative")


def load_rules(path: Path = RULES) -> Rules:
    """The rules in the file `path`."""
    content: dict[str, Any] = tomllib.loads(path.read_text(encoding="utf-8"))
    return Rules(
        avoid=[_avoid(rule) for rule in content["avoid"]],
        longest_sentence=content["longest_sentence"],
        sentence_kinds=content["sentence_kinds"],
        openings=frozenset(content["docstring_openings"]),
        paths=content["paths"],
        allow=[Allowed(**exception) for exception in content["allow"]],
    )


def lint(paths: Sequence[Path], rules: Rules) -> list[Finding]:
    """Findings in files and in the Markdown and Python files of folders, by file and line.

    Raises:
        FileNotFoundError: a path does not exist.
    """
    files = sorted({file for path in paths for file in _files(path)})
    found = [finding for file in files for block in blocks(file) for finding in rules.findings(block)]
    return sorted(found, key=lambda finding: (finding.path, finding.line, finding.rule))


def sentences(text: str) -> Iterator[tuple[int, str]]:
    """Each sentence of a paragraph with the offset of its first character."""
    begin = 0
    for match in re.finditer(r"[.!?][\"')]*(?=\s+[^a-z\s])", text):
        if not _ABBREVIATION.search(text[begin : match.start() + 1]):
            yield begin, text[begin : match.end()]
            rest = text[match.end() :]
            begin = match.end() + len(rest) - len(rest.lstrip())
    if text[begin:].strip():
        yield begin, text[begin:]


def _words(sentence: str) -> list[str]:
    return re.findall(rf"{CODE}|[^\W\d_][\w'-]*", sentence)


def _files(path: Path) -> list[Path]:
    if path.is_dir():
        return [*path.rglob("*.md"), *path.rglob("*.py")]
    if not path.exists():
        raise FileNotFoundError(path)
    return [path]


def _avoid(rule: dict[str, Any]) -> Avoid:
    return Avoid(
        name=rule["name"],
        pattern=_phrases(rule["words"]),
        instead=rule["instead"],
        kinds=rule.get("kinds", PROSE_KINDS),
        allowed=_phrases(rule["except"]) if "except" in rule else None,
    )


def _phrases(words: Sequence[str]) -> re.Pattern[str]:
    """Any of the phrases as whole words; a space matches any white space."""
    return re.compile("|".join(rf"\b{phrase}(?!\w)" for phrase in words).replace(" ", r"\s+"), re.IGNORECASE)
