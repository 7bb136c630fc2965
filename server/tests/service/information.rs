//! What the service says of itself, and that its OpenAPI document says the same.

use std::{collections::BTreeSet, io::Read};

use papilla_proto::{ErrorCode, MAP_LEN, atlas::Patch, atlas::Raster};
use serde_json::{Value, json};

use crate::support::{Answer, Request, Service, atlas, bytes_of, floats_of, ramp};

#[tokio::test(flavor = "multi_thread")]
async fn health_and_readiness() {
    let service = Service::start().await;
    assert_eq!(service.json("/healthz").await, json!({"status": "ok"}));
    assert_eq!(service.json("/readyz").await, json!({"status": "ready"}));
}

#[tokio::test(flavor = "multi_thread")]
async fn tiers_and_cards() {
    let service = Service::start().await;
    let tiers = service.json("/v1/tiers").await;
    assert_eq!(tiers["default"], "quick");
    let (quick, slow) = (&tiers["tiers"][0], &tiers["tiers"][1]);
    assert_eq!((&quick["name"], &quick["default"]), (&json!("quick"), &json!(true)));
    assert_eq!((&slow["name"], &slow["default"]), (&json!("slow"), &json!(false)));
    assert_eq!(slow["relative_l2_median"], 0.05);
    assert_eq!((&quick["pressure_max_pa"], &quick["sed_max_j_per_m3"]), (&json!(1e4), &json!(5e3)));
    let latency = |tier: &Value| tier["predicted_latency_us"].as_u64().unwrap();
    assert!(latency(slow) > latency(quick));
    assert_eq!(quick["atlas_hash"], atlas().hash());
    let models = service.json("/v1/models").await;
    assert_eq!(models["models"][1]["name"], "slow");
    assert_eq!(models["models"][1]["metrics"]["relative_l2"]["p95"], 0.1);
}

#[tokio::test(flavor = "multi_thread")]
async fn the_atlas_in_all_its_forms() {
    let service = Service::start().await;
    assert_eq!(service.json("/v1/atlas").await["hash"], atlas().hash());
    let obj = service.get("/v1/atlas.obj").send().await;
    assert_eq!(obj.header("content-type"), Some("model/obj"));
    assert_eq!(obj.text().lines().filter(|line| line.starts_with("v ")).count(), 10);
    for (path, patch) in [
        ("/v1/atlas/mask.png", Patch::Interface),
        ("/v1/atlas/mask.png?patch=interface", Patch::Interface),
        ("/v1/atlas/mask.png?patch=skin", Patch::Skin),
    ] {
        let png = service.get(path).send().await;
        let mut reader = png::Decoder::new(std::io::Cursor::new(&png.body)).read_info().unwrap();
        let mut pixels = vec![0; MAP_LEN];
        reader.next_frame(&mut pixels).unwrap();
        let mask: Vec<bool> = pixels.iter().map(|&p| p == 255).collect();
        assert!(mask == Raster::new(&atlas(), patch).mask(), "{path}");
        // The skin of the test atlas is all of the map.
        assert!(mask.contains(&true) && mask.contains(&false) == (patch == Patch::Interface));
    }
    service.get("/v1/atlas/mask.png?patch=nail").send().await.assert_refused(400, "bad_query");
}

#[tokio::test(flavor = "multi_thread")]
async fn presses_are_listed_shown_and_rasterised() {
    let service = Service::start().await;
    let list = service.json("/v1/presses").await;
    let state = json!({"id": 0, "name": "flat", "pose": {"pitch_deg": 30.0}, "depth_mm": 1.5});
    assert_eq!(list["presses"], json!([state]));
    let values = service.json("/v1/presses/0").await;
    // Read from the map, a pixel or so from where a vertex lies.
    let read = values["pressure_pa"].as_array().unwrap().iter().map(|v| v.as_f64().unwrap());
    let off: Vec<f64> = read.zip(0..).map(|(v, i)| (v - 100.0 * f64::from(i)).abs()).collect();
    assert!(off.len() == 5 && off.iter().all(|off| *off < 10.0), "{off:?}");
    let map = service.get("/v1/presses/0/pressure").send().await;
    let mut due = vec![0.0; MAP_LEN];
    let raster = Raster::new(&atlas(), Patch::Skin);
    raster.rasterise(&[0.0, 100.0, 200.0, 300.0, 400.0], &mut due).unwrap();
    assert!(floats_of(&map.body) == due);
    // It can be posted as it is, and as JSON.
    assert_eq!(service.post("/v1/sed", map.body).send().await.status, 200);
    let text = service.get("/v1/presses/0/pressure").header("accept", "application/json");
    assert_eq!(service.post("/v1/sed", text.send().await.body).send().await.status, 200);
    let sed = service.get("/v1/presses/0/sed").header("accept", "image/png").send().await;
    assert_eq!(sed.header("x-sed-max-j-per-m3"), Some("200"));
    for path in ["/v1/presses/1", "/v1/presses/-1", "/v1/presses/x", "/v1/presses/9/sed"] {
        service.get(path).send().await.assert_refused(404, "not_found");
    }
    let html = service.get("/v1/presses/0/sed").header("accept", "text/html").send().await;
    html.assert_refused(406, "not_acceptable");
}

