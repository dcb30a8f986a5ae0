"""Set points and torque recorded by a controller (CSV): read, driven again by the model, torques compared."""

import tempfile
from pathlib import Path

import numpy as np

from toolpoint.drives import (
    Command,
    Controller,
    Coulomb,
    DriveAxis,
    PositionLoop,
    Servo,
    TorqueMotor,
    VelocityLoop,
    build_plant,
    rigid_axis,
    simulate,
    torque_comparison,
)
from toolpoint.drives.program.command import circle
from toolpoint.io.program import command_stream
from toolpoint.io.program.command_stream import CommandStream

LEAD = 0.01 / (2 * np.pi)


def main() -> float:
    """Return the rms difference of recorded torque and model, N m: what is left is the sensor's noise."""
    control = Controller(PositionLoop(60.0, 1e-3), VelocityLoop(2.0, 0.02, 250e-6), LEAD)
    servo = Servo(build_plant([DriveAxis(n, TorqueMotor(), rigid_axis(0.01, LEAD, friction=Coulomb(2.0, 0.05)))
                               for n in "XY"]), (control, control))
    command = circle(0.02, 0.05, 1e-3, duration=3.0, center=(-0.02, 0.0))
    torque = simulate(servo, command, record_interval=4).signal("torque_set")
    noise = 0.05 * np.random.default_rng(1).standard_normal(torque.shape)
    columns = np.hstack([command.position, torque + noise])
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "trace.csv"
        command_stream.write(CommandStream(columns, 1e-3, ("X", "Y", "Tx", "Ty"), ("m", "m", "N m", "N m")), path)
        stream = command_stream.read(path)
    again = simulate(servo, Command(stream.columns(["X", "Y"]), stream.sample_time), record_interval=4).signal("torque_set")
    agreement = torque_comparison(stream.columns(["Tx", "Ty"]), again)
    print(stream, agreement)
    return agreement["rms difference"]


if __name__ == "__main__":
    main()
