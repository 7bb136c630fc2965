"""Sensors of pressure: readings of any array of taxels to what the finger under it feels.

- `Taxels`: where the taxels are and what their readings mean; `pressure` makes maps of readings
- `read_record`, `read_bag`: readings over time from CSV, NPZ or a bag of ROS
- `describe`: a sensor from a description in TOML
- `sense`: record and sensor to SED, rates and spikes over time
"""

from .bags import read_bag
from .describe import describe, describe_record
from .expect import Expected, expected
from .record import Record
from .records import read_record
from .sense import Sensed, sense
from .taxels import Taxels

__all__ = [
    "Expected",
    "Record",
    "Sensed",
    "Taxels",
    "describe",
    "describe_record",
    "expected",
    "read_bag",
    "read_record",
    "sense",
]
