from __future__ import annotations

import hashlib
from pathlib import Path

import cv2
import numpy as np
import pytest

from workbench.model.arrays import Image
from workbench.model.errors import BadInputError, StoppedError
from workbench.model.event import SessionFinished, SessionStarted, StepStarted
from workbench.session.files import write_atomically
from workbench.session.frames import FrameStore, read_image
from workbench.session.journal import JOURNAL, Journal, read_journal

STARTED = SessionStarted(session="s", rig="r", procedures=("p",))
STEP = StepStarted(procedure="p", index=1, step="fit", title="Fit", shots=0)


def test_what_is_journalled_is_read(tmp_path: Path) -> None:
    with Journal(tmp_path) as journal:
        written = [journal.append(event) for event in (STARTED, STEP)]
    assert list(read_journal(tmp_path)) == written
    assert [record.n for record in written] == [0, 1]


def test_a_torn_tail_is_dropped(tmp_path: Path) -> None:
    with Journal(tmp_path) as journal:
        first = journal.append(STARTED)
        journal.append(STEP)
    path = tmp_path / JOURNAL
    whole = path.read_bytes()
    for cut in range(len(whole.splitlines(keepends=True)[0]), len(whole)):
        path.write_bytes(whole[:cut])
        assert list(read_journal(tmp_path)) == [first]


def test_a_damaged_line_is_named(tmp_path: Path) -> None:
    with Journal(tmp_path) as journal:
        for event in (STARTED, STEP, SessionFinished(exit_code=0, message="done")):
            journal.append(event)
    path = tmp_path / JOURNAL
    path.write_bytes(path.read_bytes().replace(b'"index":1', b'"index":"x"'))
    with pytest.raises(BadInputError, match=r"journal\.jsonl:2: "):
        list(read_journal(tmp_path))


def test_a_journal_is_never_written_over(tmp_path: Path) -> None:
    Journal(tmp_path).close()
    with pytest.raises(FileExistsError):
        Journal(tmp_path)


def test_a_full_disk_stops_the_session_by_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with Journal(tmp_path) as journal:
        journal.append(STARTED)

        def no_space(handle: int, data: bytes) -> int:
            raise OSError(28, "No space left on device")

        with monkeypatch.context() as patch:
            patch.setattr("workbench.session.journal.os.write", no_space)
            with pytest.raises(StoppedError, match="No space left"):
                journal.append(STEP)
    assert [r.event for r in read_journal(tmp_path)] == [STARTED]


def test_no_journal(tmp_path: Path) -> None:
    with pytest.raises(BadInputError, match="expected a session's journal"):
        list(read_journal(tmp_path))


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_frames_are_lossless_and_their_hash_is_the_file_s(tmp_path: Path, dtype: type) -> None:
    noise = np.random.default_rng(0).integers(0, np.iinfo(dtype).max, (48, 64))
    image: Image = noise.astype(np.uint8) if dtype is np.uint8 else noise.astype(np.uint16)
    ref = FrameStore(tmp_path).save("p.1/500mm/L1/00", "on", image, 17)
    content = (tmp_path / ref.path).read_bytes()
    assert hashlib.sha256(content).hexdigest() == ref.sha256
    read = read_image(tmp_path / ref.path, (64, 48))
    assert read.dtype == dtype
    np.testing.assert_array_equal(read, image)


def test_a_full_disk_leaves_no_half_frame(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def no_space(handle: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("workbench.session.files.os.fsync", no_space)
    with pytest.raises(StoppedError, match=r"00-on\.png.*No space left"):
        FrameStore(tmp_path).save("p/00", "on", np.zeros((4, 4), np.uint8), 0)
    assert list((tmp_path / "frames/p").iterdir()) == []


def image_file(path: Path, extension: str = ".png") -> bytes:
    image = np.random.default_rng(0).integers(0, 256, (48, 64), dtype=np.uint8)
    content = cv2.imencode(extension, image)[1].tobytes()
    path.write_bytes(content)
    return content


@pytest.mark.parametrize("extension", [".png", ".jpg"])
@pytest.mark.parametrize("part", [0.0, 0.1, 0.5, 0.95])
def test_a_truncated_image_is_named(tmp_path: Path, extension: str, part: float) -> None:
    path = tmp_path / f"a{extension}"
    content = image_file(path, extension)
    path.write_bytes(content[: int(part * len(content))])
    with pytest.raises(BadInputError, match=str(path)):
        read_image(path)


def test_a_missing_image_is_named(tmp_path: Path) -> None:
    with pytest.raises(BadInputError, match=r"no\.png: expected an image"):
        read_image(tmp_path / "no.png")


def test_something_else_than_an_image_is_named(tmp_path: Path) -> None:
    (tmp_path / "a.png").write_text("laser_id,standoff_mm\n")
    with pytest.raises(BadInputError, match=r"a\.png: expected an image"):
        read_image(tmp_path / "a.png")


def test_an_image_of_another_size_is_named(tmp_path: Path) -> None:
    image_file(tmp_path / "a.png")
    with pytest.raises(BadInputError, match=r"a\.png: expected an image of 640 x 480 pixels, got 64 x 48"):
        read_image(tmp_path / "a.png", (640, 480))


def test_a_colour_image_becomes_grey(tmp_path: Path) -> None:
    path = tmp_path / "a.png"
    cv2.imwrite(str(path), np.full((4, 5, 3), 90, np.uint8))
    assert read_image(path).tolist() == [[90] * 5] * 4


def test_an_interrupted_write_leaves_the_old_content(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a"
    write_atomically(path, b"old")

    def pulled(self: Path, target: Path) -> Path:
        raise KeyboardInterrupt

    monkeypatch.setattr(Path, "replace", pulled)
    with pytest.raises(KeyboardInterrupt):
        write_atomically(path, b"new")
    assert {p.name: p.read_bytes() for p in tmp_path.iterdir()} == {"a": b"old"}
