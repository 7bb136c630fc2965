//! The load generator against a real service.

use std::{path::Path, process::Command};

use clap::Parser;
use papilla_tests::load::{self, LoadError, Options, Report};
use tempfile::TempDir;

use crate::{
    scene::PRESSED,
    service::{Service, model_folder, replaced, tiny_models},
};

fn models() -> TempDir {
    tiny_models(&PRESSED.atlas, &PRESSED.samples()[1])
}

async fn run(service: &Service, arguments: &[&str]) -> Result<Report, LoadError> {
    let short = ["papilla-load", "--server", &service.address, "--rate-hz", "20"];
    let shorter = ["--duration-s", "1", "--warmup-s", "0.2", "--drain-s", "60"];
    let options = Options::try_parse_from([&short[..], &shorter, arguments].concat()).unwrap();
    load::run(&options).await
}

#[tokio::test(flavor = "multi_thread")]
async fn every_frame_is_accounted_for_and_every_map_is_the_engines() {
    let models = models();
    let folder = models.path().to_str().unwrap();
    let service = Service::on(models.path()).await;
    for sample_type in ["f32", "f16", "u16", "u8"] {
        let arguments = ["--sessions", "2", "--budget-us", "0", "--verify", "--models", folder];
        let arguments = [&arguments[..], &["--sample-type", sample_type]].concat();
        let report = run(&service, &arguments).await.unwrap();
        assert_eq!(report.faults(), Vec::<String>::new(), "{report}");
        assert_eq!(report.frames, 40);
        assert_eq!(report.ok + report.superseded, 40, "{report}");
        assert_eq!(report.missed, 40 - report.ok, "without a deadline any map is in time");
        assert!(report.ok > 0 && report.tier == "tiny", "{report}");
        let times = report.round_trip_us.unwrap();
        assert_eq!(times.count, report.ok);
        assert!(times.p50 <= times.p99 && times.p99 <= times.max);
        assert!(
            times.max >= report.server_us.unwrap().p50,
            "the server's time is part of the trip"
        );
        let verification = report.verification.unwrap();
        assert!(verification.maps >= report.ok && verification.wrong == 0, "{report}");
        assert_eq!(report.exit_code(), 0);
        // An answer says where the time went.
        let (infer, overhead) = (report.infer_us.unwrap(), report.overhead_us.unwrap());
        assert_eq!((infer.count, overhead.count), (report.ok, report.ok));
        assert!(infer.max > 0 && overhead.p50 > 0 && overhead.p50 <= times.max, "{report}");
        let again: Report = serde_json::from_str(&serde_json::to_string(&report).unwrap()).unwrap();
        assert_eq!(again.round_trip_us, report.round_trip_us);
    }
}

/// Two fingers send poses: each frame has its outcome, and the parts of its time add up.
#[tokio::test(flavor = "multi_thread")]
async fn fingers_are_loaded_with_poses_beside_an_echo_of_their_bytes() {
    let service = Service::shipped().await;
    for (what, asks) in [("touch", false), ("summary", true), ("vertices", true)] {
        let arguments = ["--contact", what, "--fingers", "2", "--tier", "nano", "--budget-us", "0"];
        let report = run(&service, &arguments).await.unwrap();
        assert_eq!(report.faults(), Vec::<String>::new(), "{report}");
        assert_eq!(report.frames, 40, "{report}");
        assert!(report.ok > 0 && report.ok + report.superseded == 40, "{report}");
        let (solve, own) = (report.solve_us.unwrap(), report.service_us.unwrap());
        assert_eq!((solve.count, own.count), (report.ok, report.ok));
        assert!(solve.max > 1, "{report}");
        assert_eq!(report.infer_us.unwrap().max > 0, asks, "{report}");
        assert!(report.echo_us.unwrap().p50 > 0, "{report}");
        assert!(report.to_string().contains("bare echo of the bytes"), "{report}");
    }
    // A service without a model says so.
    let models = models();
    let bare = Service::on(models.path()).await;
    let refused = run(&bare, &["--contact", "touch"]).await.unwrap_err();
    assert!(refused.to_string().contains("no contact model"), "{refused}");
}

