//! Runs a Papilla model: ONNX and its card behind a small trait.
