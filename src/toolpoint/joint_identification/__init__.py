"""Joint identification: mode shapes at measured points in, joints with position, freedoms and stiffness out."""

from toolpoint.joint_identification.identify import JointIdentification, identify_joints
from toolpoint.joint_identification.joints.estimate import JointEstimate
from toolpoint.joint_identification.joints.joint_fit import Criterion
from toolpoint.joint_identification.joints.stiffness import ComponentMass
from toolpoint.joint_identification.motion.finite_motion import ClosestPoint, FiniteRotation
from toolpoint.joint_identification.motion.grouping import Grouping, group_points
from toolpoint.joint_identification.motion.rigid_motion import RigidMotion, SmallMotion

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
