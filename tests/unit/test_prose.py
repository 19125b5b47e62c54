"""The prose linter finds what its rules name, where it stands, and passes plain text."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from tests.prose.lint import Finding, Rules, lint, load_rules, sentences

EXAMPLES = {
    "tell": ("The file is told to the user.", "The file name is printed."),
    "whoever": ("Whoever stands at the bench answers.", "The operator answers."),
    "whatever": ("Whatever the camera sends is kept.", "Every frame is kept."),
    "of it": ("The sign of it.", "The sign of its derivative, of item 3."),
    "so many": ("Wait for so many frames.", "Wait for this number of frames."),
    "as is said": ("The rig file says so.", "The rig file states the sd."),
    "known apart": ("They cannot be\nknown apart.", "They are not determined separately."),
    "archaic": ("The exposure is set anew.", "The exposure is set again."),
    "go on": ("The session goes on.", "The session continues."),
    "put": ("The guardian puts the lasers off.", "The guardian turns the lasers off."),
    "shot": ("The last shot is repeated.", "Shot noise and read noise."),
    "placing": ("Repeats at one placing.", "Placing the target takes 20 s."),
    "lit": ("All lasers are lit.", "The target is evenly lit."),
    "sighting": ("Sightings of a laser.", "Observations of a laser."),
    "deal": ("Spots are dealt to lasers.", "Spots are assigned to lasers."),
    "promise": ("The promised deviation.", "The expanded uncertainty."),
    "metaphor": ("Crowded spots.", "Overlapping spots."),
}
RULES = load_rules()


@pytest.mark.parametrize("name", EXAMPLES)
def test_each_rule_finds_its_example_and_passes_the_plain_one(name: str, tmp_path: Path) -> None:
    dialect, plain = EXAMPLES[name]
    assert [item.rule for item in _in_markdown(tmp_path, dialect)] == [name]
    assert not _in_markdown(tmp_path, plain)


def test_every_rule_for_prose_has_an_example() -> None:
    assert {rule.name for rule in RULES.avoid if "markdown" in rule.kinds} == set(EXAMPLES)


def test_a_sentence_of_thirty_one_words_is_found_and_one_of_thirty_passes(tmp_path: Path) -> None:
    assert RULES.longest_sentence == 30
    assert not _in_markdown(tmp_path, "Word " * 29 + "word. Another sentence.")
    (found,) = _in_markdown(tmp_path, "Short one.\nWord " + "word " * 29 + "word.")
    assert (found.line, found.rule) == (2, "sentence of 31 words")


def test_sentences_end_at_stops_but_not_at_abbreviations() -> None:
    text = "D. L. Tran wrote it, e.g. Fig. 3. Then came 2.5 mm. Next one!"
    assert [sentence for _, sentence in sentences(text)] == [
        "D. L. Tran wrote it, e.g. Fig. 3.",
        "Then came 2.5 mm.",
        "Next one!",
    ]


def test_code_links_and_fences_are_not_prose(tmp_path: Path) -> None:
    text = "Call `told` as in [this page](https://told/it).\n\n```\ntold\n```\n\n    told = 1\n\nPlain.\n"
    assert not _in_markdown(tmp_path, text)


def test_findings_name_the_line(tmp_path: Path) -> None:
    text = (
        "# Title\n\nFine text.\n\n- item\n- what is\n  told here\n\n| a | b |\n|---|---|\n| x | it tells |\n"
    )
    assert [item.line for item in _in_markdown(tmp_path, text)] == [7, 11]


@pytest.mark.parametrize(
    ("code", "line", "rule"),
    [
        ('"""What a module holds."""\n', 1, "opening"),
        ('"""Is it sound?"""\n', 1, "opening"),
        ('"""Sound module.\n\nNothing is told here.\n"""\n', 3, "tell"),
        ('"""Module."""\n\n\ndef f() -> None:\n    """How fast."""\n', 5, "opening"),
        ('"""Module."""\n\nx = 1\n"""Which one."""\n', 4, "opening"),
        ('"""Module."""\n\n# A comment of\n# two lines is told.\nx = 1\n', 4, "tell"),
        ('"""Module."""\n\nx = 1  # told\n', 3, "tell"),
        ('"""Module."""\n\nraise ValueError(f"the file {1} tells nothing")\n', 3, "tell"),
        ('"""Module."""\n\nx = ("a message that is "\n     "told in two parts")\n', 3, "tell"),
        ('"""Module."""\n\ntold_by = 1\n', 3, "name in dialect"),
        ('"""Module."""\n\n\nclass Untold:\n    """An ambiguous case."""\n', 4, "name in dialect"),
        ('"""' + "word " * 31 + '."""\n', 1, "sentence of 31 words"),
    ],
)
def test_prose_of_python_is_linted(tmp_path: Path, code: str, line: int, rule: str) -> None:
    assert [(item.line, item.rule) for item in _in_python(tmp_path, code)] == [(line, rule)]


@pytest.mark.parametrize(
    "code",
    [
        '"""Spots of a frame."""\n',
        '"""Whether the camera can set its exposure."""\n',
        '"""Module.\n\n    told = formula\n"""\n',
        '"""Module.\n\n>>> who = told\ntold\n"""\n',
        '"""Module."""\n\nkey = "told"\n',
        '"""Module."""\n\nkey = told.by\n',
        '"""Module."""\n\ncount = "it took %d captures"\n',
    ],
)
def test_keys_formulas_and_plain_docstrings_pass(tmp_path: Path, code: str) -> None:
    assert not _in_python(tmp_path, code)


def test_a_missing_path_is_an_error() -> None:
    with pytest.raises(FileNotFoundError):
        lint([Path("no/such/folder")], RULES)


def test_each_exception_is_found_without_it_and_passes_in_its_file_only(tmp_path: Path) -> None:
    strict = replace(RULES, allow=())
    for allowed in RULES.allow:
        path = Path(__file__).parents[2] / allowed.path
        assert allowed.words in [item.words for item in lint([path], strict)]
        assert allowed.words not in [item.words for item in lint([path], RULES)]
        copy = tmp_path / path.name
        copy.write_text(path.read_text())
        assert allowed.words in [item.words for item in lint([copy], RULES)]


def _in_markdown(folder: Path, text: str) -> list[Finding]:
    return _found(folder / "page.md", text, RULES)


def _in_python(folder: Path, text: str) -> list[Finding]:
    return _found(folder / "module.py", text, RULES)


def _found(path: Path, text: str, rules: Rules) -> list[Finding]:
    path.write_text(text)
    return lint([path], rules)
