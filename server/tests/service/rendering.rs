//! `POST /v1/sed`: what is right comes back rendered, what is wrong comes back named.

use papilla_proto::{MAP_LEN, SampleType};
use serde_json::json;

use crate::support::{
    PRESSURE_MAX_PA, SED_MAX, Service, assert_rendered, atlas_of_skin, bytes_of, floats_of, frame,
    hello, model_folder_on, ramp,
};

fn npy(descr: &str, shape: &str, data: &[u8]) -> Vec<u8> {
    let dict = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}");
    let mut file = b"\x93NUMPY\x01\x00".to_vec();
    file.extend((dict.len() as u16).to_le_bytes());
    file.extend(dict.as_bytes());
    file.extend(data);
    file
}

fn gray_png(depth: png::BitDepth, data: &[u8]) -> Vec<u8> {
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, 224, 224);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(depth);
    encoder.write_header().unwrap().write_image_data(data).unwrap();
    file
}

const OCTETS: &str = "application/octet-stream";

#[tokio::test(flavor = "multi_thread")]
async fn every_way_in_renders_the_same() {
    let service = Service::start().await;
    let map = ramp();
    let doubles: Vec<u8> = map.iter().flat_map(|&p| f64::from(p).to_le_bytes()).collect();
    let exact = |_: f32| 1e-3;
    for (content_type, body) in [
        (OCTETS, bytes_of(&map)),
        ("application/x-www-form-urlencoded", bytes_of(&map)),
        ("application/x-npy", npy("<f4", "(224, 224)", &bytes_of(&map))),
        ("application/x-npy", npy("<f8", "(1, 1, 224, 224)", &doubles)),
        ("application/json", json!({"pressure_pa": map}).to_string().into_bytes()),
    ] {
        let answer = service.post("/v1/sed", body).header("content-type", content_type).send();
        let answer = answer.await;
        assert_eq!(answer.status, 200, "{content_type}: {}", answer.text());
        assert_eq!(answer.header("content-type"), Some(OCTETS));
        assert_eq!(answer.header("x-papilla-tier"), Some("quick"));
        for name in ["x-papilla-queue-us", "x-papilla-infer-us", "x-papilla-total-us"] {
            assert!(answer.header(name).unwrap().parse::<u64>().is_ok(), "{name}");
        }
        assert_rendered(&map, &floats_of(&answer.body), exact);
    }
    let units = |max: f32| map.iter().map(move |p| (p / PRESSURE_MAX_PA * max).round());
    let words: Vec<u8> = units(65_535.0).flat_map(|u| (u as u16).to_be_bytes()).collect();
    let octets: Vec<u8> = units(255.0).map(|u| u as u8).collect();
    for (file, unit) in [
        (gray_png(png::BitDepth::Sixteen, &words), PRESSURE_MAX_PA / 65_535.0),
        (gray_png(png::BitDepth::Eight, &octets), PRESSURE_MAX_PA / 255.0),
    ] {
        let path = format!("/v1/sed?pressure_max_pa={PRESSURE_MAX_PA}");
        let answer = service.post(&path, file).header("content-type", "image/png").send().await;
        assert_eq!(answer.status, 200, "{}", answer.text());
        assert_rendered(&map, &floats_of(&answer.body), |_| 0.26 * unit + 1e-3);
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn every_way_out_says_the_same() {
    let service = Service::start().await;
    let map = ramp();
    let render = |accept: &str| {
        let request = service.post("/v1/sed", bytes_of(&map)).header("content-type", OCTETS);
        request.header("accept", accept).send()
    };
    let npy = render("application/x-npy").await;
    assert_eq!(npy.header("content-type"), Some("application/x-npy"));
    assert!(npy.body.starts_with(b"\x93NUMPY\x01\x00"));
    assert_rendered(&map, &floats_of(&npy.body[npy.body.len() - 4 * MAP_LEN..]), |_| 1e-3);

    let json = render("application/json").await.json();
    assert_eq!((&json["width"], &json["height"]), (&json!(224), &json!(224)));
    assert_eq!(json["source"], "quick");
    let values = json["sed_j_per_m3"].as_array().unwrap();
    let values: Vec<f32> = values.iter().map(|v| v.as_f64().unwrap() as f32).collect();
    assert_rendered(&map, &values, |_| 1e-3);

    let png = render("image/png").await;
    let white: f32 = png.header("x-sed-max-j-per-m3").unwrap().parse().unwrap();
    assert!((white - SED_MAX).abs() < 1e-3, "{white}");
    let mut reader = png::Decoder::new(std::io::Cursor::new(&png.body)).read_info().unwrap();
    let mut pixels = vec![0; 2 * MAP_LEN];
    let info = reader.next_frame(&mut pixels).unwrap();
    assert_eq!(
        (info.color_type, info.bit_depth),
        (png::ColorType::Grayscale, png::BitDepth::Sixteen)
    );
    let unit = white / 65_535.0;
    let values: Vec<f32> = pixels
        .as_chunks::<2>()
        .0
        .iter()
        .map(|b| f32::from(u16::from_be_bytes(*b)) * unit)
        .collect();
    assert_rendered(&map, &values, |e| SampleType::U16.error_max(e, unit) + 1e-3);

    render("text/html").await.assert_refused(406, "not_acceptable");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_zero_map_is_answered_without_the_network() {
    let service = Service::start().await;
    let zeros = bytes_of(&vec![0.0; MAP_LEN]);
    let answer = service.post("/v1/sed?tier=slow&budget_us=1000000", zeros).send().await;
    assert_eq!(answer.status, 200, "{}", answer.text());
    assert!(floats_of(&answer.body).iter().all(|e| e.to_bits() == 0));
    assert_eq!(answer.header("x-papilla-infer-us"), Some("0"));
    assert_eq!(service.metric("papilla_zero_maps_total").await as u64, 1);
    let infer = r#"papilla_stage_seconds_count{tier="slow",stage="infer"}"#;
    assert_eq!(service.metric(infer).await as u64, 0);
}

#[tokio::test(flavor = "multi_thread")]
async fn wrong_bodies_are_named() {
    let service = Service::start().await;
    let whole = bytes_of(&ramp());
    for (content_type, body, status, code) in [
        (OCTETS, vec![], 400, "wrong_length"),
        (OCTETS, whole[1..].to_vec(), 400, "wrong_length"),
        (OCTETS, [&whole[..], &[0]].concat(), 400, "wrong_length"),
        ("text/plain", whole.clone(), 415, "wrong_type"),
        ("application/json", b"{".to_vec(), 400, "bad_json"),
        ("application/json", br#"{"pressure_pa": [1, 2]}"#.to_vec(), 400, "wrong_length"),
        ("application/x-npy", whole.clone(), 400, "bad_npy"),
        ("application/x-npy", npy("<i4", "(224, 224)", &whole), 415, "wrong_type"),
        ("application/x-npy", npy("<f4", "(2, 3)", &whole), 400, "wrong_shape"),
        ("application/x-npy", npy("<f4", "(224, 224)", &whole[4..]), 400, "wrong_length"),
    ] {
        let answer = service.post("/v1/sed", body).header("content-type", content_type).send();
        answer.await.assert_refused(status, code);
    }
    let png = gray_png(png::BitDepth::Eight, &vec![1; MAP_LEN]);
    let post = |path: &str, body: &[u8]| {
        service.post(path, body).header("content-type", "image/png").send()
    };
    let field = post("/v1/sed", &png).await.assert_refused(400, "bad_query");
    assert_eq!(field.as_deref(), Some("pressure_max_pa"));
    post("/v1/sed?pressure_max_pa=9", &png[..80]).await.assert_refused(400, "bad_png");
    // Full white above what the model knows: only the pixels that are so are out of range.
    let bright = gray_png(png::BitDepth::Eight, &vec![255; MAP_LEN]);
    let above = format!("/v1/sed?pressure_max_pa={}", 2.0 * PRESSURE_MAX_PA);
    post(&above, &bright).await.assert_refused(422, "out_of_range");
    assert_eq!(post(&above, &png).await.status, 200);
}

#[tokio::test(flavor = "multi_thread")]
async fn wrong_values_are_named_with_their_place() {
    let service = Service::start().await;
    for (value, code) in [
        (f32::NAN, "not_finite"),
        (f32::INFINITY, "not_finite"),
        (f32::NEG_INFINITY, "not_finite"),
        (-1e-6, "negative_pressure"),
        (1.02 * PRESSURE_MAX_PA, "out_of_range"),
    ] {
        let mut map = ramp();
        map[224 * 3 + 5] = value;
        let answer = service.post("/v1/sed", bytes_of(&map)).send().await;
        assert_eq!(answer.assert_refused(422, code).as_deref(), Some("pressure_pa"));
        assert!(answer.text().contains("row 3, column 5"), "{}", answer.text());
    }
    // As JSON, where NaN has no word and 1e39 overflows.
    let huge = format!("{{\"pressure_pa\": [1e39{}]}}", ",0".repeat(MAP_LEN - 1));
    let answer = service.post("/v1/sed", huge).header("content-type", "application/json").send();
    answer.await.assert_refused(422, "not_finite");
    assert_eq!(service.metric(r#"papilla_errors_total{code="not_finite"}"#).await as u64, 4);
    assert_eq!(
        service.metric(r#"papilla_maps_total{transport="http",outcome="error"}"#).await as u64,
        6
    );
}

#[tokio::test(flavor = "multi_thread")]
async fn queries_choose_and_are_checked() {
    let service = Service::start().await;
    let body = bytes_of(&ramp());
    let post = |query: &str| service.post(&format!("/v1/sed?{query}"), body.clone()).send();
    for (query, tier) in [
        ("tier=slow", "slow"),
        ("tier=quick", "quick"),
        ("", "quick"),
        // Enough for the slower tier, which errs less; too little for it.
        ("budget_us=60000000", "slow"),
        ("budget_us=60000000&tier=quick", "quick"),
        ("budget_us=0", "quick"),
    ] {
        let answer = post(query).await;
        assert_eq!(answer.status, 200, "{query}: {}", answer.text());
        assert_eq!(answer.header("x-papilla-tier"), Some(tier), "{query}");
    }
    post("tier=nobody").await.assert_refused(404, "unknown_tier");
    assert_eq!(post("teir=slow").await.assert_refused(400, "bad_query").as_deref(), Some("teir"));
    post("budget_us=soon").await.assert_refused(400, "bad_query");
    post("pressure_max_pa=-1").await.assert_refused(400, "bad_query");
}

#[tokio::test(flavor = "multi_thread")]
async fn late_maps_are_dropped_and_counted() {
    let service = Service::start().await;
    let body = bytes_of(&ramp());
    let post = |query: &str| service.post(&format!("/v1/sed?{query}"), body.clone()).send();
    post("budget_us=1").await.assert_refused(504, "late");
    // Less than half of what the fastest run took: not even begun.
    post("tier=slow&budget_us=3000").await.assert_refused(504, "late");
    let late = r#"papilla_maps_total{transport="http",outcome="late"}"#;
    assert_eq!(service.metric(late).await as u64, 2);
    let infer = r#"papilla_stage_seconds_count{tier="slow",stage="infer"}"#;
    assert_eq!(service.metric(infer).await as u64, 0);
    assert_eq!(post("tier=slow").await.status, 200);
}

#[tokio::test(flavor = "multi_thread")]
async fn more_requests_than_places_are_turned_away() {
    let one = std::num::NonZeroUsize::MIN;
    let service = Service::start_with(|config| config.max_requests = one).await;
    let body = bytes_of(&ramp());
    let posts: Vec<_> = (0..4)
        .map(|_| tokio::spawn(service.post("/v1/sed?tier=slow", body.clone()).send()))
        .collect();
    let mut statuses = Vec::new();
    for post in posts {
        let answer = post.await.unwrap();
        if answer.status != 200 {
            answer.assert_refused(503, "overloaded");
            assert_eq!(answer.header("retry-after"), Some("1"));
        }
        statuses.push(answer.status);
    }
    statuses.sort_unstable();
    assert_eq!((statuses[0], statuses[3]), (200, 503), "{statuses:?}");
    assert_eq!(service.post("/v1/sed", body).send().await.status, 200);
}

#[tokio::test(flavor = "multi_thread")]
async fn pressure_off_the_skin_is_on_no_finger() {
    let atlas = atlas_of_skin(50.0, 150.0);
    let service = Service::on(model_folder_on(&atlas), |_| ()).await.unwrap();
    let inside = |i: &usize| (50..150).contains(&(i % 224)) && (50..150).contains(&(i / 224));
    let masked: Vec<f32> =
        ramp().into_iter().enumerate().map(|(i, p)| if inside(&i) { p } else { 0.0 }).collect();
    let answer = service.post("/v1/sed", bytes_of(&ramp())).send().await;
    assert_rendered(&masked, &floats_of(&answer.body), |_| 1e-2);
    let mut socket = service.socket().await;
    socket.open(hello(&json!({}))).await;
    socket.send(frame(1, 0, SampleType::F32, 1.0, &ramp())).await;
    assert_rendered(&masked, &floats_of(&socket.hear_frame().await.1), |_| 1e-2);
    // Pressure beside the finger touches nothing, and asks no network.
    let beside: Vec<f32> = (0..MAP_LEN).map(|i| if inside(&i) { 0.0 } else { 9000.0 }).collect();
    let answer = service.post("/v1/sed", bytes_of(&beside)).send().await;
    assert_eq!(answer.header("x-papilla-infer-us"), Some("0"));
    assert!(floats_of(&answer.body).iter().all(|e| e.to_bits() == 0));
    // What is no pressure is refused wherever it lies.
    for (at, value, code) in [
        (0, f32::NAN, "not_finite"),
        (MAP_LEN - 1, -1.0, "negative_pressure"),
        (223, 1e30, "out_of_range"),
    ] {
        let mut bad = masked.clone();
        bad[at] = value;
        service.post("/v1/sed", bytes_of(&bad)).send().await.assert_refused(422, code);
    }
}
