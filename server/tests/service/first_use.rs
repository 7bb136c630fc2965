//! Models that are loaded when a client first names their tier.

use std::{fs, path::Path};

use papilla_proto::{FrameStatus, SampleType};
use papilla_server::{Config, StartError};
use serde_json::{Value, json};
use tempfile::TempDir;

use crate::support::{
    GAIN, Service, Socket, add_model, add_model_of_gain, atlas, bytes_of, floats_of, frame, hello,
    model_folder, ramp, write,
};

/// The models of every test and `late`, which is loaded on demand. By its card it is the best.
fn folder() -> TempDir {
    let folder = model_folder();
    add_model(folder.path(), "late", atlas().hash(), 0, 0.03);
    list(folder.path(), &["quick", "slow", "late"]);
    folder
}

fn list(folder: &Path, models: &[&str]) {
    let index = json!({"default": "quick", "models": models, "on_demand": ["late"]});
    write(folder, "index.json", index.to_string().as_bytes());
}

async fn start(models: TempDir) -> Service {
    Service::on(models, |_| ()).await.unwrap()
}

async fn late(service: &Service) -> Value {
    let tiers = service.json("/v1/tiers").await;
    let tiers = tiers["tiers"].as_array().unwrap().clone();
    tiers.into_iter().find(|tier| tier["name"] == "late").expect("it is not listed")
}

/// How many models were loaded at their first use, and how many could not be.
async fn loads(service: &Service) -> [u64; 2] {
    let mut found = [0; 2];
    for (found, outcome) in found.iter_mut().zip(["ok", "refused"]) {
        let line = format!("papilla_first_uses_total{{outcome=\"{outcome}\"}}");
        *found = service.metric(&line).await as u64;
    }
    found
}

/// What the session's tier multiplies the pressure by.
async fn gain(socket: &mut Socket, sequence: u32) -> f32 {
    socket.send(frame(sequence, 0, SampleType::F32, 1.0, &ramp())).await;
    let (header, sed) = socket.hear_frame().await;
    assert_eq!((header.sequence, header.status), (sequence, FrameStatus::Ok));
    floats_of(&sed)[50_000] / ramp()[50_000]
}

async fn reload(service: &Service) -> Value {
    let answer = service.post("/v1/admin/reload", "").send().await;
    assert_eq!(answer.status, 200, "{}", answer.text());
    answer.json()
}

