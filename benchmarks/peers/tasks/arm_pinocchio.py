import numpy as np
import pinocchio as pin


def solve(data):
    model, parent, before = pin.Model(), 0, np.zeros(3)
    for axis, place in zip(data["axes"].tolist(), data["places"], strict=True):
        joint = {"x": pin.JointModelRX, "y": pin.JointModelRY, "z": pin.JointModelRZ}[axis]()
        parent = model.addJoint(parent, joint, pin.SE3(np.eye(3), place - before), f"q{parent}")
        before = place
    frame = model.addFrame(pin.Frame("flange", parent, 0, pin.SE3(np.eye(3), data["flange"] - before), pin.OP_FRAME))
    state, positions = model.createData(), []
    for angles in data["angles"]:
        pin.framesForwardKinematics(model, state, angles)
        positions.append(state.oMf[frame].translation.copy())
    return {"x": np.array(positions)}
