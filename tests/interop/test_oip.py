"""tritonclient[http] against /v2, in JSON and in bytes, one request and many."""

import numpy as np
import pytest
import tritonclient.http as triton
from tritonclient.utils import InferenceServerException


@pytest.fixture
def client(service):
    with triton.InferenceServerClient(url=service.address, concurrency=4) as client:
        yield client


def tensor(pressure_pa, binary):
    tensor = triton.InferInput("pressure_pa", list(pressure_pa.shape), "FP32")
    tensor.set_data_from_numpy(pressure_pa, binary_data=binary)
    return tensor


def test_server_and_models_describe_themselves(client, service):
    assert client.is_server_live()
    assert client.is_server_ready()
    server = client.get_server_metadata()
    assert server["name"] == "papilla"
    assert server["extensions"] == ["binary_tensor_data"]
    for name in service.started["tiers"]:
        assert client.is_model_ready(name)
        assert client.is_model_ready(name, model_version="1")
        assert not client.is_model_ready(name, model_version="2")
        model = client.get_model_metadata(name)
        assert model["inputs"] == [{"name": "pressure_pa", "datatype": "FP32", "shape": [1, 1, 224, 224]}]
        assert model["outputs"][0]["name"] == "sed_j_per_m3"
    assert not client.is_model_ready("none")


@pytest.mark.parametrize("binary_in", [True, False])
@pytest.mark.parametrize("binary_out", [True, False])
def test_every_form_gives_the_map_of_the_plain_route(client, pressure_pa, sed_j_per_m3, binary_in, binary_out):
    wanted = [triton.InferRequestedOutput("sed_j_per_m3", binary_data=binary_out)]
    answer = client.infer("nano", [tensor(pressure_pa, binary_in)], outputs=wanted, request_id="seven")
    sed = answer.as_numpy("sed_j_per_m3")
    assert sed.dtype == np.float32 and sed.shape == (1, 1, 224, 224)
    assert sed.max() > 0
    np.testing.assert_array_equal(sed, sed_j_per_m3)
    said = answer.get_response()
    assert (said["model_name"], said["model_version"], said["id"]) == ("nano", "1", "seven")


def test_without_a_wish_the_client_gets_bytes(client, pressure_pa, sed_j_per_m3):
    answer = client.infer("nano", [tensor(pressure_pa, True)], model_version="1")
    np.testing.assert_array_equal(answer.as_numpy("sed_j_per_m3"), sed_j_per_m3)
    assert answer.get_output("sed_j_per_m3")["parameters"]["binary_data_size"] == sed_j_per_m3.nbytes


def test_a_finger_is_named_in_the_address(client, pressure_pa, sed_j_per_m3):
    named = {"query_params": {"finger": "default"}}
    assert client.get_model_metadata("nano", **named)["name"] == "nano"
    answer = client.infer("nano", [tensor(pressure_pa, True)], **named)
    np.testing.assert_array_equal(answer.as_numpy("sed_j_per_m3"), sed_j_per_m3)
    with pytest.raises(InferenceServerException, match="no finger 'nobody'"):
        client.infer("nano", [tensor(pressure_pa, True)], query_params={"finger": "nobody"})
    with pytest.raises(InferenceServerException, match="named in the address"):
        client.infer("nano", [tensor(pressure_pa, True)], parameters={"finger": "default"})


def test_many_at_once(client, pressure_pa):
    factors = [0.1 * (1 + n % 9) for n in range(24)]
    asked = [client.async_infer("nano", [tensor(np.float32(f) * pressure_pa, True)]) for f in factors]
    peaks = [one.get_result().as_numpy("sed_j_per_m3").max() for one in asked]
    by_factor = {}
    for factor, peak in zip(factors, peaks, strict=True):
        assert by_factor.setdefault(factor, peak) == peak
    ordered = [by_factor[f] for f in sorted(by_factor)]
    assert ordered == sorted(ordered) and ordered[0] < ordered[-1]


def test_refusals_are_the_clients_own_exceptions(client, pressure_pa):
    for name, map_pa, options, status, words in [
        ("none", pressure_pa, {}, "404", "no tier 'none'"),
        ("nano", -pressure_pa, {}, "422", "pressure_pa"),
        ("nano", pressure_pa[0], {}, "400", "shape"),
        ("nano", pressure_pa, {"timeout": 1}, "504", "deadline"),
    ]:
        with pytest.raises(InferenceServerException) as refused:
            client.infer(name, [tensor(map_pa, True)], **options)
        assert refused.value.status() == status, refused.value
        assert words in refused.value.message(), refused.value
    wanted = [triton.InferRequestedOutput("sed_j_per_m3", class_count=3)]
    with pytest.raises(InferenceServerException, match="classification is not served"):
        client.infer("nano", [tensor(pressure_pa, True)], outputs=wanted)
    with pytest.raises(InferenceServerException):
        client.get_inference_statistics("nano")
