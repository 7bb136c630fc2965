"""The service a lab would write: FastAPI, uvicorn and ONNX Runtime.

POST /v1/sed?tier=NAME: a raw float32 map in, a raw float32 map out.
"""

import os
from functools import cache

import numpy as np
import onnxruntime
from fastapi import FastAPI, Request, Response
from fastapi.concurrency import run_in_threadpool

options = onnxruntime.SessionOptions()
# One core a map, as Papilla has it: more threads for one map steal from the other clients.
options.intra_op_num_threads = 1
app = FastAPI()


@cache
def session(tier: str) -> onnxruntime.InferenceSession:
    model = os.path.join(os.environ["MODELS"], tier + ".onnx")
    return onnxruntime.InferenceSession(model, options, providers=["CPUExecutionProvider"])


@app.get("/readyz")
def ready() -> str:
    for tier in os.environ["TIERS"].split():
        session(tier)
    return "ready"


@app.post("/v1/sed")
async def sed(request: Request, tier: str) -> Response:
    body = await request.body()
    pressure_pa = np.frombuffer(body, "<f4").reshape(1, 1, 224, 224)
    (sed_j_per_m3,) = await run_in_threadpool(session(tier).run, None, {"pressure_pa": pressure_pa})
    return Response(sed_j_per_m3.tobytes(), media_type="application/octet-stream")
