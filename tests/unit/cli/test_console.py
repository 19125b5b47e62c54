"""One message on standard error, wrapped for a terminal."""

from __future__ import annotations

import warnings

import pytest

from workbench.cli.console import columns, print_message, print_warnings_as_notes, wrapped

PATH = "/a/very/long/path/without-any-space/" + "x" * 60


@pytest.mark.parametrize("width", [20, 40, 80])
def test_lines_are_wrapped_between_words_and_indented_as_they_are(width: int) -> None:
    text = "one\n    " + "word " * 30 + "end"
    lines = wrapped(text, width).splitlines()
    assert max(map(len, lines)) <= width
    assert all(line.startswith("    ") for line in lines[1:])
    assert " ".join(wrapped(text, width).split()) == " ".join(text.split())


def test_a_path_is_never_broken() -> None:
    assert PATH in wrapped(f"error: {PATH} is not there", 40).splitlines()


def test_where_no_terminal_is_a_message_stays_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    print_message("error: " + "word " * 60)
    captured = capsys.readouterr()
    assert captured.out == ""
    assert len(captured.err.splitlines()) == 1


def test_the_environment_states_the_width(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "57")
    assert columns() == 57


def test_a_warning_is_one_line_without_its_place_in_the_code(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(warnings, "showwarning", warnings.showwarning)
    print_warnings_as_notes()
    with warnings.catch_warnings():
        warnings.simplefilter("always")
        warnings.warn("slow", stacklevel=1)
    assert capsys.readouterr().err == "note: slow\n"
