"""Kinematics and statics of the brake, equations (2) to (24)."""
