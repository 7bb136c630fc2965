//! The Open Inference Protocol; tests/interop asks the same of its own clients.

use serde_json::{Value, json};

use crate::{
    fingers::support as fingers,
    support::{Answer, GAIN, Service, assert_rendered, bytes_of, floats_of, ramp},
};

fn request(members: &Value) -> Value {
    let mut input = json!({"name": "pressure_pa", "shape": [1, 1, 224, 224], "datatype": "FP32"});
    for (name, value) in members.as_object().unwrap() {
        input[name] = value.clone();
    }
    json!({"inputs": [input]})
}

/// JSON, the map as bytes behind it, and the header that says where.
fn binary(
    service: &Service,
    path: &str,
    mut request: Value,
    map: &[f32],
) -> crate::support::Request {
    let bytes = bytes_of(map);
    request["inputs"][0]["parameters"] = json!({"binary_data_size": bytes.len()});
    let head = request.to_string();
    let length = head.len().to_string();
    service
        .post(path, [head.into_bytes(), bytes].concat())
        .header("content-type", "application/octet-stream")
        .header("inference-header-content-length", &length)
}

fn assert_refused(answer: &Answer, status: u16, code: &str) {
    assert_eq!((answer.status, answer.header("x-papilla-code")), (status, Some(code)));
    assert!(answer.json()["error"].is_string());
}

#[tokio::test(flavor = "multi_thread")]
async fn server_and_models_describe_themselves() {
    let service = Service::start().await;
    let server = service.json("/v2").await;
    assert_eq!(
        (&server["name"], &server["extensions"]),
        (&json!("papilla"), &json!(["binary_tensor_data"]))
    );
    assert_eq!(service.json("/v2/health/live").await, json!({"live": true}));
    assert_eq!(service.json("/v2/health/ready").await, json!({"ready": true}));
    for path in ["/v2/models/quick", "/v2/models/quick/versions/1"] {
        let model = service.json(path).await;
        assert_eq!(model["versions"], json!(["1"]));
        assert_eq!(model["inputs"][0]["name"], "pressure_pa");
        assert_eq!(model["outputs"][0]["shape"], json!([1, 1, 224, 224]));
        assert_eq!(service.get(&format!("{path}/ready")).send().await.status, 200);
    }
    for path in ["/v2/models/none", "/v2/models/quick/versions/2", "/v2/models/none/ready"] {
        assert_refused(&service.get(path).send().await, 404, "unknown_tier");
    }
    assert_refused(&service.get("/v2/repository/index").send().await, 404, "not_found");
}

#[tokio::test(flavor = "multi_thread")]
async fn numbers_and_bytes_give_the_same_map() {
    let service = Service::start().await;
    let mut wish = request(&json!({"data": ramp()}));
    wish["id"] = json!("seven");
    let answer = service.post("/v2/models/quick/infer", wish.to_string()).send().await;
    assert_eq!(answer.status, 200, "{}", answer.text());
    let body = answer.json();
    assert_eq!(
        (&body["model_name"], &body["model_version"], &body["id"]),
        (&json!("quick"), &json!("1"), &json!("seven"))
    );
    let sed: Vec<f32> = serde_json::from_value(body["outputs"][0]["data"].clone()).unwrap();
    assert_rendered(&ramp(), &sed, |due| due * 1e-6);
    assert_eq!(answer.header("x-papilla-tier"), Some("quick"));

    let mut wish = request(&json!({}));
    wish["parameters"] = json!({"binary_data_output": true});
    let path = "/v2/models/quick/versions/1/infer";
    let answer = binary(&service, path, wish, &ramp()).send().await;
    assert_eq!(answer.status, 200, "{}", answer.text());
    let length: usize = answer.header("inference-header-content-length").unwrap().parse().unwrap();
    let head: Value = serde_json::from_slice(&answer.body[..length]).unwrap();
    assert_eq!(head["outputs"][0]["parameters"]["binary_data_size"], 4 * ramp().len());
    assert!(floats_of(&answer.body[length..]) == sed);
    let line = "papilla_maps_total{transport=\"oip\",outcome=\"ok\"}";
    assert_eq!(service.metric(line).await as u64, 2);
    assert!(sed[100] > 0.0 && GAIN > 0.0);
}

