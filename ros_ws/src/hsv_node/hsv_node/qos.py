"""Quality of service of the bench: everything is reliable; what announces a state of affairs is latched."""

from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

STEP = QoSProfile(depth=256, reliability=ReliabilityPolicy.RELIABLE)
"""Topics with one message a step: deeper than the plant may run ahead of the recorder."""

LATCHED = QoSProfile(depth=32, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL)
"""Announcements that late joiners must receive."""
