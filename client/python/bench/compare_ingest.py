#!/usr/bin/python3
"""Sends the keyframes of one drive twice, by relmap-frontend (C++) and from Python, to two deterministic daemons, and compares
the maps: frames, landmarks, observations, appearance, edges.

usage: client/python/bench/compare_ingest.py [--pairs N] [--json]     (PYTHONPATH=client/python)

Every pair of the simulated drive becomes a keyframe. Needs ninja -C build/release relmap_python_tests.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import pathlib
import sys
import tempfile
import time
from typing import Any

HERE = pathlib.Path(__file__).resolve().parent
for folder in (HERE.parent, HERE.parent / "notebooks", HERE.parent / "tests"):
    sys.path.insert(0, str(folder))

import conftest  # noqa: E402
import relmap  # noqa: E402

UUID = "7a0c1f52-5f0e-4c7d-9d43-0a8f6b1f2e11"


def hash_of(client: relmap.Client) -> str:
    """A hash of all that the map holds of its first session, as its answers tell it."""
    digest = hashlib.sha256()
    session = client.sessions()[0]
    digest.update(f"{session.uuid} {session.frames} {session.camera} {session.raw}".encode())
    for i in range(session.first, session.last + 1):
        request = relmap.v1.map_pb2.GetFrameRequest(landmarks=True, observations=True, appearance=True, thumbnail=True)
        request.frame.session, request.frame.index = session.number, i
        reply = client._ask(client._map.GetFrame, request, None)
        for edge in reply.frame.edges:
            for event in edge.history:
                event.time_us = 0  # when it came about, which is another time in each map
        digest.update(reply.frame.SerializeToString(deterministic=True))
    return digest.hexdigest()


def make_drive(folder: pathlib.Path, pairs: int) -> None:
    """A drive of so many pairs, round and round a circuit of 60 m (at least 1.3 times), and its keyframes."""
    step = 0.2
    laps = max(pairs * step / 60, 1.3)
    conftest.program("relmap-sim", "pictures", "--out", str(folder / "drive"), "--pairs", str(pairs), "--laps", f"{laps:.3f}")
    conftest.program("relmap-frontend", *arguments(folder), "--out", str(folder / "drive.bin"))


def arguments(folder: pathlib.Path) -> list[str]:
    """Of relmap-frontend, for this drive."""
    options = f"--robot cart --session drive --uuid {UUID} --all-keyframes --quiet"
    return ["--source", "sim", str(folder / "drive"), *options.split()]


def compare(folder: pathlib.Path, pairs: int) -> dict[str, Any]:
    """Makes both maps in this folder; returns their hashes and what it took, seconds."""
    make_drive(folder, pairs)
    result: dict[str, Any] = {"pairs": pairs}
    for how in ("cpp", "python"):
        daemon = conftest.Daemon(folder / how, "--deterministic")
        try:
            begin = time.perf_counter()
            if how == "cpp":
                conftest.program("relmap-frontend", *arguments(folder), "--server", daemon.server, "--spool", "none")
            else:
                send(daemon.server, folder / "drive.bin")
                result["python_s"] = time.perf_counter() - begin
            with relmap.connect(daemon.server, timeout=24 * 3600.0) as client:
                client.wait_idle()
                status = client.status()
                result[f"{how}_hash"] = hash_of(client)
                result["frames"], result["closures"] = status.frames, status.closures_accepted
        finally:
            daemon.stop()
    result["equal"] = result["cpp_hash"] == result["python_hash"]
    return result


def send(server: str, file: pathlib.Path) -> None:
    """Sends a file of keyframes."""
    keyframes = relmap.read_keyframes(file.read_bytes())
    first = next(keyframes)
    h = first.header
    with relmap.connect(server) as client:
        with client.session(h.robot, h.camera, name=h.name, uuid=h.uuid, oneway=h.oneway, raw=h.raw) as session:
            session.add_keyframe(first)
            for keyframe in keyframes:
                session.add_keyframe(keyframe)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pairs", type=int, default=10000)
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        result = compare(pathlib.Path(folder), options.pairs)
    if options.json:
        print(json.dumps(result))
    else:
        print(
            "{frames} frames, {closures} closures: the maps are {what}; sent from Python in {python_s:.1f} s".format(
                what="equal" if result["equal"] else "DIFFERENT", **result
            )
        )
    return 0 if result["equal"] else 1


if __name__ == "__main__":
    sys.exit(main())