#[tokio::test(flavor = "multi_thread")]
async fn what_cannot_be_inferred_is_refused_in_words_of_the_protocol() {
    let service = Service::start().await;
    let infer = |body: String| service.post("/v2/models/quick/infer", body).send();
    assert_refused(&infer("{".to_owned()).await, 400, "bad_json");
    assert_refused(
        &infer(request(&json!({"data": [1, 2]})).to_string()).await,
        400,
        "wrong_length",
    );
    let mut map = ramp();
    map[7] = -1.0;
    let negative = request(&json!({"data": map})).to_string();
    assert_refused(&infer(negative).await, 422, "negative_pressure");
    let mut late = request(&json!({"data": ramp()}));
    late["parameters"] = json!({"timeout": 1});
    assert_refused(&infer(late.to_string()).await, 504, "late");
    map[7] = f32::NAN;
    let nan = binary(&service, "/v2/models/quick/infer", request(&json!({})), &map).send().await;
    assert_refused(&nan, 422, "not_finite");
    let unknown = service.post("/v2/models/none/infer", "{}").send().await;
    assert_refused(&unknown, 404, "unknown_tier");
    let zero = request(&json!({"data": vec![0.0; ramp().len()]}));
    assert_eq!(infer(zero.to_string()).await.status, 200);
}

/// A model is that of the finger in the address.
#[tokio::test(flavor = "multi_thread")]
async fn a_named_finger_has_its_own_models() {
    let folder = fingers::folder();
    let service = fingers::service(&folder).await;
    assert_refused(&service.get("/v2/models/own").send().await, 404, "unknown_tier");
    assert_eq!(service.json("/v2/models/own?finger=thumb").await["name"], "own");
    assert_eq!(service.get("/v2/models/own/ready?finger=thumb").send().await.status, 200);
    assert_refused(&service.get("/v2/models/slow?finger=thumb").send().await, 404, "unknown_tier");
    let wish = request(&json!({"data": ramp()}));
    for (path, gain) in [
        ("/v2/models/own/infer?finger=thumb", fingers::THUMB_GAIN),
        ("/v2/models/own/versions/1/infer?finger=thumb", fingers::THUMB_GAIN),
        ("/v2/models/quick/infer?finger=thumb", 0.9 * fingers::THUMB_GAIN),
        ("/v2/models/quick/infer?finger=default", GAIN),
        ("/v2/models/quick/infer", GAIN),
    ] {
        let answer = service.post(path, wish.to_string()).send().await;
        assert_eq!(answer.status, 200, "{path}: {}", answer.text());
        let sed = &answer.json()["outputs"][0]["data"];
        let at = 112 * 224 + 112;
        let ratio = sed[at].as_f64().unwrap() as f32 / ramp()[at];
        assert!((ratio - gain).abs() < 1e-4, "{path}: {ratio}");
    }
    for (path, status, code) in [
        ("/v2/models/quick/infer?finger=nobody", 404, "not_found"),
        ("/v2/models/quick/infer?finger=thumb&finger=default", 400, "bad_query"),
    ] {
        assert_refused(&service.post(path, wish.to_string()).send().await, status, code);
    }
    assert_refused(&service.get("/v2/models/quick?finger=nobody").send().await, 404, "not_found");
    // Elsewhere than in the address it would be passed over, and the default finger would answer.
    let mut wish = wish;
    wish["parameters"] = json!({"finger": "thumb"});
    let answer = service.post("/v2/models/quick/infer", wish.to_string()).send().await;
    assert_refused(&answer, 400, "bad_query");
    assert!(answer.text().contains("?finger=thumb"), "{}", answer.text());
}

/// A parameter that would change the answer is refused where it is not served.
#[tokio::test(flavor = "multi_thread")]
async fn requests_that_belong_together_are_not_served() {
    let service = Service::start().await;
    for name in ["sequence_id", "sequence_start", "sequence_end"] {
        for value in [json!(7), json!("a"), json!(true)] {
            let mut request = request(&json!({"data": ramp()}));
            request["parameters"] = json!({name: value});
            let answer = service.post("/v2/models/quick/infer", request.to_string()).send().await;
            assert_refused(&answer, 400, "bad_query");
            assert!(answer.text().contains(name), "{}", answer.text());
        }
    }
}
