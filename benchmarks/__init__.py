"""Benchmarks, in rooms as `src/toolpoint` has them: each script measures one promise and prints its figure as the last line.

`bars.py` lists the promises of `docs/bars.yaml` and runs their commands; `frame.py` is what all scripts share; `house` counts
how readable the package is; `peers` sets other programs beside it.
"""
