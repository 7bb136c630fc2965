//! Models that change while the service runs.

mod folder;

use std::{fs, path::Path, time::Duration};

use papilla_proto::{FrameStatus, SampleType};
use serde_json::{Value, json};
use tempfile::TempDir;

use crate::support::{
    Answer, GAIN, Service, Socket, add_model, add_model_of_gain, atlas, bytes_of, floats_of, frame,
    hello, model_folder, ramp, write,
};

async fn reload(service: &Service) -> Answer {
    service.post("/v1/admin/reload", "").send().await
}

fn list(folder: &Path, default: &str, models: &[&str]) {
    let index = json!({"default": default, "models": models});
    write(folder, "index.json", index.to_string().as_bytes());
}

/// What the tier multiplies the pressure by, as a session sees it.
async fn gain(socket: &mut Socket, sequence: u32) -> f32 {
    socket.send(frame(sequence, 0, SampleType::F32, 1.0, &ramp())).await;
    let (header, sed) = socket.hear_frame().await;
    assert_eq!((header.sequence, header.status), (sequence, FrameStatus::Ok));
    let (sed, pressure) = (floats_of(&sed), ramp());
    sed[ramp().len() - 1] / pressure[ramp().len() - 1]
}

fn names(tiers: &Value) -> Vec<&str> {
    tiers["tiers"].as_array().unwrap().iter().map(|t| t["name"].as_str().unwrap()).collect()
}

