"""Damages files as disks, mails and editors do, and says what became of reading them."""

import random
import time

from pegbar import FormatError
from pegbar.io.recording_file import read_recording

SPOILED = (b"nan", b"inf", b"-inf", b"1e400", b"", b"-", b"1e9", b"0", b"{", b"1,5", b"\xff")


def cuts(data, parts=50):
    """The file cut at every part of its length."""
    return [data[: len(data) * part // parts] for part in range(parts)]


def flips(data, chance, count):
    """The file with one to eight bytes of other values, half of the times near its beginning, where the counts are."""
    for turn in range(count):
        copy = bytearray(data)
        for _ in range(chance.randint(1, 8)):
            place = chance.randrange(len(copy) if turn % 2 else min(len(copy), 4096))
            copy[place] = chance.randrange(256)
        yield bytes(copy)


def spoiled_words(data, chance, count):
    """The text with one word replaced by what is no number, or another one."""
    for _ in range(count):
        place = chance.randrange(len(data))
        start = max(data.rfind(white, 0, place) for white in (b" ", b"\n", b"\t")) + 1
        ends = [end for white in (b" ", b"\n", b"\t", b"\r") if (end := data.find(white, place)) >= 0]
        yield data[:start] + chance.choice(SPOILED) + data[min(ends, default=len(data)) :]


def swapped_pieces(data, chance, count):
    """The file with a piece left out, doubled or moved."""
    for _ in range(count):
        start, stop = sorted(chance.randrange(len(data)) for _ in range(2))
        stop = min(stop, start + chance.choice((1, 10, 1000, len(data))))
        yield chance.choice((data[:start] + data[stop:], data[:stop] + data[start:stop] + data[stop:]))


def outcome(path, data, skeleton=None):
    """What reading ``data`` gives, a recording or a refusal with path and place, and the seconds it took."""
    path.write_bytes(data)
    begin = time.process_time()
    try:
        return read_recording(path, skeleton), time.process_time() - begin
    except FormatError as error:
        result, seconds = error, time.process_time() - begin
    assert result.path in (str(path), str(skeleton)), result
    assert (result.line is None) != (result.byte is None) or "not beside it" in result.problem, result
    return result, seconds


def check(path, variants, skeleton=None):
    """Reads every variant; returns the recordings of those that were read."""
    found = []
    for data in variants:
        result, seconds = outcome(path, data, skeleton)
        assert seconds < 1, (seconds, data[:200])
        if not isinstance(result, FormatError):
            assert len(result.positions), data[:200]
            found.append(result)
    return found


def seeded(name):
    """Chance that is the same in every run."""
    return random.Random(name)
