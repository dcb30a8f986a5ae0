"""Virtual measurements to try everything on, and what was put into them (as `toolpoint samples servo`)."""

import tempfile

from toolpoint.io import read_servo_data
from toolpoint.samples import KINDS, write_samples
from toolpoint.studies import judge_servo_data


def main() -> float:
    """Return the gain of the position loop that is read from a sample, 1/s."""
    for kind, words in KINDS.items():
        print(f"{kind:12} {words}")
    with tempfile.TemporaryDirectory() as folder:
        sample = write_samples("servo", f"{folder}/servo")
        print(sample.table())
        result = judge_servo_data(read_servo_data(sample.folder / "trace.csv"))
    print(result.table())
    return result.axes[0].velocity_gain


if __name__ == "__main__":
    main()