#[tokio::test(flavor = "multi_thread")]
async fn maps_over_http_and_open_inference_are_the_engines_too() {
    let models = models();
    let folder = models.path().to_str().unwrap();
    let service = Service::on(models.path()).await;
    for speak in ["http", "oip"] {
        let arguments = ["--speak", speak, "--tier", "tiny", "--sessions", "2", "--budget-us", "0"];
        let verify = ["--verify", "--models", folder];
        let report = run(&service, &[&arguments[..], &verify].concat()).await.unwrap();
        assert_eq!(report.faults(), Vec::<String>::new(), "{report}");
        assert_eq!((report.frames, report.ok + report.superseded), (40, 40), "{report}");
        let verification = report.verification.unwrap();
        assert!(report.ok > 0 && verification.maps >= report.ok, "{report}");
        // Nobody is told a tier, and the map of a service that has none is refused.
        let error = run(&service, &["--speak", speak]).await.unwrap_err();
        assert!(matches!(error, LoadError::NoTier), "{error}");
        let other = ["--speak", speak, "--tier", "nobody", "--sessions", "2"];
        let report = run(&service, &other).await.unwrap();
        assert_eq!((report.ok, report.exit_code()), (0, 1), "{report}");
        assert_eq!(report.errors.keys().collect::<Vec<_>>(), ["status 404"], "{report}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn the_floor_is_measured_without_a_service() {
    let floor = load::floor(0.4).await.unwrap();
    let (sleeps, exchange) = (floor.sleeps_late_us, floor.exchange_us);
    assert!(sleeps.count > 10 && exchange.count > 1, "{floor}");
    assert!(exchange.p50 > 0 && exchange.p50 <= exchange.max, "{floor}");
    let [one, two] = floor.sleeps_late_percent;
    assert!((0.0..=100.0).contains(&two) && two <= one && one <= 100.0, "{floor}");
}

#[tokio::test(flavor = "multi_thread")]
async fn misses_are_counted_and_judged() {
    let models = models();
    let service = Service::on(models.path()).await;
    // Nothing is done within a microsecond.
    let report = run(&service, &["--budget-us", "1"]).await.unwrap();
    assert_eq!((report.frames, report.late, report.missed), (20, 20, 20), "{report}");
    assert_eq!(report.exit_code(), 0, "nobody said how many are too many");
    assert!(report.round_trip_us.is_none(), "no map, no time");
    let report = run(&service, &["--budget-us", "1", "--allow-miss-percent", "99"]).await.unwrap();
    assert_eq!(report.exit_code(), 3);
    let report = run(&service, &["--budget-us", "1", "--allow-miss-percent", "100"]).await.unwrap();
    assert_eq!(report.exit_code(), 0);
    // The service need not drop what the client thinks too slow.
    let report = run(&service, &["--budget-us", "0", "--deadline-us", "1"]).await.unwrap();
    assert!(report.ok > 0 && report.late == 0, "{report}");
    assert_eq!((report.missed, report.exit_code()), (20, 0));
}

#[tokio::test(flavor = "multi_thread")]
async fn maps_of_another_model_are_found_out() {
    let models = models();
    let service = Service::on(models.path()).await;
    // The same network, its output greater by a hundred-thousandth.
    let onnx = std::fs::read(models.path().join("tiny.onnx")).unwrap();
    let other = replaced(&onnx, &2_500.0_f32.to_le_bytes(), &2_500.025_f32.to_le_bytes());
    let other = model_folder(&PRESSED.atlas, &PRESSED.samples()[1], &other);
    let folder = other.path().to_str().unwrap();
    let report =
        run(&service, &["--budget-us", "0", "--verify", "--models", folder]).await.unwrap();
    let verification = report.verification.unwrap();
    assert_eq!(verification.wrong, verification.maps, "{report}");
    assert!((0.9e-5..1.1e-5).contains(&verification.difference_max), "{report}");
    assert_eq!(report.exit_code(), 1);
}

#[tokio::test(flavor = "multi_thread")]
async fn what_cannot_be_run_says_why() {
    let models = models();
    let service = Service::on(models.path()).await;
    let error = run(&service, &["--tier", "nobody"]).await.unwrap_err();
    assert!(error.to_string().contains("unknown_tier"), "{error}");
    let error = run(&service, &["--dataset", "/nowhere"]).await.unwrap_err();
    assert!(error.to_string().contains("/nowhere"), "{error}");
    let error = run(&service, &["--verify", "--models", "/nowhere"]).await.unwrap_err();
    assert!(matches!(&error, LoadError::Model { path, .. } if path.starts_with("/nowhere")));
}

#[test]
fn exit_codes_are_the_documented_ones() {
    let program = Path::new(env!("CARGO_BIN_EXE_papilla-load"));
    let run = |arguments: &[&str]| {
        let output = Command::new(program).args(arguments).output().unwrap();
        let said = [output.stdout, output.stderr].concat();
        (output.status.code(), String::from_utf8(said).unwrap())
    };
    let (code, help) = run(&["--help"]);
    assert!(code == Some(0) && help.contains("Exit codes"), "{help}");
    assert_eq!(run(&["--sessions", "none"]).0, Some(2));
    // Port 1 of the loopback: nobody listens there.
    let (code, said) = run(&["--server", "127.0.0.1:1"]);
    assert!(code == Some(1) && said.contains("is the service running"), "{said}");
}

#[tokio::test(flavor = "multi_thread")]
async fn two_services_are_compared_in_turn() {
    let (models, slower) = (models(), models());
    let first = Service::on(models.path()).await;
    let second = Service::on(slower.path()).await;
    let options = Options::try_parse_from([
        "papilla-load",
        "--server",
        &first.address,
        "--rate-hz",
        "50",
        "--duration-s",
        "0.8",
        "--warmup-s",
        "0.1",
        "--drain-s",
        "60",
        "--budget-us",
        "0",
        "--rounds",
        "2",
        "--arrivals",
        "burst",
    ])
    .unwrap();
    let comparison = load::compare(&options, &second.address).await.unwrap();
    for report in [&comparison.server, &comparison.against] {
        assert_eq!(report.faults(), Vec::<String>::new(), "{report}");
        assert_eq!(report.frames, 40, "two turns of 0.4 s at 50 Hz");
        assert!(report.superseded > 0, "bursts of four: {report}");
        assert_eq!(report.ok + report.superseded, 40);
        let (trip, infer) = (report.round_trip_us.unwrap(), report.infer_us.unwrap());
        assert!(infer.p50 > 0 && infer.p50 <= trip.max, "{report}");
        assert!(report.age_us.is_some_and(|age| age.max >= trip.p50), "{report}");
    }
    assert_ne!(comparison.server.server, comparison.against.server);
    let ratio = comparison.ratios.p50.unwrap();
    assert!(ratio.is_finite() && ratio > 0.0, "{comparison}");
    assert_eq!(comparison.exit_code(), 0);
}
