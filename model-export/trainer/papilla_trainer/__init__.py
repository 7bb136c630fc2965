"""Papilla's trainer: dataset of finite-element indentations to an ONNX model."""

import os

__version__ = "0.1.0"

# Read once by the OpenMP runtime, when torch is first imported. Threads that spin at each barrier
# while another process holds their core cost a factor of three on a shared machine; waiting
# asleep costs nothing measurable on a quiet one.
os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")
