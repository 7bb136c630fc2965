use super::*;

fn rung(name: &str, time_ms: f64, error: f64) -> Rung {
    let spread = Spread { median: error, p95: error };
    let errors = SetErrors {
        samples: 1,
        relative_l2: spread,
        far_field_relative_l2: None,
        peak_error: spread,
        peak_distance_mm: None,
        nail_base_error: None,
        total_energy_error: spread,
        ssim: Similarity { median: 1.0, p5: 1.0 },
    };
    let tract = Percentiles { p50: time_ms, p99: time_ms };
    Rung {
        name: name.into(),
        kind: Kind::Network,
        model: Some(name.into()),
        onnx_sha256: None,
        bytes: None,
        load_ms: None,
        memory_mib: None,
        latency_ms: Some(LatencyByEngine { tract, ort: None }),
        seconds: None,
        reference: false,
        errors: [("s1".to_owned(), errors)].into(),
        refused: 0,
        zero_answer: None,
        pareto: false,
    }
}

#[test]
fn the_front_is_what_nothing_beats() {
    let mut ladder = Ladder {
        format: 1,
        pareto_set: Some("s1".into()),
        rungs: vec![
            rung("fast", 1.0, 0.5),
            rung("slower and worse", 2.0, 0.6),
            rung("as fast and worse", 1.0, 0.55),
            rung("good", 10.0, 0.1),
            rung("as good and slower", 11.0, 0.1),
        ],
        ..Ladder::default()
    };
    let mut unmeasured = rung("unmeasured", 0.1, 0.0);
    unmeasured.errors.clear();
    ladder.rungs.push(unmeasured);
    // One FE state takes 20 s: as points go, the slowest.
    let mut fe = rung("fe", 0.0, 0.01);
    (fe.latency_ms, fe.seconds) = (None, Some(Percentiles { p50: 20.0, p99: 30.0 }));
    ladder.rungs.push(fe);
    ladder.mark_front();
    let front: Vec<&str> =
        ladder.rungs.iter().filter(|r| r.pareto).map(|r| r.name.as_str()).collect();
    assert_eq!(front, ["fast", "good", "fe"]);
    assert_eq!(ladder.rungs.last().and_then(Rung::time_ms), Some(20_000.0));
    let again = Ladder::from_json(&ladder.to_json().unwrap()).unwrap();
    assert_eq!(again, ladder);
    assert_eq!(again.rung_of("good").unwrap().relative_l2("s1"), Some(0.1));
}

#[test]
fn what_the_reference_cannot_tell_apart_is_not_worth_more_time() {
    let mut rungs =
        [("a", 1.0, 0.5), ("b", 2.0, 0.45), ("c", 3.0, 0.41), ("d", 3.0, 0.39), ("e", 4.0, 0.35)]
            .map(|(name, ms, error)| rung(name, ms, error))
            .to_vec();
    for rung in &mut rungs {
        rung.errors = [("reference".to_owned(), rung.errors.remove("s1").unwrap())].into();
    }
    let own = Discretisation { sed_relative_l2: 0.1, how: String::new() };
    let mut ladder = Ladder {
        format: 1,
        pareto_set: Some("reference".into()),
        discretisation_error: Some(own),
        rungs,
        ..Ladder::default()
    };
    let mut marked = || {
        ladder.mark_front();
        let marked = ladder.rungs.iter().filter(|rung| rung.pareto);
        let names = marked.map(|rung| rung.name.clone()).collect::<String>();
        // On another set every difference counts.
        ladder.pareto_set = Some("s1".into());
        for rung in &mut ladder.rungs {
            rung.errors.extend(rung.errors.get("reference").cloned().map(|e| ("s1".to_owned(), e)));
        }
        names
    };
    assert_eq!(marked(), "ad");
    assert_eq!(marked(), "abde");
}

#[test]
fn a_rung_has_a_time_in_each_engine_it_was_measured_in() {
    let mut rung = rung("both", 4.0, 0.1);
    let in_each = |rung: &Rung| [Backend::Tract, Backend::Ort].map(|b| rung.time_ms_in(b));
    assert_eq!(in_each(&rung), [Some(4.0), Some(4.0)]);
    let ort = Some(Percentiles { p50: 3.0, p99: 5.0 });
    rung.latency_ms = rung.latency_ms.map(|latency| LatencyByEngine { ort, ..latency });
    assert_eq!(in_each(&rung), [Some(4.0), Some(3.0)]);
}

#[test]
fn what_is_no_ladder_is_refused() {
    assert!(matches!(Ladder::from_json("{}"), Err(EngineError::BadLadder { .. })));
    let other = Ladder { format: 2, ..Ladder::default() }.to_json().unwrap();
    assert!(matches!(
        Ladder::from_json(&other),
        Err(EngineError::UnsupportedFormat { found: 2, .. })
    ));
}

#[test]
fn kinds_follow_from_the_network() {
    for (network, kind) in [
        (r#"{"kind":"half_space"}"#, Kind::ClosedForm),
        (r#"{"kind":"fe_operator","rank":64}"#, Kind::Operator),
        (r#"{"kind":"s1_unet","base":16}"#, Kind::PublishedUNet),
        (r#"{"kind":"vertex_net"}"#, Kind::Network),
        ("{}", Kind::Network),
    ] {
        assert_eq!(Kind::of_network(&serde_json::from_str(network).unwrap()), kind);
    }
    assert_eq!(serde_json::to_string(&Kind::PublishedUNet).unwrap(), r#""s1_network""#);
}