#[tokio::test(flavor = "multi_thread")]
async fn metrics_are_what_a_scraper_reads() {
    let service = Service::start().await;
    service.post("/v1/sed", bytes_of(&ramp())).send().await;
    let answer = service.get("/metrics").send().await;
    assert!(answer.header("content-type").unwrap().starts_with("application/openmetrics-text"));
    let text = answer.text();
    assert!(text.ends_with("# EOF\n"));
    for stage in ["queue", "decode", "infer", "encode", "total"] {
        let count = format!("papilla_stage_seconds_count{{tier=\"quick\",stage=\"{stage}\"}} 1\n");
        assert!(text.contains(&count), "{count}{text}");
    }
    for bucket in ["0.001", "0.0055", "0.0111", "+Inf"] {
        assert!(text.contains(&format!("le=\"{bucket}\"")), "{bucket}");
    }
    let model = "papilla_model{tier=\"quick\",";
    assert!(text.lines().any(|line| line.starts_with(model) && line.ends_with(" 1")), "{text}");
    let request = "papilla_request_seconds_count{route=\"/v1/sed\",status=\"200\"} 1\n";
    assert!(text.contains(request), "{text}");
    for reason in ["sessions", "requests", "token_sessions", "rate", "hellos"] {
        assert!(text.contains(&format!("papilla_shed_total{{reason=\"{reason}\"}} 0\n")));
    }
    if cfg!(target_os = "linux") {
        let resident = service.metric("process_resident_memory_bytes").await;
        assert!(resident > 1e6, "{resident}");
        assert!(service.metric("process_open_fds").await >= 3.0);
        assert!(service.metric("process_cpu_seconds_total").await > 0.0);
    }
    for (count, due) in [("ok", 1), ("late", 0), ("error", 0)] {
        let line = format!("papilla_maps_total{{transport=\"http\",outcome=\"{count}\"}}");
        assert_eq!(service.metric(&line).await as u64, due, "{count}");
    }
}

/// Every operation of the document: method, path, description.
fn operations(document: &Value) -> Vec<(String, String, Value)> {
    let mut all = Vec::new();
    for (path, methods) in document["paths"].as_object().unwrap() {
        for (method, operation) in methods.as_object().unwrap() {
            all.push((method.clone(), path.clone(), operation.clone()));
        }
    }
    all
}