#[tokio::test(flavor = "multi_thread")]
async fn a_changed_model_takes_over_and_sessions_go_on() {
    let service = Service::start_with(|c| c.threads = std::num::NonZeroUsize::new(2)).await;
    let mut socket = service.socket().await;
    socket.open(hello(&json!({"tier": "quick"}))).await;
    assert!((gain(&mut socket, 1).await - 0.5).abs() < 1e-4);

    let answer = reload(&service).await;
    assert_eq!(answer.status, 200, "{}", answer.text());
    let due = json!({"default": "quick", "added": [], "changed": [], "removed": [],
        "unchanged": ["quick", "slow"]});
    assert_eq!(answer.json(), due);

    add_model_of_gain(service.models.path(), "quick", atlas().hash(), 0, 0.2, 0.51);
    let answer = reload(&service).await.json();
    assert_eq!((&answer["changed"], &answer["unchanged"]), (&json!(["quick"]), &json!(["slow"])));
    // Both threads serve it, and from the first frame on.
    for sequence in 2..12 {
        assert!((gain(&mut socket, sequence).await - 0.51).abs() < 1e-4);
    }
    let sed = service.post("/v1/sed?tier=quick", bytes_of(&ramp())).send().await;
    assert!((floats_of(&sed.body)[50_000] / ramp()[50_000] - 0.51).abs() < 1e-4);
    assert_eq!(service.metric("papilla_reloads_total{outcome=\"ok\"}").await as u64, 2);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_bad_model_changes_nothing_and_says_why() {
    let service = Service::start().await;
    let folder = service.models.path();
    let before = service.json("/v1/models").await;
    let mut socket = service.socket().await;
    socket.open(hello(&json!({}))).await;
    let good = fs::read(folder.join("quick.onnx")).unwrap();
    let card = fs::read(folder.join("quick.json")).unwrap();
    let mut sequence = 0;
    for (bad, word) in [
        ("torn", "quick.onnx"),
        ("missing", "quick.onnx"),
        ("of another atlas", "trained on atlas"),
        ("wrong", "is off by"),
        ("nothing", "its answers hold 0.000"),
        ("in kJ/m3", "its answers hold 0.001"),
    ] {
        match bad {
            "torn" => write(folder, "quick.onnx", &good[..good.len() / 2]),
            "missing" => fs::remove_file(folder.join("quick.onnx")).unwrap(),
            "of another atlas" => add_model(folder, "quick", &"f".repeat(64), 0, 0.2),
            // A card that allows any error still wants an answer.
            "nothing" => add_model_of_gain(folder, "quick", atlas().hash(), 0, 3.0, 0.0),
            "in kJ/m3" => add_model_of_gain(folder, "quick", atlas().hash(), 0, 3.0, 1e-3 * GAIN),
            // It loads, belongs to its card and answers; but not what its card promises.
            _ => add_model_of_gain(folder, "quick", atlas().hash(), 0, 0.01, 1.0),
        }
        let answer = reload(&service).await;
        assert!(answer.text().contains(word), "{bad}: {}", answer.text());
        assert!(answer.text().contains("left as they are"), "{bad}: {}", answer.text());
        answer.assert_refused(422, "bad_model");
        sequence += 1;
        assert!((gain(&mut socket, sequence).await - 0.5).abs() < 1e-4, "{bad}");
    }
    assert_eq!(service.json("/v1/models").await, before);
    assert_eq!(service.metric("papilla_reloads_total{outcome=\"refused\"}").await as u64, 6);
    write(folder, "quick.onnx", &good);
    write(folder, "quick.json", &card);
    assert_eq!(reload(&service).await.status, 200);
}

#[tokio::test(flavor = "multi_thread")]
async fn tiers_come_and_go_but_keep_their_sessions() {
    let service = Service::start().await;
    let folder = service.models.path();
    let mut socket = service.socket().await;
    socket.open(hello(&json!({"tier": "slow"}))).await;
    add_model_of_gain(folder, "third", atlas().hash(), 0, 0.1, 0.52);
    list(folder, "third", &["third", "quick"]);
    let answer = reload(&service).await.json();
    assert_eq!((&answer["added"], &answer["removed"]), (&json!(["third"]), &json!(["slow"])));
    let tiers = service.json("/v1/tiers").await;
    assert_eq!((&tiers["default"], names(&tiers)), (&json!("third"), vec!["quick", "third"]));
    // The session that has the tier goes on; a new one does not get it.
    assert!((gain(&mut socket, 1).await - 0.5).abs() < 1e-4);
    let mut late = service.socket().await;
    late.send(hello(&json!({"tier": "slow"})).to_string()).await;
    late.hear_refusal("unknown_tier").await;
    let ready = late.open(hello(&json!({}))).await;
    assert_eq!(ready["tier"], "third");
    assert!((gain(&mut late, 1).await - 0.52).abs() < 1e-4);
    let text = service.get("/metrics").send().await.text();
    assert!(text.contains("papilla_model{tier=\"third\""), "{text}");
    assert!(!text.contains("papilla_model{tier=\"slow\""), "{text}");
    // It comes back to the place it had.
    list(folder, "quick", &["quick", "slow"]);
    let answer = reload(&service).await.json();
    assert_eq!((&answer["added"], &answer["removed"]), (&json!(["slow"]), &json!(["third"])));
    assert!((gain(&mut socket, 2).await - 0.5).abs() < 1e-4);
    assert!((gain(&mut late, 2).await - 0.52).abs() < 1e-4);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_watched_folder_is_read_when_it_changes() {
    let service = Service::start_with(|config| config.watch_models = true).await;
    add_model(service.models.path(), "third", atlas().hash(), 0, 0.1);
    list(service.models.path(), "quick", &["quick", "slow", "third"]);
    while names(&service.json("/v1/tiers").await).len() < 3 {
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
    // Reading the folder must not look like another change: once it is quiet, so is the watch.
    let ok = "papilla_reloads_total{outcome=\"ok\"}";
    let after = service.metric(ok).await;
    tokio::time::sleep(Duration::from_millis(2000)).await;
    assert!(service.metric(ok).await - after < 0.5, "it reads itself in circles");
    service.server.drain().await.unwrap();
}

/// Waits until the service offers so many tiers.
async fn until_tiers(service: &Service, count: usize) {
    let waiting = async {
        while names(&service.json("/v1/tiers").await).len() != count {
            tokio::time::sleep(Duration::from_millis(50)).await;
        }
    };
    let waited = tokio::time::timeout(Duration::from_secs(60), waiting).await;
    waited.expect("the change of the folder was lost");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_change_during_a_manual_reload_is_not_lost() {
    let service = Service::start_with(|config| {
        config.watch_models = true;
        // A new slow tier is measured for so long, after its files were read.
        config.calibration_ms = 4000;
    })
    .await;
    let folder = service.models.path();
    add_model(folder, "third", atlas().hash(), 8, 0.1);
    list(folder, "quick", &["quick", "slow", "third"]);
    let manual = tokio::spawn(service.post("/v1/admin/reload", "").send());
    // It has read the folder, and is at work for longer than the folder must be quiet.
    tokio::time::sleep(Duration::from_millis(1000)).await;
    assert!(!manual.is_finished());
    add_model(folder, "fourth", atlas().hash(), 0, 0.1);
    list(folder, "quick", &["quick", "slow", "third", "fourth"]);
    assert_eq!(manual.await.unwrap().json()["added"], json!(["third"]));
    until_tiers(&service, 4).await;
    assert!(service.metric("papilla_reloads_total{outcome=\"busy\"}").await > 0.5);
    service.server.drain().await.unwrap();
}

/// As deployments do it: `current` leads to the folder that is served, and is turned to the next.
#[cfg(unix)]
#[tokio::test(flavor = "multi_thread")]
async fn a_link_that_is_turned_is_followed_and_so_are_edits_where_it_leads() {
    use std::os::unix::fs::symlink;
    let [first, second] = [model_folder(), model_folder()];
    add_model(second.path(), "third", atlas().hash(), 0, 0.1);
    list(second.path(), "quick", &["quick", "slow", "third"]);
    let place = tempfile::tempdir().unwrap();
    let turn = |folder: &TempDir| {
        // As `ln -sfn` does: made beside it, and renamed.
        let next = place.path().join("next");
        symlink(folder.path(), &next).unwrap();
        std::fs::rename(next, place.path().join("current")).unwrap();
    };
    turn(&first);
    let current = place.path().join("current");
    let service = Service::on(model_folder(), |config| {
        config.models = Some(current);
        config.watch_models = true;
    })
    .await
    .unwrap();
    assert_eq!(names(&service.json("/v1/tiers").await).len(), 2);
    turn(&second);
    until_tiers(&service, 3).await;
    // And where it leads now.
    add_model(second.path(), "fourth", atlas().hash(), 0, 0.1);
    list(second.path(), "quick", &["quick", "slow", "third", "fourth"]);
    until_tiers(&service, 4).await;
    let looked_at = service.metric("papilla_models_looked_at_timestamp_seconds").await;
    let now = std::time::SystemTime::UNIX_EPOCH.elapsed().unwrap().as_secs_f64();
    assert!((0.0..60.0).contains(&(now - looked_at)), "{looked_at} at {now}");
    // What only the looks of our own find, where it leads, is not what the link says now.
    turn(&first);
    until_tiers(&service, 2).await;
    service.server.drain().await.unwrap();
}

/// Files as an editor on Windows writes them.
#[tokio::test(flavor = "multi_thread")]
async fn a_byte_order_mark_before_a_file_is_passed_over_and_utf_16_is_named() {
    let folder = model_folder();
    for name in ["index.json", "atlas.json", "replay.json", "quick.json"] {
        let text = std::fs::read_to_string(folder.path().join(name)).unwrap();
        write(folder.path(), name, format!("\u{feff}{text}").as_bytes());
    }
    let service = Service::on(folder, |_| ()).await.unwrap();
    assert!(service.get("/v1/atlas").send().await.body.starts_with(b"{"), "clients get it without");
    let mut socket = service.socket().await;
    socket.send(format!("\u{feff}{}", hello(&json!({})))).await;
    assert_eq!(socket.hear_json().await["type"], "ready");
    let body = format!("\u{feff}{}", json!({"pressure_pa": ramp()}));
    let posted = service.post("/v1/sed", body).header("content-type", "application/json");
    assert_eq!(posted.send().await.status, 200);
    let text = std::fs::read_to_string(service.models.path().join("quick.json")).unwrap();
    let wide: Vec<u8> = text.encode_utf16().flat_map(u16::to_le_bytes).collect();
    write(service.models.path(), "quick.json", &wide);
    let refused = service.post("/v1/admin/reload", "").send().await;
    assert!(refused.text().contains("quick.json"), "{}", refused.text());
    assert!(refused.text().contains("UTF-16"), "{}", refused.text());
    refused.assert_refused(422, "bad_model");
}
