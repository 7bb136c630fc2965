"""NVIDIA Triton with ONNX Runtime behind it, as `nvidia-pytriton` ships and serves it."""

import os
from functools import partial

import numpy as np
import onnxruntime
from pytriton.model_config import ModelConfig, Tensor
from pytriton.triton import Triton, TritonConfig

options = onnxruntime.SessionOptions()
options.intra_op_num_threads = 1


def infer(session, requests):
    feed = ({"pressure_pa": request["pressure_pa"]} for request in requests)
    return [{"sed_j_per_m3": session.run(None, inputs)[0]} for inputs in feed]


shape = (1, 1, 224, 224)
config = TritonConfig(http_address="127.0.0.1", http_port=int(os.environ["PORT"]), allow_grpc=False, allow_metrics=False)
with Triton(config=config) as triton:
    for tier in os.environ["TIERS"].split():
        model = os.path.join(os.environ["MODELS"], tier + ".onnx")
        session = onnxruntime.InferenceSession(model, options, providers=["CPUExecutionProvider"])
        triton.bind(
            model_name=tier,
            infer_func=partial(infer, session),
            inputs=[Tensor(name="pressure_pa", dtype=np.float32, shape=shape)],
            outputs=[Tensor(name="sed_j_per_m3", dtype=np.float32, shape=shape)],
            config=ModelConfig(batching=False),
        )
    triton.serve()
