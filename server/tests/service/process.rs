//! The binary itself: settings, `check`, signals.

use std::{
    net::TcpListener,
    process::{Output, Stdio},
    time::Duration,
};

use papilla_proto::{FrameStatus, SampleType};
use serde_json::{Value, json};
use tokio::time::{sleep, timeout};

use crate::support::{
    Logged, Received, Request, Running, Socket, add_model_of_gain, atlas, bytes_of, frame, hello,
    metric_at, model_folder, papilla, ramp, signal, write,
};

/// Longest wait for what comes within seconds; only a hang takes longer.
const HANG: Duration = Duration::from_secs(60);

fn run(args: &[&str]) -> (Option<i32>, String, String) {
    let Output { status, stdout, stderr } = papilla(args).output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    (status.code(), text(stdout), text(stderr))
}

#[test]
fn settings_are_printed_so_that_they_read_back() {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), "a.toml", b"max_sessions = 3\nthreads = 2\n");
    let file = folder.path().join("a.toml");
    let output = papilla(&["--config", file.to_str().unwrap(), "--print-config"])
        .env("PAPILLA_THREADS", "5")
        .env("PAPILLA_ALLOW_ORIGIN", "https://a.example,https://b.example")
        .output()
        .unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    for line in [
        "max_sessions = 3 # file",
        "threads = 5 # environment",
        "allow_origin = [\"https://a.example\", \"https://b.example\"] # environment",
        "bind = \"127.0.0.1:7224\" # default",
    ] {
        assert!(text.contains(line), "{line} is not in\n{text}");
    }
    write(folder.path(), "b.toml", text.as_bytes());
    let (code, again, _) =
        run(&["--config", folder.path().join("b.toml").to_str().unwrap(), "--print-config"]);
    assert_eq!(code, Some(0));
    let values = |text: &str| text.parse::<toml::Table>().unwrap();
    assert_eq!(values(&again), values(&text));
}

#[test]
fn what_cannot_be_used_is_refused_with_its_name() {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), "bad.toml", b"max_session = 3\n");
    let file = folder.path().join("bad.toml");
    for (args, word) in [
        (vec!["--config", file.to_str().unwrap()], "max_session"),
        (vec!["--threads", "none"], "--threads"),
        (vec!["--bind", "0.0.0.0:0"], "bind"),
        (vec!["--log", "papilla=loud"], "log"),
        (vec!["--tls-cert", "c.pem"], "tls_key"),
    ] {
        let (code, _, error) = run(&args);
        assert_eq!(code, Some(2), "{args:?}: {error}");
        assert!(error.contains(word), "{args:?}: {error}");
    }
}

#[test]
fn check_finds_what_would_keep_it_from_serving() {
    let models = model_folder();
    let path = models.path().to_str().unwrap();
    let base = ["check", "--models", path, "--calibration-ms", "1", "--bind", "127.0.0.1:0"];
    let with = |more: &[&str]| run(&[&base[..], more].concat());
    let (code, text, error) = with(&["--json"]);
    assert_eq!(code, Some(0), "{text}{error}");
    let report: Value = serde_json::from_str(&text).unwrap();
    let whats: Vec<_> = report["findings"]
        .as_array()
        .unwrap()
        .iter()
        .map(|f| f["what"].as_str().unwrap())
        .collect();
    for what in ["settings", "atlas", "calibration", "model quick", "model slow", "port", "memory"]
    {
        assert!(whats.contains(&what), "{what} is not in {whats:?}");
    }
    let (code, text, _) = with(&[]);
    assert_eq!(code, Some(0), "{text}");
    assert!(text.contains("everything is in order"), "{text}");

    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = taken.local_addr().unwrap().to_string();
    let (code, text, _) = run(&["check", "--models", path, "--bind", &address]);
    assert_eq!(code, Some(4), "{text}");
    assert!(text.contains("FAILED port") && text.contains(&address), "{text}");

    let no_model = models.path().join("index.json");
    let (code, text, _) = with(&["--contact", no_model.to_str().unwrap()]);
    assert_eq!(code, Some(3), "{text}");
    assert!(text.contains("FAILED contact") && text.contains("fe-datagen contact"), "{text}");

    add_model_of_gain(models.path(), "quick", atlas().hash(), 0, 0.01, 1.0);
    let (code, text, _) = with(&[]);
    assert_eq!(code, Some(3), "{text}");
    assert!(text.contains("FAILED model quick"), "{text}");
    write(models.path(), "atlas.json", b"{}");
    let (code, text, _) = with(&["--json"]);
    assert_eq!(code, Some(3), "{text}");
    assert!(serde_json::from_str::<Value>(&text).unwrap()["ok"] == json!(false));
}

