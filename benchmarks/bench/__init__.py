"""
What `speed.py` measures: cases, peers, a clock, and one module a table.

Importing it keeps numpy to one thread, if that is imported after it.
"""

import os

for _library in ('OMP', 'OPENBLAS', 'MKL'):
    os.environ.setdefault(f'{_library}_NUM_THREADS', '1')
