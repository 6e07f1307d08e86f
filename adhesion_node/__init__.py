"""Onboard identification of the wheel-rail adhesion coefficient for ROS 2."""
