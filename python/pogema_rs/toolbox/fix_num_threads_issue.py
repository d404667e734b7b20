"""Limits numerical libraries to one thread; import this module before NumPy.

Source: pogema-toolbox 0.1.1, `fix_num_threads_issue.py`
"""

from __future__ import annotations

import os

__all__: list[str] = []

for _name in ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ[_name] = "1"
