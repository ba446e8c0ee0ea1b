"""Keeps a stream of keyframes open, for the blocking client, in a thread of its own: see relmap/aio/line.py."""

from __future__ import annotations

import atexit
import threading
import time as clock
import weakref
from types import TracebackType
from typing import Any, Iterator, Optional, Type

import grpc

from relmap.connection import Stubs
from relmap.errors import DeadlineExceeded, RelmapError, error_of, error_of_rpc
from relmap.ingest_session import TICK_S, IngestState
from relmap.reason import Reason
from relmap.v1 import ingest_pb2


AT_EXIT_S = 5.0
"""Seconds for which a program that ends without having closed a session waits for the daemon's disk."""

_open_lines: "weakref.WeakSet[Line]" = weakref.WeakSet()


class Line:
    """Sends what an ingest session wants to be sent, and takes in what the daemon says; opens another stream when one breaks.

    Its context is the lock that guards the state; changed() and wait() are called while it is held.

    Attributes:
        adding: held by who adds to the session, so that keyframes keep their order.
    """

    def __init__(self, state: IngestState) -> None:
        self.adding = threading.Lock()
        self._state = state
        self._changed = threading.Condition()
        self._thread: Optional[threading.Thread] = None
        self._stopping = False

    def __enter__(self) -> "Line":
        self._changed.acquire()
        return self

    def __exit__(
        self, kind: Optional[Type[BaseException]], error: Optional[BaseException], trace: Optional[TracebackType]
    ) -> None:
        self._changed.release()

    @property
    def is_open(self) -> bool:
        """Whether open() was called."""
        return self._thread is not None

    @property
    def is_closed(self) -> bool:
        """Whether close() was called."""
        return self._stopping

    def open(self) -> None:
        """Begins to stream."""
        self._thread = threading.Thread(target=self._run, name="relmap ingest", daemon=True)
        self._thread.start()
        _open_lines.add(self)

    def close(self) -> None:
        """Ends the stream at once."""
        with self._changed:
            self._stopping = True
            self._changed.notify_all()
        if self._thread is not None:
            self._thread.join()

    def finish(self) -> None:
        """At the end of the program, which should have closed the session: waits for the daemon's disk, but not for long, and
        warns if that was not enough."""
        core = self._state.core
        until = clock.monotonic() + AT_EXIT_S
        try:
            with self:
                while not core.all_settled and not self._stopping:
                    self.wait(until)
        except RelmapError:
            pass
        self._state.warn_of_loss()
        self.close()  # while the threads of gRPC still run

    def check(self) -> None:
        """Raises why the session cannot go on: RelmapError; ValueError: it is not open."""
        self._state.check(self.is_open, self._stopping)

    def changed(self) -> None:
        """There is something to send."""
        self._changed.notify_all()

    def wait(self, until: Optional[float]) -> None:
        """Waits for the daemon's next message, not for long. DeadlineExceeded: it is later than `until`, of the monotonic
        clock; else raises as check()."""
        if until is not None and clock.monotonic() >= until:
            raise DeadlineExceeded(Reason.DEADLINE, "the daemon has not everything on disk yet")
        self._changed.wait(TICK_S)
        self.check()

    def _run(self) -> None:
        while not self._stopping:
            error = self._talk()
            with self._changed:
                if self._stopping:
                    return
                pause = self._state.broken(error)
                self._changed.notify_all()
                if self._state.failure is not None:
                    return
                self._changed.wait_for(lambda: self._stopping, pause)

    def _talk(self) -> RelmapError:
        """Runs one stream until it ends, and returns why it did."""
        try:
            where = self._state.connection.resolve()
            channel = self._state.connection.open(where)
        except RelmapError as error:
            return error
        over = threading.Event()
        try:
            call = Stubs(channel).ingest.Stream(self._requests(over), metadata=self._state.connection.metadata)
            watch = threading.Thread(target=self._watch, args=(call, over), daemon=True)
            watch.start()
            for reply in call:
                with self._changed:
                    self._state.receive(where, reply)
                    self._changed.notify_all()
            return error_of(Reason.UNREACHABLE, "the daemon has ended the stream")
        except grpc.RpcError as error:
            return error_of_rpc(error)
        except RelmapError as error:
            return error
        except Exception as error:  # so that who waits learns of it
            return error_of(Reason.INTERNAL, f"{type(error).__name__}: {error}")
        finally:
            over.set()
            with self._changed:
                self._changed.notify_all()
            channel.close()

    def _requests(self, over: threading.Event) -> Iterator[ingest_pb2.IngestRequest]:
        """What is sent on one stream; a thread of gRPC asks for it."""
        with self._changed:
            hello = self._state.hello()
        yield hello
        while True:
            with self._changed:
                if self._stopping or over.is_set():
                    return
                requests = self._state.outgoing()
                if not requests:
                    self._changed.wait(TICK_S)
            for request in requests:
                yield request

    def _watch(self, call: Any, over: threading.Event) -> None:
        """Ends a stream that is silent, or no longer wanted."""
        while not over.wait(TICK_S):
            with self._changed:
                if self._stopping or self._state.is_silent:
                    break
        call.cancel()


@atexit.register
def _finish_all() -> None:
    for line in tuple(_open_lines):
        if not line.is_closed:
            line.finish()


__all__ = ["Line"]