/// Asserts that the document foresees the answer: its status and its content type.
fn assert_foreseen(document: &Value, operation: &Value, answer: &Answer, what: &str) {
    let response = &operation["responses"][answer.status.to_string()];
    assert!(response.is_object(), "{what}: status {} is not in the document", answer.status);
    let response = match response["$ref"].as_str() {
        Some(place) => document.pointer(place.trim_start_matches('#')).unwrap(),
        None => response,
    };
    if let Some(content) = response.get("content") {
        let found = answer.header("content-type").unwrap().split(';').next().unwrap();
        assert!(content.get(found).is_some(), "{what}: {found} is not in the document");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn the_openapi_document_is_the_truth() {
    let service = Service::start().await;
    let document = service.json("/openapi.json").await;
    let operations = operations(&document);
    let documented: BTreeSet<_> =
        operations.iter().map(|(m, p, _)| (m.clone(), p.clone())).collect();
    assert_eq!(documented, papilla_server::routes().into_iter().collect());

    for (method, path, operation) in &operations {
        let address = path
            .replace("{press}", "0")
            .replace("{file}", "papilla.css")
            .replace("{model}", "quick")
            .replace("{version}", "1");
        let body = if path.starts_with("/v2") { tensor() } else { bytes_of(&ramp()) };
        let what = format!("{method} {path}");
        let request = Request::new(service.address, &method.to_uppercase(), &address);
        let request = if method == "post" { request.body(body) } else { request };
        assert_foreseen(&document, operation, &request.send().await, &what);
        // Each form of answer the document offers is given when it is asked for.
        let content = operation["responses"]["200"]["content"].as_object();
        if operation["responses"].get("406").is_some() {
            for kind in content.unwrap().keys() {
                let request = Request::new(service.address, &method.to_uppercase(), &address);
                let request = request.header("accept", kind);
                let request =
                    if method == "post" { request.body(bytes_of(&ramp())) } else { request };
                let answer = request.send().await;
                assert_eq!(
                    (answer.status, answer.header("content-type")),
                    (200, Some(kind.as_str())),
                    "{what}"
                );
            }
        }
        // And no other method is.
        let other = Request::new(service.address, "DELETE", &address).send().await;
        if path.starts_with("/v2") {
            assert_eq!(other.header("x-papilla-code"), Some("method_not_allowed"));
            assert!(other.json()["error"].is_string());
        } else {
            other.assert_refused(405, "method_not_allowed");
        }
    }
    let codes: BTreeSet<_> =
        ErrorCode::ALL.iter().map(|code| json!(code.as_str()).to_string()).collect();
    let listed = &document["components"]["schemas"]["Error"]["properties"]["error"]["properties"]["code"]
        ["enum"];
    let listed: BTreeSet<_> = listed.as_array().unwrap().iter().map(Value::to_string).collect();
    assert_eq!(listed, codes);
}

/// An inference request in JSON.
fn tensor() -> Vec<u8> {
    let input = json!({"name": "pressure_pa", "shape": [1, 1, 224, 224], "datatype": "FP32",
        "data": ramp()});
    json!({"inputs": [input]}).to_string().into_bytes()
}

/// What does not change is made once, told apart by its tag, and sent compressed to whoever asks.
#[tokio::test(flavor = "multi_thread")]
async fn what_does_not_change_has_a_tag_and_comes_compressed() {
    let service = Service::start().await;
    for path in [
        "/",
        "/papilla.css",
        "/openapi.json",
        "/v1/models",
        "/v1/atlas",
        "/v1/atlas.obj",
        "/v1/atlas.glb",
        "/v1/presses",
        "/v1/presses/0",
        "/v1/presses/0/sed",
        "/v1/presses/0/pressure",
    ] {
        let plain = service.get(path).send().await;
        let tag = plain.header("etag").unwrap_or_else(|| panic!("{path} has no tag")).to_owned();
        assert_eq!(plain.header("content-encoding"), None, "{path}");
        assert!(plain.header("vary").unwrap().contains("accept-encoding"), "{path}");
        let again = service.get(path).header("if-none-match", &tag).send().await;
        assert_eq!((again.status, again.body.len()), (304, 0), "{path}");

        let packed = service.get(path).header("accept-encoding", "br, gzip;q=0.5").send().await;
        assert_eq!(packed.header("content-encoding"), Some("gzip"), "{path}");
        assert_eq!(packed.header("content-type"), plain.header("content-type"), "{path}");
        assert!(packed.body.len() < plain.body.len(), "{path}");
        let mut unpacked = Vec::new();
        flate2::read::GzDecoder::new(&packed.body[..]).read_to_end(&mut unpacked).unwrap();
        assert!(unpacked == plain.body, "{path}");
        let packed_tag = packed.header("etag").unwrap();
        assert_ne!(packed_tag, tag, "{path}: other bytes have another tag");
        let again = service.get(path).header("accept-encoding", "gzip");
        let again = again.header("if-none-match", packed_tag).send().await;
        assert_eq!((again.status, again.body.len()), (304, 0), "{path}");
        for refused in ["gzip;q=0", "gzip;q=0, *", "identity", ""] {
            let answer = service.get(path).header("accept-encoding", refused).send().await;
            assert_eq!(answer.header("content-encoding"), None, "{path}: {refused}");
        }
    }
    // Other forms of a map have other tags, and their scale.
    let form = |kind: &str| service.get("/v1/presses/0/sed").header("accept", kind).send();
    let (png, json) = (form("image/png").await, form("application/json").await);
    assert_ne!(png.header("etag"), json.header("etag"));
    assert_eq!(form("image/png").await.header("x-sed-max-j-per-m3"), Some("200"));
    assert!(png.header("vary").unwrap().contains("accept,"));
}
