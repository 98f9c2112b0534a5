"""Work that frees the interpreter lock, done by threads a little ahead of where its results are wanted."""

from __future__ import annotations

import itertools
import os
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

_Item = TypeVar("_Item")
_Result = TypeVar("_Result")
_THREADS = max(1, min(8, os.cpu_count() or 1))


def map_ahead(function: Callable[[_Item], _Result], items: Iterable[_Item], *, ahead: int = 16) -> Iterator[_Result]:
    """Give ``function`` of every item in order; at most ``ahead`` results wait, and ``items`` is taken as needed.

    Examples
    --------
    >>> list(map_ahead(abs, [-1, 2, -3]))
    [1, 2, 3]
    """
    source = iter(items)
    with ThreadPoolExecutor(_THREADS) as pool:
        waiting = deque(pool.submit(function, item) for item in itertools.islice(source, ahead))
        try:
            while waiting:
                result = waiting.popleft().result()
                waiting.extend(pool.submit(function, item) for item in itertools.islice(source, 1))
                yield result
        finally:
            pool.shutdown(cancel_futures=True)
