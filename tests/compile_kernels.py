"""Kernels compiled once, before the test workers begin: two workers that begin at once would both compile all of them.

Run by `conftest.py`, or by hand: python tests/compile_kernels.py
"""

import sys

from toolpoint.kernel_compilation import compile_kernels

if __name__ == "__main__":
    result = compile_kernels()
    sys.exit(0 if result.is_whole else result.table())