#[tokio::test(flavor = "multi_thread")]
async fn sigterm_answers_what_was_accepted_and_ends() {
    let models = model_folder();
    let mut running = Running::start(models.path());
    let mut socket = Socket::connect(running.address).await.unwrap();
    socket.open(hello(&json!({"tier": "slow"}))).await;
    socket.send(frame(1, 0, SampleType::F32, 1.0, &ramp())).await;
    // The answer to what comes after a frame says that the frame was taken.
    socket.send("?").await;
    socket.hear_refusal("unexpected_text").await;
    running.signal("TERM");
    let (header, _) = socket.hear_frame().await;
    assert_eq!((header.sequence, header.status), (1, FrameStatus::Ok));
    socket.hear_end("shutting_down", 1001).await;
    assert!(matches!(socket.receive().await, Received::Closed(_)));
    drop(socket);
    let status = loop {
        match running.child.try_wait().unwrap() {
            Some(status) => break status,
            None => sleep(Duration::from_millis(20)).await,
        }
    };
    assert_eq!(status.code(), Some(0));
}

#[tokio::test(flavor = "multi_thread")]
async fn sighup_loads_the_models_anew_and_does_not_end_the_service() {
    let models = model_folder();
    let mut running = Running::start(models.path());
    let reloads = r#"papilla_reloads_total{outcome="ok"}"#;
    let before = metric_at(running.address, reloads).await;
    running.signal("HUP");
    let reloaded = async {
        while metric_at(running.address, reloads).await < before + 0.5 {
            assert!(running.child.try_wait().unwrap().is_none(), "SIGHUP ended it");
            sleep(Duration::from_millis(20)).await;
        }
    };
    timeout(HANG, reloaded).await.expect("nothing is loaded anew");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_signal_ends_a_start_at_once() {
    let models = model_folder();
    // A minute for each of two runs would do; the signal comes long before.
    let mut child = papilla(&["--bind", "127.0.0.1:0", "--calibration-ms", "3600000"])
        .args(["--models", models.path().to_str().unwrap(), "--log", "error"])
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    // Long enough for the signal to be listened for; before that it kills, which ends it too.
    sleep(Duration::from_millis(300)).await;
    signal(&child, "INT");
    let ended = async {
        while child.try_wait().unwrap().is_none() {
            sleep(Duration::from_millis(20)).await;
        }
    };
    let is_ended = timeout(HANG, ended).await.is_ok();
    let _ = child.kill();
    assert!(is_ended, "Ctrl-C does not end the start");
}

#[test]
fn a_variable_beyond_its_range_is_refused_with_it() {
    for (name, bad, range) in [
        ("PAPILLA_MAX_SESSIONS", "18446744073709551615", "1 to 10000"),
        ("PAPILLA_MAX_CONNECTIONS", "18446744073709551615", "1 to 100000"),
        ("PAPILLA_IO_TIMEOUT_S", "9223372036854775807", "1 to 86400"),
    ] {
        let output = papilla(&["--print-config"]).env(name, bad).output().unwrap();
        let error = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{name}: {error}");
        assert!(error.contains(range), "{name}: {error}");
    }
}

/// Connections are taken at once; how far the start has come is said until it is over.
#[tokio::test(flavor = "multi_thread")]
async fn it_listens_while_its_models_are_loaded_and_measured() {
    let models = model_folder();
    let address = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    let child = papilla(&["--models", models.path().to_str().unwrap(), "--threads", "1"])
        .args(["--bind", &address.to_string(), "--calibration-ms", "3000", "--log", "error"])
        .args(["--rate-per-s", "0"])
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    let _running = Running { child, address, started: serde_json::Value::Null };
    while tokio::net::TcpStream::connect(address).await.is_err() {
        sleep(Duration::from_millis(10)).await;
    }
    // It waits for the models, and is answered.
    let early =
        tokio::spawn(Request::new(address, "POST", "/v1/sed").body(bytes_of(&ramp())).send());
    let mut seen = Vec::new();
    loop {
        let ready = Request::new(address, "GET", "/readyz").send().await;
        if ready.status == 200 {
            break;
        }
        assert_eq!(ready.header("retry-after"), Some("1"));
        ready.assert_refused(503, "overloaded");
        seen.push(ready.json());
        let health = Request::new(address, "GET", "/healthz").send().await;
        assert_eq!((health.status, health.json()), (200, json!({"status": "ok"})));
        let oip = Request::new(address, "GET", "/v2/health/ready").send().await;
        let live = Request::new(address, "GET", "/v2/health/live").send().await;
        assert_eq!(live.status, 200);
        assert!(oip.status == 503 || oip.status == 200, "{}", oip.text());
    }
    assert_eq!(early.await.unwrap().status, 200);
    let stages: Vec<_> = seen.iter().map(|body| body["stage"].as_str().unwrap()).collect();
    assert!(stages.contains(&"calibrating"), "{stages:?}");
    for body in &seen {
        let count = |list: &str| body[list].as_array().unwrap().len();
        assert_eq!(body["status"], "starting");
        if body["stage"] == "calibrating" {
            assert_eq!(count("tiers_done") + count("tiers_left"), 2, "{body}");
        }
    }
    let measured = seen.iter().find(|body| body["tiers_done"] == json!(["quick"]));
    assert!(measured.is_some(), "the fastest is measured first: {seen:?}");
}

#[test]
fn a_log_that_no_terminal_shows_has_no_colours() {
    let folder = model_folder();
    let logged = Logged::start(folder.path(), &["--log", "info"]);
    let log = logged.log();
    assert!(log.contains("INFO"), "{log}");
    assert!(!log.contains('\u{1b}'), "{log:?}");
}
