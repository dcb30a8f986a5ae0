"""Joint identification: mode shapes at measured points in, joints with position, freedoms and stiffness out."""

from toolpoint.joint_identification.estimate import JointEstimate
from toolpoint.joint_identification.finite_motion import ClosestPoint, FiniteRotation
from toolpoint.joint_identification.grouping import Grouping, group_points
from toolpoint.joint_identification.identify import JointIdentification, identify_joints
from toolpoint.joint_identification.joint_fit import Criterion
from toolpoint.joint_identification.rigid_motion import RigidMotion, SmallMotion
from toolpoint.joint_identification.stiffness import ComponentMass

__all__ = [
    "ClosestPoint",
    "ComponentMass",
    "Criterion",
    "FiniteRotation",
    "Grouping",
    "JointEstimate",
    "JointIdentification",
    "RigidMotion",
    "SmallMotion",
    "group_points",
    "identify_joints",
]
