#!/usr/bin/env python3
"""Makes tiny.onnx, a small network of the operators that Papilla's models use, and
tiny.expected.json, what ONNX Runtime answers to the press of `tests/common/mod.rs`.

Needed only to make the two files again: pip install numpy onnx onnxruntime; python make.py
"""

import json
from pathlib import Path

import numpy as np
import onnx
import onnxruntime
from onnx import TensorProto, helper, numpy_helper

SIDE = 224
BASE = 2
HERE = Path(__file__).parent
rng = np.random.default_rng(9)
nodes, weights = [], []


def weight(name, values):
    weights.append(numpy_helper.from_array(np.asarray(values, np.float32), name))
    return name


def node(kind, inputs, output, **attributes):
    nodes.append(helper.make_node(kind, inputs, [output], name=output, **attributes))
    return output


def conv(x, inputs, outputs, name):
    spread = np.sqrt(2 / (9 * inputs))
    w = weight(name + ".w", rng.normal(scale=spread, size=(outputs, inputs, 3, 3)))
    b = weight(name + ".b", rng.normal(scale=0.01, size=outputs))
    x = node("Conv", [x, w, b], name, kernel_shape=[3, 3], pads=[1, 1, 1, 1])
    return node("Relu", [x], name + ".relu")


def up(x, inputs, outputs, name):
    w = weight(name + ".w", rng.normal(scale=inputs**-0.5, size=(inputs, outputs, 2, 2)))
    return node("ConvTranspose", [x, w], name, kernel_shape=[2, 2], strides=[2, 2])


x = node("Mul", ["pressure_pa", weight("scale_in", 1 / 40_000)], "x")
fine = conv(x, 1, BASE, "encoder")
coarse = node("MaxPool", [fine], "pool", kernel_shape=[2, 2], strides=[2, 2])
coarse = conv(coarse, BASE, 2 * BASE, "bottom")
x = node("Concat", [up(coarse, 2 * BASE, BASE, "up"), fine], "skip", axis=1)
x = conv(x, 2 * BASE, BASE, "decoder")
w = weight("head.w", np.abs(rng.normal(size=(1, BASE, 1, 1))))
x = node("Relu", [node("Conv", [x, w], "head", kernel_shape=[1, 1])], "head.relu")
rows, columns = np.mgrid[:SIDE, :SIDE] + 0.5
mask = ((rows - 112) / 105) ** 2 + ((columns - 112) / 70) ** 2 < 1
x = node("Mul", [x, weight("scale_out", 2_500.0)], "scaled")
# One byte a pixel keeps the file small.
weights.append(numpy_helper.from_array(mask[None, None].astype(np.int8), "mask"))
mask = node("Cast", ["mask"], "mask.float", to=TensorProto.FLOAT)
node("Mul", [x, mask], "sed_j_per_m3")

shape = [1, 1, SIDE, SIDE]
graph = helper.make_graph(
    nodes,
    "tiny",
    [helper.make_tensor_value_info("pressure_pa", TensorProto.FLOAT, shape)],
    [helper.make_tensor_value_info("sed_j_per_m3", TensorProto.FLOAT, shape)],
    weights,
)
model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)
helper.set_model_props(
    model,
    {
        "papilla.format": "1",
        "papilla.name": "tiny",
        "papilla.atlas_hash": "ab" * 32,
        "papilla.effects": json.dumps(["finite_strain", "layers"]),
        "papilla.network": json.dumps({"kind": "test", "base": BASE}),
        "papilla.pressure_max_pa": "40000.0",
        "papilla.sed_max_j_per_m3": "2500.0",
        "papilla.dataset_sha256": "cd" * 32,
        "papilla.training": json.dumps({"seed": 7, "epochs": 0}),
        "papilla.metrics": json.dumps({}),
    },
)
onnx.checker.check_model(model, full_check=True)
(HERE / "tiny.onnx").write_bytes(model.SerializeToString())

i = np.arange(SIDE, dtype=np.float32) + np.float32(0.5)
r2 = ((i[:, None] - 90) / 50) ** 2 + ((i[None, :] - 120) / 40) ** 2
pressure = (np.float32(30_000) * np.maximum(np.float32(1) - r2, np.float32(0))).astype(np.float32)
session = onnxruntime.InferenceSession(HERE / "tiny.onnx", providers=["CPUExecutionProvider"])
sed = session.run(None, {"pressure_pa": pressure[None, None]})[0][0, 0]
assert sed.max() > 100 and np.isfinite(sed).all()
expected = {
    "onnxruntime": onnxruntime.__version__,
    "max_j_per_m3": float(sed.max()),
    "sum_j_per_m3": float(sed.sum(dtype=np.float64)),
    "every_7th_row_and_column": [[float(v) for v in row] for row in sed[::7, ::7]],
}
(HERE / "tiny.expected.json").write_text(json.dumps(expected) + "\n")
