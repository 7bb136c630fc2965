//! The ladder: published, measured on this machine, and what tiers are chosen by.

use std::time::Duration;

use papilla_engine::{Backend, Choice};
use papilla_proto::{FrameStatus, Window};
use papilla_server::{Config, StartError};
use serde_json::{Value, json};
use tokio::time::timeout;

use crate::{
    effects::windowed,
    support::{Service, atlas, contact, hello, model_folder, model_folder_on, ramp, write},
};

/// A rung as `model-export ladder` writes it.
fn rung(name: &str, model: Option<&str>, ms: f64, error: f64) -> Value {
    let spread = json!({"median": error, "p95": 2.0 * error});
    let errors = json!({"samples": 3, "relative_l2": spread, "far_field_relative_l2": null,
        "peak_error": spread, "peak_distance_mm": spread, "nail_base_error": null,
        "total_energy_error": spread, "ssim": {"median": 0.9, "p5": 0.8}});
    let (latency, seconds) = match model {
        Some(_) => (json!({"tract": {"p50": ms, "p99": ms}, "ort": null}), Value::Null),
        None => (Value::Null, json!({"p50": ms / 1e3, "p99": ms / 1e3})),
    };
    let kind = if model.is_some() { "network" } else { "fe" };
    json!({"name": name, "kind": kind, "model": model, "bytes": null, "load_ms": null,
        "memory_mib": null, "latency_ms": latency, "seconds": seconds,
        "errors": {"heldout-presses": errors}, "pareto": true})
}

/// By this ladder, other than by the cards, `quick` is the more accurate.
fn ladder() -> Value {
    let sets =
        json!([{"name": "heldout-presses", "samples": 3}, {"name": "pressed", "samples": 0}]);
    json!({"format": 1, "atlas_hash": atlas().hash(), "machine": "another", "sets": sets,
        "rungs": [rung("quick", Some("quick"), 4.0, 0.01), rung("slow", Some("slow"), 9.0, 0.02),
                  rung("fe-medium", None, 30_000.0, 0.03)]})
}

async fn with(ladder: &Value, calibration_ms: u64) -> Result<Service, StartError> {
    let models = model_folder();
    write(models.path(), "ladder.json", ladder.to_string().as_bytes());
    Service::on(models, |config: &mut Config| config.calibration_ms = calibration_ms).await
}

#[tokio::test(flavor = "multi_thread")]
async fn tiers_are_chosen_by_the_ladder_and_it_is_published() {
    let service = with(&ladder(), 1).await.unwrap();
    let tiers = service.json("/v1/tiers").await;
    assert_eq!(tiers["judged_on"], "heldout-presses");
    assert_eq!(tiers["tiers"][0]["relative_l2_median"], 0.01);
    assert_eq!(tiers["ladder"]["rungs"][2]["name"], "fe-medium");
    assert_eq!(tiers["ladder"]["rungs"][2]["seconds"]["p50"], 30.0);
    let mut socket = service.socket().await;
    let ready = socket.open(hello(&json!({"budget_us": 60_000_000}))).await;
    assert_eq!(ready["tier"], "quick", "the card says slow, the ladder says quick");
}

#[tokio::test(flavor = "multi_thread")]
async fn what_runs_a_tier_is_told() {
    let tract = |config: &mut Config| config.backend = Choice::Only(Backend::Tract);
    let service = Service::start_with(tract).await;
    let tiers = service.json("/v1/tiers").await;
    let backend = tiers["tiers"][0]["backend"].as_str().unwrap();
    assert!(backend.starts_with("tract "), "{backend}");
    let metrics = service.get("/metrics").send().await.text();
    let line = metrics.lines().find(|line| line.starts_with("papilla_model{tier=\"quick\""));
    assert!(line.is_some_and(|line| line.contains(&format!("backend=\"{backend}\""))), "{metrics}");
}

