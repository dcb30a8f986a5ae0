"""Tests of the room joint_identification."""
