"""What docs/python.md and the README show works: all their code runs, in order, against a daemon."""

from __future__ import annotations

import datetime
import pathlib
import re
from typing import Any, Iterator, List

import points_world
import pytest
import relmap
from conftest import PATIENCE_S, PYTHON, SOURCE, Daemon, ingest


def _blocks(text: str) -> List[str]:
    return re.findall(r"^```python\n(.*?)^```$", text, flags=re.DOTALL | re.MULTILINE)


@pytest.fixture(scope="module")
def documented(
    keyframe_files: List[pathlib.Path], tmp_path_factory: pytest.TempPathFactory
) -> Iterator[tuple[Daemon, pathlib.Path]]:
    """A daemon with a drive of pictures as session 1 and drives through points; and a folder with pictures."""
    folder = tmp_path_factory.mktemp("documented")
    running = Daemon(folder / "map", "--backup-root", str(folder))
    keyframes = list(relmap.read_keyframes(keyframe_files[1]))
    header = keyframes[0].header
    with relmap.connect(running.server, timeout=PATIENCE_S) as client:
        with client.session(header.robot, header.camera, name=header.name, uuid=header.uuid, raw=header.raw) as session:
            for keyframe in keyframes:
                session.add_keyframe(keyframe)
        client.wait_idle()
        ingest(client, "two", 80)
        ingest(client, "three", 40, start=20)
    drive = keyframe_files[1].with_suffix("")
    pictures = (("left.png", "image_0/000012"), ("right.png", "image_1/000012"), ("photo.jpg", "image_0/000008"))
    for name, source in (*pictures, ("a.png", "image_0/000004"), ("b.png", "image_0/000016")):
        (folder / name).write_bytes((drive / f"{source}.png").read_bytes())
    yield running, folder
    running.stop()


# What is of another machine in the text.
REPLACED = (
    (r'(?m)^client = relmap\.connect\(.*$', "client = relmap.connect(SERVER)"),
    (r'"/var/lib/relmap/map"', "SERVER"),
    (r"camera=1\)      # pictures.*", "camera=1)"),
    (r'"/var/lib/relmap/backups/today"', "BACKUP"),
    (r"(?<!async )for event in client\.watch\(\):", "for event in itertools.islice(client.watch(oldest=True), 6):"),
    (r"async for event in client\.watch\(\):", "async for event in client.watch():  # noqa\n            break"),
    (r'"1:45"', '"2:45"'),
    (r'"3:120", "2:45", dry_run=True', '"3:30", "2:10", accept=False, dry_run=True'),
    (r'"1:45", "charging', '"2:45", "charging'),
    (r"FrameId\(2, 8\)", "FrameId(2, 30)"),
    (r"client\.localise\(picture\) ", "client.localise(picture, camera=1) "),
    (r'by="time"', 'by="time", or_from=["2:30"]'),
    (r"place\.frame, \"charging", '"2:12", "charging'),
    (r'Robot\("cart"\)', 'Robot("cart")'),
)


def test_the_documented_code_runs(documented: tuple[Daemon, pathlib.Path], monkeypatch: pytest.MonkeyPatch) -> None:
    running, folder = documented
    monkeypatch.chdir(folder)
    step = list(points_world.drive(3, start=700))
    import itertools

    names: dict[str, Any] = dict(
        relmap=relmap, SERVER=running.server, BACKUP=str(folder / "backup"), itertools=itertools, datetime=datetime,
        picture=(folder / "left.png").read_bytes(),
        drive=[(s.time, s.T_odom_frame, s.step_cov, s.tracks, s.features, b"") for s in step],
    )  # fmt: skip
    count = 0
    for text in ((SOURCE / "docs/python.md").read_text(), (PYTHON / "README.md").read_text()):
        for block in _blocks(text):
            for pattern, replacement in REPLACED:
                block = re.sub(pattern, replacement, block)
            try:
                exec(compile(block, f"block {count}", "exec"), names)
            except relmap.PlaceNotRecognised as error:
                assert "propose" in block, error  # geometry may not confirm these two
            count += 1
            if "client" in names and isinstance(names["client"], relmap.Client) and "with relmap.connect" in block:
                names["client"] = relmap.connect(running.server)
    assert count >= 10


def test_every_exception_and_kind_of_pose_is_documented() -> None:
    text = (SOURCE / "docs/python.md").read_text()
    for kind in relmap.PoseKind:
        assert f"`{kind.value}`" in text
    for name in relmap.__all__:
        value = getattr(relmap, name)
        if isinstance(value, type) and issubclass(value, relmap.RelmapError):
            assert name in text, name


def test_every_document_of_the_client_is_found() -> None:
    assert "(python.md)" in (SOURCE / "docs/README.md").read_text()
    assert "docs/python.md" in (SOURCE / "README.md").read_text()