#[tokio::test(flavor = "multi_thread")]
async fn this_machine_has_the_last_word_on_times() {
    let service = with(&ladder(), 1).await.unwrap();
    let tiers = service.json("/v1/tiers").await;
    let tier = |i: usize| tiers["tiers"][i].clone();
    let p50 = |i: usize| tier(i)["calibrated_us"]["p50"].as_f64().unwrap();
    assert!(p50(0) < p50(1), "{tiers}");
    assert!(tier(1)["calibrated_us"]["p99"].as_f64().unwrap() >= p50(1));
    let overhead = tiers["overhead_us"].as_u64().unwrap();
    assert_eq!(tier(1)["predicted_latency_us"].as_u64().unwrap(), p50(1) as u64 + overhead);
    // Without a calibration the shipped times stand: 4 and 9 ms.
    let service = with(&ladder(), 0).await.unwrap();
    let tiers = service.json("/v1/tiers").await;
    assert_eq!(tiers["tiers"][0]["calibrated_us"], Value::Null);
    let overhead = tiers["overhead_us"].as_u64().unwrap();
    assert_eq!(tiers["tiers"][0]["predicted_latency_us"], 4_000 + overhead);
    assert_eq!(tiers["tiers"][1]["predicted_latency_us"], 9_000 + overhead);
}