#[tokio::test(flavor = "multi_thread")]
async fn a_model_on_demand_is_listed_and_loaded_once_when_it_is_named() {
    let service = start(folder()).await;
    let before = late(&service).await;
    assert_eq!((&before["on_demand"], &before["loaded"]), (&json!(true), &json!(false)));
    assert_eq!((&before["backend"], &before["named_only"]), (&Value::Null, &json!("on_demand")));
    let models = service.json("/v1/models").await;
    assert_eq!(models["models"][2]["name"], "late");
    assert_eq!(service.json("/v2/models/late").await["name"], "late");
    assert_eq!(service.json("/v2/models/late/ready").await["ready"], true);
    assert_eq!(loads(&service).await, [0, 0], "something has loaded it");

    let mut socket = service.socket().await;
    assert_eq!(socket.open(hello(&json!({"tier": "late"}))).await["tier"], "late");
    assert!((gain(&mut socket, 1).await - GAIN).abs() < 1e-4);
    assert_eq!(loads(&service).await, [1, 0]);
    let after = late(&service).await;
    assert_eq!((&after["on_demand"], &after["loaded"]), (&json!(true), &json!(true)));
    assert!(after["backend"].as_str().unwrap().starts_with("tract"), "{after}");
    assert_ne!(after["calibrated_us"], Value::Null);

    let mut other = service.socket().await;
    other.open(hello(&json!({"tier": "late"}))).await;
    assert!((gain(&mut other, 1).await - GAIN).abs() < 1e-4);
    let sed = service.post("/v1/sed?tier=late", bytes_of(&ramp())).send().await;
    assert_eq!(sed.status, 200, "{}", sed.text());
    assert_eq!(loads(&service).await, [1, 0], "it was loaded again");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_posted_map_waits_for_the_model_too() {
    let service = start(folder()).await;
    let sed = service.post("/v1/sed?tier=late", bytes_of(&ramp())).send().await;
    assert_eq!(sed.status, 200, "{}", sed.text());
    assert!((floats_of(&sed.body)[50_000] / ramp()[50_000] - GAIN).abs() < 1e-4);
    assert_eq!(loads(&service).await, [1, 0]);
    let service = start(folder()).await;
    let tensor = json!({"name": "pressure_pa", "shape": [1, 1, 224, 224], "datatype": "FP32",
        "data": ramp()});
    let request = json!({"inputs": [tensor]}).to_string();
    let answer = service.post("/v2/models/late/infer", request);
    let answer = answer.header("content-type", "application/json").send().await;
    assert_eq!(answer.status, 200, "{}", answer.text());
    assert_eq!(loads(&service).await, [1, 0]);
}

#[tokio::test(flavor = "multi_thread")]
async fn many_first_uses_at_once_load_it_once() {
    let service = start(folder()).await;
    let address = service.address;
    let clients = (0..12).map(|_| {
        tokio::spawn(async move {
            let mut socket = Socket::connect(address).await.unwrap();
            let ready = socket.open(hello(&json!({"tier": "late"}))).await;
            assert_eq!(ready["tier"], "late");
            gain(&mut socket, 1).await
        })
    });
    for client in clients.collect::<Vec<_>>() {
        assert!((client.await.unwrap() - GAIN).abs() < 1e-4);
    }
    assert_eq!(loads(&service).await, [1, 0]);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_broken_file_is_told_to_whoever_names_it_and_to_nobody_else() {
    for (fault, word) in [
        ("torn", "cut short"),
        ("other", "onnx_sha256"),
        ("wrong", "is off by"),
        ("gone", "holds no late.onnx"),
    ] {
        let models = folder();
        let path = models.path().join("late.onnx");
        let (good, card) = (fs::read(&path).unwrap(), models.path().join("late.json"));
        let good_card = fs::read(&card).unwrap();
        match fault {
            "torn" => fs::write(&path, &good[..good.len() / 2]).unwrap(),
            "other" => {
                add_model_of_gain(models.path(), "late", atlas().hash(), 0, 0.03, 0.7);
                fs::write(&card, &good_card).unwrap();
            }
            // It belongs to its card and answers, but not what the card promises.
            "wrong" => add_model_of_gain(models.path(), "late", atlas().hash(), 0, 0.03, 1.0),
            _ => {}
        }
        let service = start(models).await;
        if fault == "gone" {
            fs::remove_file(&path).unwrap();
        }
        let mut socket = service.socket().await;
        for _ in 0..2 {
            socket.send(hello(&json!({"tier": "late"})).to_string()).await;
            let error = socket.hear_refusal("bad_model").await;
            assert_eq!(error["field"], "tier");
            let message = error["message"].as_str().unwrap();
            let is_named = message.contains(word) || fault == "torn";
            assert!(is_named && message.contains("tier late cannot be loaded"), "{message}");
        }
        // The second one heard what the first had found.
        assert_eq!(loads(&service).await, [0, 1], "{fault}");
        let sed = service.post("/v1/sed?tier=late", bytes_of(&ramp())).send().await;
        sed.assert_refused(422, "bad_model");
        assert_eq!(late(&service).await["loaded"], false);
        // The same session goes on with another tier, and others never knew.
        socket.open(hello(&json!({"tier": "slow"}))).await;
        assert!((gain(&mut socket, 1).await - GAIN).abs() < 1e-4);

        fs::write(&path, &good).unwrap();
        fs::write(&card, &good_card).unwrap();
        reload(&service).await;
        let mut socket = service.socket().await;
        socket.open(hello(&json!({"tier": "late"}))).await;
        assert!((gain(&mut socket, 1).await - GAIN).abs() < 1e-4);
        assert_eq!(loads(&service).await, [1, 1], "{fault}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_file_that_is_missing_at_the_start_ends_it() {
    let models = folder();
    fs::remove_file(models.path().join("late.onnx")).unwrap();
    let error = Service::on(models, |_| ()).await.map(drop).unwrap_err();
    let is_named = matches!(&error, StartError::Missing { file, .. } if file == "late.onnx");
    assert!(is_named, "{error}");
}

#[tokio::test(flavor = "multi_thread")]
async fn no_budget_picks_a_model_on_demand() {
    let service = start(folder()).await;
    let choose = async |asked: &Value| {
        let mut socket = service.socket().await;
        socket.open(hello(asked)).await["tier"].clone()
    };
    // By its card `late` is the most accurate and as fast as the fastest.
    let asked = [1, 1_000_000, 60_000_000].map(|budget_us| json!({"budget_us": budget_us}));
    for asked in asked.iter().chain([&json!({}), &json!({"effects": ["layers"]})]) {
        assert_ne!(choose(asked).await, "late", "{asked}");
    }
    assert_eq!(loads(&service).await, [0, 0]);
    // Nor once it is there.
    assert_eq!(choose(&json!({"tier": "late"})).await, "late");
    for asked in &asked {
        assert_ne!(choose(asked).await, "late", "{asked}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_default_that_settings_name_is_loaded_at_the_start() {
    let name_it = |config: &mut Config| config.default_tier = Some("late".to_owned());
    let service = Service::on(folder(), name_it).await.unwrap();
    let tier = late(&service).await;
    assert_eq!((&tier["on_demand"], &tier["loaded"]), (&json!(false), &json!(true)));
    assert_eq!(loads(&service).await, [0, 0]);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_reload_loads_what_is_in_use_and_nothing_else() {
    let service = start(folder()).await;
    let models = service.models.path();
    add_model_of_gain(models, "late", atlas().hash(), 0, 0.2, 0.51);
    let changes = reload(&service).await;
    assert_eq!(
        (&changes["changed"], &late(&service).await["loaded"]),
        (&json!(["late"]), &json!(false))
    );
    assert_eq!(reload(&service).await["unchanged"], json!(["quick", "slow", "late"]));

    let mut socket = service.socket().await;
    socket.open(hello(&json!({"tier": "late"}))).await;
    assert!((gain(&mut socket, 1).await - 0.51).abs() < 1e-4);
    add_model_of_gain(models, "late", atlas().hash(), 0, 0.2, 0.52);
    assert_eq!(reload(&service).await["changed"], json!(["late"]));
    // The first frame after it finds the new one.
    assert!((gain(&mut socket, 2).await - 0.52).abs() < 1e-4);
    assert_eq!(
        (late(&service).await["loaded"].clone(), loads(&service).await),
        (json!(true), [1, 0])
    );
    // A bad one changes nothing, as with every other tier.
    add_model_of_gain(models, "late", atlas().hash(), 0, 0.01, 1.0);
    service.post("/v1/admin/reload", "").send().await.assert_refused(422, "bad_model");
    assert!((gain(&mut socket, 3).await - 0.52).abs() < 1e-4);
    // What is gone is nobody's but the session's that has it.
    let index = json!({"default": "quick", "models": ["quick", "slow"]});
    write(models, "index.json", index.to_string().as_bytes());
    assert_eq!(reload(&service).await["removed"], json!(["late"]));
    assert!((gain(&mut socket, 4).await - 0.52).abs() < 1e-4);
    let sed = service.post("/v1/sed?tier=late", bytes_of(&ramp())).send().await;
    sed.assert_refused(404, "unknown_tier");
}
