"""
What the reader of a sqlite bag does not notice.

It opens the file as one that nobody changes: a log that was not merged is passed over, and what
the last page lacks is read as zeros. Layout: https://www.sqlite.org/fileformat2.html.
"""

from pathlib import Path

MAGIC = b'SQLite format 3\0'
LOG_SUFFIXES = ('-wal', '-journal')

_HEADER_BYTES = 100
_LARGEST_PAGE = 65536


def sqlite_damage(path: Path) -> str | None:
    """
    Return what is missing in a database file, None if nothing is known to be.

    :param path: any file.
    """
    for suffix in LOG_SUFFIXES:
        log = Path(f'{path}{suffix}')
        if log.exists() and log.stat().st_size > 0:
            return f'{log.name} was never merged; opening {path.name} with sqlite3 once does that'
    with path.open('rb') as file:
        header = file.read(_HEADER_BYTES)
    if len(header) == _HEADER_BYTES and header.startswith(MAGIC):
        # One stands for the size that two bytes cannot say.
        page_bytes = int.from_bytes(header[16:18], 'big')
        page_bytes = _LARGEST_PAGE if page_bytes == 1 else page_bytes
        pages = int.from_bytes(header[28:32], 'big')
        size = path.stat().st_size
        if page_bytes == 0 or size % page_bytes or size < pages * page_bytes:
            return f'{path.name} ends early'
    return None
