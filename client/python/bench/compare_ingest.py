#!/usr/bin/python3
"""Sends the keyframes of one drive twice, by relmap-frontend (C++) and from Python, to two deterministic daemons, and compares
the maps: frames with their pictures, tracks, landmarks, appearance and edges.

usage: client/python/bench/compare_ingest.py [--keyframes N] [--no-closures] [--folder FOLDER] [--json]

  --keyframes N    default: 10000
  --no-closures    the daemons look for no loop closures, in which most of the time goes
  --folder FOLDER  works there, and does not do again what an interrupted run of as many keyframes has done there

Every pair of a simulated drive becomes a keyframe; all keyframes are written into a file, which both sides read. Needs
ninja -C build/release relmap_python_tests.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import pathlib
import shutil
import sys
import tempfile
import time
from typing import Any, Callable

HERE = pathlib.Path(__file__).resolve().parent
for folder in (HERE.parent, HERE.parent / "notebooks", HERE.parent / "tests"):
    sys.path.insert(0, str(folder))

import conftest  # noqa: E402
import relmap  # noqa: E402

UUID = "7a0c1f52-5f0e-4c7d-9d43-0a8f6b1f2e11"
STEP_M, CIRCUIT_M = 0.2, 400


def hash_of(client: relmap.Client) -> tuple[str, int]:
    """A hash of all that the map holds of its first session, as its answers tell it, and how many observations that is."""
    digest = hashlib.sha256()
    observations = 0
    session = client.sessions()[0]
    digest.update(f"{session.uuid} {session.frames} {session.camera} {session.raw}".encode())
    for i in range(session.first, session.last + 1):
        request = relmap.v1.map_pb2.GetFrameRequest(
            landmarks=True, observations=True, appearance=True, thumbnail=True, picture=True
        )
        request.frame.session, request.frame.index = session.number, i
        reply = client._ask(client._map.GetFrame, request, None)
        for edge in reply.frame.edges:
            for event in edge.history:
                event.time_us = 0  # when it came about, which is another time in each map
        digest.update(reply.frame.SerializeToString(deterministic=True))
        observations += len(reply.frame.observations)
    return digest.hexdigest(), observations


def make_keyframes(folder: pathlib.Path, count: int) -> pathlib.Path:
    """A file of so many keyframes, of a drive round a circuit of at most 400 m, at least 1.3 times."""
    file = folder / "drive.bin"
    laps = max(count * STEP_M / CIRCUIT_M, 1.3)
    if not file.exists():
        if not (folder / "drive/sim.json").exists():
            drive = ["--pairs", str(count), "--laps", f"{laps:.3f}", "--overwrite"]
            conftest.program("relmap-sim", "pictures", "--out", str(folder / "drive"), *drive)
        options = ["--robot", "cart", "--session", "drive", "--uuid", UUID, "--all-keyframes", "--quiet"]
        conftest.program("relmap-frontend", "--source", "sim", str(folder / "drive"), *options, "--out", str(file))
    return file


def send_cpp(server: str, file: pathlib.Path) -> None:
    """Sends a file of keyframes by relmap-frontend."""
    options = ["--robot", "cart", "--session", "drive", "--uuid", UUID, "--spool", "none", "--quiet", "--server", server]
    conftest.program("relmap-frontend", "--source", "sim", str(file), *options)


def send_python(server: str, file: pathlib.Path) -> None:
    """Sends a file of keyframes by the Python client, as arrays."""
    keyframes = relmap.read_keyframes(file)
    first = next(keyframes)
    h = first.header
    with relmap.connect(server) as client:
        with client.session(h.robot, h.camera, name=h.name, uuid=h.uuid, oneway=h.oneway, raw=h.raw) as session:
            session.add_keyframe(first)
            for k in keyframes:
                session.add(
                    k.time_us,
                    k.T_odom_frame,
                    k.step_cov,
                    source=k.source,
                    tracks=k.tracks,
                    features=k.features,
                    picture=k.picture,
                    driven_us=k.driven_us,
                    standing_us=k.standing_us,
                    sequence=k.sequence,
                )


def make_map(folder: pathlib.Path, how: str, file: pathlib.Path, options: list[str]) -> dict[str, Any]:
    """Makes a map of a file of keyframes, and returns its sizes, and the seconds that sending took."""
    shutil.rmtree(folder / how, ignore_errors=True)  # of a run that was interrupted
    daemon = conftest.Daemon(folder / how, "--deterministic", *options)
    try:
        begin = time.perf_counter()
        (send_cpp if how == "cpp" else send_python)(daemon.server, file)
        seconds = time.perf_counter() - begin
        with relmap.connect(daemon.server, timeout=24 * 3600.0) as client:
            client.wait_idle()
            status = client.status()
    finally:
        daemon.stop()
    return {"frames": status.frames, "closures": status.closures_accepted, "seconds": seconds}


def read_map(folder: pathlib.Path, how: str) -> dict[str, Any]:
    """The hash of a map, by a daemon that was started since it was made: so it is of what is stored."""
    daemon = conftest.Daemon(folder / how, "--deterministic")
    try:
        with relmap.connect(daemon.server, timeout=24 * 3600.0) as client:
            digest, observations = hash_of(client)
    finally:
        daemon.stop()
    return {"hash": digest, "observations": observations}


def once(file: pathlib.Path, make: Callable[[], dict[str, Any]]) -> dict[str, Any]:
    """What `make` makes, from the file if it was made before."""
    if not file.exists():
        file.write_text(json.dumps(make()))
    done: dict[str, Any] = json.loads(file.read_text())
    return done


def compare(folder: pathlib.Path, count: int, *options: str) -> dict[str, Any]:
    """Makes both maps in this folder, by daemons with these options, and compares them."""
    file = make_keyframes(folder, count)
    result: dict[str, Any] = {}
    for how in ("cpp", "python"):
        made = once(folder / f"{how}.made.json", lambda: make_map(folder, how, file, list(options)))
        result[how] = made | once(folder / f"{how}.read.json", lambda: read_map(folder, how))
    result["equal"] = result["cpp"]["hash"] == result["python"]["hash"]
    return result


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--keyframes", type=int, default=10000)
    parser.add_argument("--no-closures", action="store_true")
    parser.add_argument("--folder", type=pathlib.Path)
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        folder = options.folder or pathlib.Path(temporary)
        folder.mkdir(parents=True, exist_ok=True)
        result = compare(folder, options.keyframes, *(["--no-closures"] if options.no_closures else []))
    if options.json:
        print(json.dumps(result))
    else:
        for how in ("cpp", "python"):
            text = "{how:7} {frames} frames, {observations} observations, {closures} closures; sent in {seconds:.1f} s; {hash}"
            print(text.format(how=how, **result[how]))
        print("equal" if result["equal"] else "DIFFERENT")
    return 0 if result["equal"] else 1


if __name__ == "__main__":
    sys.exit(main())
