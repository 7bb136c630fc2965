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
        (vec!["--log", "[[["], "papilla_server=debug"),
        (vec!["--log", "verbose"], "papilla_server=debug"),
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
    for what in [
        "settings",
        "atlas",
        "threads",
        "calibration",
        "model quick",
        "model slow",
        "port",
        "descriptors",
        "memory",
    ] {
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

/// The binary in a shell that does so much before it.
#[cfg(target_os = "linux")]
fn in_shell(before: &str, args: &[&str], after: &str) -> std::process::Output {
    let line = format!("{before} exec \"$0\" \"$@\" {after}");
    let mut command = std::process::Command::new("sh");
    command.args(["-c", &line, env!("CARGO_BIN_EXE_papilla-server")]).args(args);
    command.output().unwrap()
}

/// Whoever reads nothing gets an exit code, and no panic (101).
#[cfg(target_os = "linux")]
#[test]
fn outputs_that_take_nothing_end_it_cleanly() {
    let models = model_folder();
    let path = models.path().to_str().unwrap();
    let check = ["check", "--models", path, "--calibration-ms", "0", "--bind", "127.0.0.1:0"];
    for (args, after, code) in [
        (&["--print-config"][..], ">/dev/full 2>/dev/full", 1),
        (&check[..], ">/dev/full 2>/dev/full", 1),
        (&["--bind", "nowhere"], ">/dev/full 2>/dev/full", 2),
        (&["--models", "/no/such/folder", "--bind", "127.0.0.1:0"], ">/dev/full 2>/dev/full", 3),
        (&["--models", "/no/such/folder", "--bind", "127.0.0.1:0"], ">&- 2>&-", 3),
        (&["--help"], ">/dev/full 2>/dev/full", 0),
    ] {
        let output = in_shell("", args, after);
        assert_eq!(output.status.code(), Some(code), "{args:?} {after}");
    }
    // A pipe whose reader is gone: it has read enough.
    for args in [&["--print-config"][..], &check[..]] {
        let line = r#"exec 3>&1; ("$0" "$@"; echo $? >&3) | true"#;
        let mut command = std::process::Command::new("sh");
        command.args(["-c", line, env!("CARGO_BIN_EXE_papilla-server")]).args(args);
        let output = command.output().unwrap();
        let code = String::from_utf8_lossy(&output.stdout);
        assert_eq!(code.trim(), "0", "{args:?}: {}", String::from_utf8_lossy(&output.stderr));
    }
}

/// A service whose outputs are full or closed serves on.
#[cfg(target_os = "linux")]
#[tokio::test(flavor = "multi_thread")]
async fn a_service_that_nobody_reads_serves_on() {
    let models = model_folder();
    let address = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    let full = || std::fs::File::options().write(true).open("/dev/full").unwrap();
    let child = papilla(&["--models", models.path().to_str().unwrap(), "--threads", "1"])
        .args(["--bind", &address.to_string(), "--calibration-ms", "1", "--log", "debug"])
        .stdout(full())
        .stderr(full())
        .spawn()
        .unwrap();
    let mut running = Running { child, address, started: serde_json::Value::Null };
    let ready = async {
        while tokio::net::TcpStream::connect(address).await.is_err() {
            assert!(running.child.try_wait().unwrap().is_none(), "it has ended");
            sleep(Duration::from_millis(20)).await;
        }
        let answer = Request::new(address, "POST", "/v1/sed").body(bytes_of(&ramp())).send().await;
        assert_eq!(answer.status, 200);
    };
    timeout(HANG, ready).await.expect("it does not serve");
    running.signal("TERM");
    let ended = async {
        loop {
            match running.child.try_wait().unwrap() {
                Some(status) => break status,
                None => sleep(Duration::from_millis(20)).await,
            }
        }
    };
    assert_eq!(timeout(HANG, ended).await.expect("it does not end").code(), Some(0));
}

/// The soft limit is raised; a hard one that is too small is said at the start, and by `check`.
#[cfg(target_os = "linux")]
#[test]
fn too_few_file_descriptors_are_said_at_the_start() {
    let models = model_folder();
    let path = models.path().to_str().unwrap();
    let check = ["check", "--models", path, "--calibration-ms", "0", "--bind", "127.0.0.1:0"];
    let raised = in_shell("ulimit -Sn 100;", &check, "");
    assert_eq!(raised.status.code(), Some(0), "{}", String::from_utf8_lossy(&raised.stdout));
    let few = in_shell("ulimit -n 100;", &check, "");
    let text = String::from_utf8_lossy(&few.stdout);
    assert_eq!(few.status.code(), Some(2), "{text}");
    assert!(text.contains("FAILED descriptors") && text.contains("ulimit -Hn"), "{text}");
    // The port is taken, so that the service ends after it has said so.
    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = taken.local_addr().unwrap().to_string();
    let serve = ["--models", path, "--bind", &address];
    for (limit, word) in [("ulimit -Sn 100;", "is raised"), ("ulimit -n 100;", "max_connections")] {
        let output = in_shell(limit, &serve, "");
        let log = String::from_utf8_lossy(&output.stderr);
        assert!(log.contains(word), "{limit} {log}");
    }
}

#[test]
fn one_tier_is_announced_in_whole_words() {
    let models = model_folder();
    let index = json!({"default": "quick", "models": ["quick"]}).to_string();
    // As an editor on Windows writes it.
    write(models.path(), "index.json", format!("\u{feff}{index}").as_bytes());
    let mut child = papilla(&["--models", models.path().to_str().unwrap(), "--threads", "2"])
        .args(["--bind", "127.0.0.1:0", "--calibration-ms", "1", "--log", "error"])
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut line = String::new();
    let stdout = child.stdout.take().unwrap();
    std::io::BufRead::read_line(&mut std::io::BufReader::new(stdout), &mut line).unwrap();
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(line.ends_with("serves tier quick on 2 threads.\n"), "{line:?}");
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

/// Each line of a log for programs is an object, whose members name the event, its time and its level.
#[test]
fn a_log_for_programs_is_an_object_a_line() {
    let folder = model_folder();
    let logged = Logged::start(folder.path(), &["--log", "info", "--log-format", "json"]);
    let log = logged.log();
    let lines: Vec<Value> =
        log.lines().map(|line| serde_json::from_str(line).expect("an object")).collect();
    assert!(lines.len() > 1, "{log}");
    for line in &lines {
        for member in ["timestamp", "level", "target", "message"] {
            assert!(line[member].is_string(), "{member}: {line}");
        }
        assert!(line["timestamp"].as_str().is_some_and(|time| time.ends_with('Z')), "{line}");
    }
    assert!(lines.iter().any(|line| line["level"] == "INFO"), "{log}");
}
