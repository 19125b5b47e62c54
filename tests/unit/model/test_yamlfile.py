"""YAML files read into models: errors by file, line and key; what is no such file."""

from __future__ import annotations

from pathlib import Path

import pytest

from workbench.model.errors import BadInputError
from workbench.model.rig import load_rig
from workbench.model.yamlfile import load_yaml_model, parse_document
from workbench.procedure.engine.procedure_file import load_procedure
from workbench.session.manifest import Manifest

RIG = """\
format: 1
rig: r
camera:
  width_px: 640
  height_px: 480
  f_px: {value: 500.0, sd: 25.0}
  cx_px: {value: 319.5, sd: 40.0}
  cy_px: {value: 239.5, sd: 40.0}
lasers:
  - id: 1
    axis: u
    x_mm: {value: 30.0, sd: 0.2}
    y_mm: {value: 0.0, sd: 0.2}
"""


def rig_error(tmp_path: Path, old: str, new: str) -> str:
    path = tmp_path / "rig.yaml"
    text = RIG.replace(old, new)
    assert text != RIG
    path.write_text(text)
    with pytest.raises(BadInputError) as caught:
        load_rig(path)
    return str(caught.value).replace(str(path), "rig.yaml")


def test_a_rig_is_read(tmp_path: Path) -> None:
    path = tmp_path / "rig.yaml"
    path.write_text(RIG)
    rig = load_rig(path)
    assert rig.laser_ids == ("1",)  # an id is a name, whatever YAML thinks of it
    assert rig.camera.f_px.value == 500.0
    assert rig.bench.offset_mm.sd == 0.0  # not stated: known exactly


@pytest.mark.parametrize(
    ("old", "new", "line", "words"),
    [
        ("sd: 25.0", "sd: -1", 6, ["camera.f_px.sd", "expected 0 to 1000000", "got -1"]),
        ("sd: 25.0", "sd: wide", 6, ["camera.f_px.sd", "expected a number", "got 'wide'"]),
        ("  height_px: 480\n", "  height_px: 480\n  hue: 1\n", 6, ["camera.hue", "no such key"]),
        ("  width_px: 640\n", "", 3, ["camera.width_px", "is missing"]),
        ("axis: u", "axis: x", 11, ["lasers[0].axis", "'u' or 'v'", "got 'x'"]),
        ("x_mm: {value: 30.0", "x_mm: {value: 0.0", 10, ["lasers[0]", "needs a baseline"]),
        ("format: 1", "format: 2", 1, ["format", "got 2"]),
        ("rig: r", "rig: [", 4, ["not valid YAML"]),
        ("value: 500.0", "value: .nan", 6, ["camera.f_px.value", "finite"]),
    ],
)
def test_errors_name_file_line_key_and_both_values(
    tmp_path: Path, old: str, new: str, line: int, words: list[str]
) -> None:
    message = rig_error(tmp_path, old, new)
    first = message.splitlines()[0]
    assert first.startswith(f"rig.yaml:{line}: ")
    for word in words:
        assert word in first


def test_every_problem_is_listed(tmp_path: Path) -> None:
    message = rig_error(tmp_path, "sd: 40.0", "sd: -40.0")
    assert [line.split(": ")[0] for line in message.splitlines()] == ["rig.yaml:7", "rig.yaml:8"]


def test_two_lasers_with_one_id_are_refused(tmp_path: Path) -> None:
    laser = RIG[RIG.index("  - id: 1") :]
    assert rig_error(tmp_path, laser, laser + laser).startswith("rig.yaml:9: lasers: ")


@pytest.mark.parametrize("content", [None, b"", b"\xff\xfe\x00", b"- 1\n- 2\n", b"a: 1\na: 2\n"])
def test_what_is_no_rig_at_all(tmp_path: Path, content: bytes | None) -> None:
    path = tmp_path / "rig.yaml"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(BadInputError, match=r"rig\.yaml"):
        load_rig(path)


@pytest.mark.parametrize("content", ["format: 1\nprocedure: p\nsteps: []\n", "- 1\n", "a: 1\n"])
def test_a_file_of_another_kind_is_one_mistake(tmp_path: Path, content: str) -> None:
    path = tmp_path / "rig.yaml"
    path.write_text(content)
    with pytest.raises(BadInputError) as caught:
        load_rig(path)
    (line,) = str(caught.value).splitlines()
    assert line.startswith(f"{path}:1: ")


