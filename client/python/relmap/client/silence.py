"""Streams that fall silent, for the blocking client: see relmap/aio/silence.py."""

from __future__ import annotations

import threading
import time
from typing import Any, Optional

import grpc

from relmap.errors import silent


class _Watchdog:
    """Cancels a call when a reply has been waited for too long; a thread, since a reply of gRPC cannot be waited for with a
    limit."""

    def __init__(self, call: Any, silence: float) -> None:
        self.since: Optional[float] = None  # when the wait for a reply began; None: nobody waits
        self.bit = False
        self._call, self._silence = call, silence
        self._over = threading.Event()
        threading.Thread(target=self._run, name="relmap silence", daemon=True).start()

    def stop(self) -> None:
        self._over.set()

    def _run(self) -> None:
        pause = self._silence
        while not self._over.wait(pause):
            since = self.since
            pause = self._silence / 8 if since is None else since + self._silence - time.monotonic()
            if pause <= 0:
                self.bit = True
                self._call.cancel()
                return


class Heard:
    """The replies of a call. Unreachable: none came for a while. Only the time waited for one counts."""

    def __init__(self, call: Any, silence: float) -> None:
        self._call, self._silence = call, silence
        self._dog = _Watchdog(call, silence)

    def __iter__(self) -> "Heard":
        return self

    def __next__(self) -> Any:
        self._dog.since = time.monotonic()
        try:
            reply = next(self._call)
        except BaseException as error:
            self._dog.stop()
            if self._dog.bit and isinstance(error, grpc.RpcError):
                raise silent(self._silence) from None
            raise
        self._dog.since = None
        return reply

    def __del__(self) -> None:
        self._dog.stop()


__all__ = ["Heard"]
