"""Prometheus' own parsers against /metrics."""

import math

import pytest
from prometheus_client.openmetrics.parser import text_string_to_metric_families as openmetrics

BUCKETS_US = [50, 100, 200, 500, 1000, 2000, 3000, 4000, 5500, 8000, 11100, 16000, 25000, 50000, 100000, 200000, 500000,
              2000000]


@pytest.fixture
def families(service, sed_j_per_m3):
    text, headers = service.get("/metrics", accept="application/openmetrics-text")
    assert headers["content-type"].startswith("application/openmetrics-text; version=1.0.0")
    return {family.name: family for family in openmetrics(text.decode())}


def values(family, suffix=""):
    return {tuple(sorted(s.labels.items())): s.value for s in family.samples if s.name == family.name + suffix}


def test_every_family_is_there_with_its_type(families):
    for name, kind in [
        ("papilla_build", "info"), ("papilla_stage_seconds", "histogram"), ("papilla_request_seconds", "histogram"),
        ("papilla_maps", "counter"), ("papilla_late", "counter"), ("papilla_shed", "counter"),
        ("papilla_errors", "counter"), ("papilla_reloads", "counter"), ("papilla_zero_maps", "counter"),
        ("papilla_long_frames", "counter"), ("papilla_hellos_left", "counter"),
        ("papilla_queue_length", "gauge"), ("papilla_load_ratio", "gauge"), ("papilla_sessions_open", "gauge"),
        ("papilla_sessions", "counter"),
        ("papilla_connections_open", "gauge"), ("papilla_model", "gauge"), ("process_resident_memory_bytes", "gauge"),
        ("process_open_fds", "gauge"), ("process_cpu_seconds", "counter"),
    ]:
        assert families[name].type == kind, name
        assert families[name].documentation, name


def test_a_rendered_map_is_in_every_stage(families):
    counts = values(families["papilla_stage_seconds"], "_count")
    for stage in ["queue", "decode", "infer", "encode", "total"]:
        assert counts[(("stage", stage), ("tier", "nano"))] >= 1, stage
    buckets = [s for s in families["papilla_stage_seconds"].samples
               if s.name.endswith("_bucket") and s.labels["tier"] == "nano" and s.labels["stage"] == "infer"]
    bounds = [float(s.labels["le"]) for s in buckets]
    assert bounds[:-1] == pytest.approx([us * 1e-6 for us in BUCKETS_US]) and math.isinf(bounds[-1])
    rising = [s.value for s in buckets]
    assert rising == sorted(rising) and rising[-1] >= 1


def test_models_and_process(families, service):
    models = [s.labels for s in families["papilla_model"].samples]
    assert sorted(m["tier"] for m in models) == sorted(service.started["tiers"])
    defaults = {service.started["default_tier"], service.started["default_tier_for_pressure"]}
    assert {m["tier"] for m in models if m["default"] == "true"} == defaults
    assert all(len(m["onnx_sha256"]) == 64 and len(m["atlas_hash"]) == 64 for m in models)
    (resident,) = families["process_resident_memory_bytes"].samples
    assert 1e6 < resident.value < 1e11