def test_tags_that_build_objects_stay_text(tmp_path: Path) -> None:
    path = tmp_path / "rig.yaml"
    path.write_text("!!python/object/apply:os.system ['touch " + str(tmp_path / "owned") + "']\n")
    with pytest.raises(BadInputError):
        load_rig(path)
    assert not (tmp_path / "owned").exists()


def test_every_wrong_step_is_reported_with_its_line(tmp_path: Path) -> None:
    path = tmp_path / "p.yaml"
    path.write_text(
        "format: 1\nprocedure: p\ntitle: t\nsteps:\n  - step: capture_grid\n    standoffs_mm: [500, 500]\n"
        "    repeats: 10\n  - step: dance\n"
    )
    with pytest.raises(BadInputError) as caught:
        load_procedure(path)
    lines = str(caught.value).splitlines()
    assert lines[0].startswith(f"{path}:5: steps[0]: ")
    assert lines[1].startswith(f"{path}:8: steps[1].step: ")
    assert "measure_latency" in lines[1]
    assert "dance" in lines[1]


@pytest.mark.parametrize(
    ("content", "what"),
    [
        (b"\x89PNG\r\n\x1a\n\0\0", "a PNG image"),
        (b"PK\x03\x04\x14\0\x9d", "a zip archive or a spreadsheet"),
        (b"\xff\xfea\0", "text in UTF-16; save it as UTF-8"),
        (b"a: 1\nb: caf\xe9\n", r"text in another encoding \(line 2\); save it as UTF-8"),
        (b"a: 1\0", "binary data"),
    ],
)
def test_what_is_no_text_is_called_what_it_is(content: bytes, what: str, tmp_path: Path) -> None:
    path = tmp_path / "f.yaml"
    path.write_bytes(content)
    with pytest.raises(BadInputError, match=rf"f\.yaml: .*got {what}"):
        load_yaml_model(path, Manifest)


def test_duplicate_keys_are_found_with_their_lines() -> None:
    document = parse_document("a:\n  b: 1\n  c: 2\n  b: 3\na: 4\n", Path("f.yaml"))
    assert [(one.line, one.text.split(":")[0]) for one in document.doubled] == [(4, "b"), (5, "a")]
    assert document.data["a"]["b"] == 1


LAUGHS = "a: &a [x, x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"{name}: &{name} [{', '.join([f'*{before}'] * 10)}]\n"
    for before, name in zip("abcdefgh", "bcdefghi", strict=True)
)


@pytest.mark.parametrize(
    ("text", "line"),
    [
        *((f"a: 1\nb: {value}\n", 2) for value in ("!!bool x", "!!int _", "!!set x", "!!omap x", "!x y")),
        ("a: !!str 01\n", 1),
        ("a: !<tag:yaml.org,2002:bool> x\n", 1),
        ("a: !<tag:yaml.org,2002:set> x\n", 1),
        ("a: !<foo> {b: 1}\n", 1),
        ("%TAG ! tag:x,2000:\n---\na: !bool x\n", 3),
        ("a: 1\n? [[a]]\n: 2\n", 2),
        ("a: 1\n? {b: 1}\n: 2\n", 2),
        ("a: &a [1, *a]\n", 1),
        ("a: &a {b: {c: *a}}\n", 1),
        (LAUGHS, 6),
    ],
)
def test_only_plain_values_are_accepted(text: str, line: int) -> None:
    with pytest.raises(BadInputError, match=f"^f.yaml:{line}: "):
        parse_document(text, Path("f.yaml"))


def test_aliases_and_merged_keys_are_read() -> None:
    data = parse_document("a: &a {x: 1, y: 2}\nb: *a\nc: {<<: *a, y: 3}\n", Path("f.yaml")).data
    assert data["b"] == {"x": 1, "y": 2}
    assert {key: data["c"][key] for key in ("x", "y")} == {"x": 1, "y": 3}


def test_control_characters_in_text_are_shown() -> None:
    data = parse_document('"k\\e": "T\\e[31m\\a"\n', Path("f.yaml")).data
    assert dict(data) == {"k\\x1b": "T\\x1b[31m\\x07"}