/// The slow tier takes its three runs whatever its share of the time, and no tier more than that.
#[tokio::test(flavor = "multi_thread")]
async fn a_calibration_measures_every_tier_and_ends() {
    let ladder = ladder();
    let calibrated = timeout(Duration::from_secs(120), with(&ladder, 600));
    let service = calibrated.await.expect("still calibrating").unwrap();
    for tier in service.json("/v1/tiers").await["tiers"].as_array().unwrap() {
        assert!(tier["calibrated_us"]["p50"].as_f64().unwrap() > 0.0, "{tier}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn figures_of_another_file_do_not_count() {
    let mut ladder = ladder();
    ladder["rungs"][0]["onnx_sha256"] = json!("0".repeat(64));
    let service = with(&ladder, 0).await.unwrap();
    let tiers = service.json("/v1/tiers").await;
    assert_eq!(tiers["judged_on"], Value::Null, "not all tiers were measured");
    assert_eq!(tiers["tiers"][0]["relative_l2_median"], 0.2, "the card's");
    let names: Vec<&Value> =
        tiers["ladder"]["rungs"].as_array().unwrap().iter().map(|rung| &rung["name"]).collect();
    assert_eq!(names, ["slow", "fe-medium"]);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_damaged_ladder_is_named() {
    let mut stranger = ladder();
    stranger["atlas_hash"] = json!("f".repeat(64));
    for bad in [json!({}), stranger] {
        let error = with(&bad, 0).await.map(drop).unwrap_err();
        let named = matches!(&error, StartError::Unusable { file, .. } if file == "ladder.json");
        assert!(named, "{error}");
    }
}

/// `slow` takes 48 ms on a busy machine, however quick its shipped time says it is: a calibration
/// that was skipped may begin with it, and no more than ten frames are late before it is left.
#[tokio::test(flavor = "multi_thread")]
async fn a_budget_is_kept_although_the_calibration_was_skipped() {
    let mut ladder = ladder();
    ladder["rungs"][0] = rung("quick", Some("quick"), 0.5, 0.2);
    ladder["rungs"][1] = rung("slow", Some("slow"), 1.0, 0.1);
    let service = with(&ladder, 0).await.unwrap();
    let mut socket = service.socket().await;
    let ready = socket.open(hello(&json!({"budget_us": 5_000}))).await;
    assert_eq!((&ready["tier"], &ready["tier_names"]), (&json!("slow"), &json!(["quick", "slow"])));
    let mut late = 0;
    for sequence in 1..100 {
        socket.send(windowed(sequence, 0, Window::WHOLE, &ramp())).await;
        let (header, _) = socket.hear_frame().await;
        let tier = header.tier;
        if tier == 0 {
            assert!((1..=10).contains(&late), "{late} late frames");
            return;
        }
        assert_eq!(header.status, FrameStatus::Late, "by tier {tier}");
        late += 1;
    }
    panic!("{late} late frames, and none by another tier");
}

/// `quick` learnt the pressure of simulations and `slow` that of contact. Each is more accurate, as
/// it learnt more of what it is given, and no client has to know that.
#[tokio::test(flavor = "multi_thread")]
async fn sessions_get_the_network_that_learnt_what_they_give() {
    let mut ladder = ladder();
    ladder["atlas_hash"] = json!(contact::atlas().hash());
    // From the pressure of simulations `quick` errs less, from poses `slow`, in the same time.
    ladder["rungs"][1] = rung("slow", Some("slow"), 4.0, 0.02);
    for (place, error) in [0.04, 0.03].into_iter().enumerate() {
        let of_simulations = ladder["rungs"][place]["errors"]["heldout-presses"].clone();
        let errors = &mut ladder["rungs"][place]["errors"];
        errors["poses"] = of_simulations;
        errors["poses"]["relative_l2"]["median"] = json!(error);
    }
    for ladder in [Some(ladder), None] {
        let models = model_folder_on(&contact::atlas());
        write(models.path(), "finger.contact", &contact::model());
        let path = models.path().join("slow.json");
        let text = std::fs::read_to_string(&path).unwrap();
        let mut card: Value = serde_json::from_str(&text).unwrap();
        card["training"] = json!({"contact": ["presses.npz"], "contact_alone": true});
        write(models.path(), "slow.json", card.to_string().as_bytes());
        let index = json!({"default": "slow", "default_for_pressure": "quick",
            "models": ["quick", "slow"]});
        write(models.path(), "index.json", index.to_string().as_bytes());
        if let Some(ladder) = &ladder {
            write(models.path(), "ladder.json", ladder.to_string().as_bytes());
        }
        let service = Service::on(models, |config: &mut Config| config.calibration_ms = 0);
        let service = service.await.unwrap();
        let listed = service.json("/v1/tiers").await;
        assert_eq!(
            (&listed["default"], &listed["default_for_pressure"]),
            (&json!("slow"), &json!("quick"))
        );
        let learnt = [0, 1].map(|tier| listed["tiers"][tier]["learnt"].clone());
        assert_eq!(learnt, [json!("fe"), json!("contact")]);
        let from_poses = listed["tiers"][1]["relative_l2_median_from_poses"].as_f64();
        assert_eq!(from_poses, ladder.as_ref().map(|_| 0.03));
        for budget in [json!({}), json!({"budget_us": 60_000_000}), json!({"budget_us": 1})] {
            let mut socket = service.socket().await;
            assert_eq!(socket.open(hello(&budget)).await["tier"], "quick", "{budget}, {ladder:?}");
            let mut socket = service.socket().await;
            let ready = socket.open(contact::ball_hello(&budget)).await;
            assert_eq!(ready["tier"], "slow", "{budget}, {ladder:?}");
        }
        // Whoever names a tier gets it, and is told of the other one.
        let named = json!({"tier": "quick"});
        let mut socket = service.socket().await;
        let ready = socket.open(contact::ball_hello(&named)).await;
        assert_eq!(
            (&ready["tier"], &ready["warnings"][0]["member"]),
            (&json!("quick"), &json!("tier"))
        );
        assert!(ready["warnings"][0]["question"].as_str().unwrap().contains("that of slow"));
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_tier_that_is_worse_and_slower_is_taken_by_name_alone() {
    let mut ladder = ladder();
    ladder["rungs"][1]["latency_ms"]["tract"]["p50"] = json!(3.7);
    let service = with(&ladder, 0).await.unwrap();
    let tiers = service.json("/v1/tiers").await;
    // `slow` errs by 2 % in 3.7 ms, which is no tenth less than the 4 ms in which `quick` errs by 1 %.
    let why = [0, 1].map(|tier| tiers["tiers"][tier]["named_only"].clone());
    assert_eq!(why, [Value::Null, json!("outdone")]);
    for budget_us in [1, 4_300, 60_000_000] {
        let mut socket = service.socket().await;
        let ready = socket.open(hello(&json!({"budget_us": budget_us}))).await;
        assert_eq!(ready["tier"], "quick", "{budget_us} us");
    }
    let mut socket = service.socket().await;
    assert_eq!(socket.open(hello(&json!({"tier": "slow"}))).await["tier"], "slow");
}
