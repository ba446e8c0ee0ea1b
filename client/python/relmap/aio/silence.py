"""Streams that fall silent: a connection that is cut, or a daemon that is stopped, is noticed by nothing else."""

from __future__ import annotations

import asyncio
from typing import Any

from relmap.errors import silent


class Heard:
    """The replies of a call, asynchronous. Unreachable: none came for a while. Only the time waited for one counts."""

    def __init__(self, call: Any, silence: float) -> None:
        self._replies = call.__aiter__()
        self._silence = silence

    def __aiter__(self) -> "Heard":
        return self

    async def __anext__(self) -> Any:
        try:
            return await asyncio.wait_for(self._replies.__anext__(), self._silence)
        except asyncio.TimeoutError:
            raise silent(self._silence) from None


__all__ = ["Heard"]
