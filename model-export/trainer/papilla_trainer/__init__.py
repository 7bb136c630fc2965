"""Papilla's trainer: dataset of finite-element presses to an ONNX model."""

__version__ = "0.1.0"
