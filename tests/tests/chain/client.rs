//! What every client must find: the library's own answer, and a name for every mistake.

use std::{io::Cursor, time::Duration};

use ndarray::Array2;
use ndarray_npy::{ReadNpyExt, WriteNpyExt};
use papilla_engine::Model;
use papilla_model_export::metrics::quantile;
use papilla_proto::{
    ErrorCode, FrameHeader, FrameKind, FrameStatus, HEADER_LEN, Hello, MAP_LEN, MAP_SIDE_PX,
    SampleType, effects::OutOfRange,
};
use papilla_tests::{
    http::{Request, Response},
    socket::{self, Received, Receiver, Sender},
};
use serde_json::{Value, json};
use tokio::time::timeout;

use crate::{
    assert_close,
    service::{Sample, Service, infer},
};

const OCTETS: &str = "application/octet-stream";
const NPY: &str = "application/x-npy";
const PNG: &str = "image/png";
const JSON: &str = "application/json";

/// The bar: an answer is the library's own to this share of its greatest value.
const EQUAL: f32 = 1e-6;

fn bytes_of(map: &[f32]) -> Vec<u8> {
    map.iter().flat_map(|v| v.to_le_bytes()).collect()
}

fn floats_of(bytes: &[u8]) -> Vec<f32> {
    let (chunks, rest) = bytes.as_chunks::<4>();
    assert!(rest.is_empty(), "{} bytes are no float32 map", bytes.len());
    chunks.iter().map(|chunk| f32::from_le_bytes(*chunk)).collect()
}

impl Service {
    async fn render(&self, path: &str, input: &str, output: &str, body: Vec<u8>) -> Response {
        let ask = || Request::post(path, body.clone()).header("content-type", input);
        let mut answer = self.send(ask().header("accept", output)).await;
        // A model on demand, in a debug build and on a busy core: as the answer says, again.
        for _ in 0..20 {
            if answer.status != 503 || !answer.text().contains("is loaded at its first use") {
                break;
            }
            answer = self.send(ask().header("accept", output)).await;
        }
        assert_eq!(answer.status, 200, "{path}, {input}: {}", answer.text());
        assert_eq!(answer.header("content-type"), Some(output));
        answer
    }
}

/// Posts `sample` to every tier in every form; all answers are the library's.
pub(crate) async fn http_answers_are_the_librarys(service: &Service, sample: &Sample) {
    let map = service.pressure_map(sample);
    for model in &service.models {
        let due = infer(model.as_ref(), &map);
        assert!(due.iter().any(|&e| e > 0.0), "contact has SED above 0");
        let path = format!("/v1/sed?tier={}", model.info().name);
        let raw = service.render(&path, OCTETS, OCTETS, bytes_of(&map)).await;
        assert_eq!(raw.header("x-papilla-tier"), Some(model.info().name.as_str()));
        assert_close("raw", &floats_of(&raw.body), &due, EQUAL);
        npy_is_equal(service, &path, &map, &due).await;
        json_is_equal(service, &path, &map, &due).await;
        png_is_equal(service, &path, &map, model.as_ref()).await;
        // Energy where there is no interface would be energy from nowhere.
        // The test network knows no atlas; the others draw within it.
        if model.info().name != "tiny" {
            let inside = service.interface.mask();
            assert!(due.iter().zip(inside).all(|(e, inside)| *inside || *e <= 0.0));
        }
    }
}

async fn npy_is_equal(service: &Service, path: &str, map: &[f32], due: &[f32]) {
    let side = (MAP_SIDE_PX, MAP_SIDE_PX);
    let doubles = map.iter().map(|&p| f64::from(p)).collect();
    let mut body = Vec::new();
    Array2::<f64>::from_shape_vec(side, doubles).unwrap().write_npy(&mut body).unwrap();
    let answer = service.render(path, NPY, NPY, body).await;
    let array = Array2::<f32>::read_npy(Cursor::new(&answer.body)).unwrap();
    assert_eq!(array.dim(), side);
    assert_close("npy", &array.into_iter().collect::<Vec<_>>(), due, EQUAL);
}

async fn json_is_equal(service: &Service, path: &str, map: &[f32], due: &[f32]) {
    let body = json!({"pressure_pa": map}).to_string().into_bytes();
    let answer = service.render(path, JSON, JSON, body).await;
    let answer: Value = serde_json::from_slice(&answer.body).unwrap();
    let values = answer["sed_j_per_m3"].as_array().unwrap().iter();
    let values: Vec<f32> = values.map(|v| v.as_f64().unwrap() as f32).collect();
    assert_close("JSON", &values, due, EQUAL);
}

/// A picture has 65535 steps: what is due is the library's answer to the picture.
async fn png_is_equal(service: &Service, path: &str, map: &[f32], model: &dyn Model) {
    let white_pa = map.iter().copied().fold(0.0, f32::max);
    let steps: Vec<u16> = map.iter().map(|p| (p / white_pa * 65_535.0).round() as u16).collect();
    let seen: Vec<f32> = steps.iter().map(|&s| f32::from(s) * (white_pa / 65_535.0)).collect();
    let mut body = Vec::new();
    let side = MAP_SIDE_PX as u32;
    let mut encoder = png::Encoder::new(&mut body, side, side);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::Sixteen);
    let big_endian: Vec<u8> = steps.iter().flat_map(|s| s.to_be_bytes()).collect();
    encoder.write_header().unwrap().write_image_data(&big_endian).unwrap();

    let path = format!("{path}&pressure_max_pa={white_pa}");
    let answer = service.render(&path, PNG, PNG, body).await;
    let white: f32 = answer.header("x-sed-max-j-per-m3").unwrap().parse().unwrap();
    let mut reader = png::Decoder::new(Cursor::new(&answer.body)).read_info().unwrap();
    let mut pixels = vec![0; 2 * MAP_LEN];
    let info = reader.next_frame(&mut pixels).unwrap();
    assert_eq!((info.width, info.height, info.bit_depth), (side, side, png::BitDepth::Sixteen));
    let step = white / 65_535.0;
    let due = infer(model, &seen);
    // The last bit of a decoded pressure may differ, and half a step of gray.
    let allowed = 1e-5 * due.iter().copied().fold(0.0, f32::max) + 0.5001 * step;
    for (i, (b, due)) in pixels.as_chunks::<2>().0.iter().zip(&due).enumerate() {
        let found = f32::from(u16::from_be_bytes(*b)) * step;
        assert!((found - due).abs() <= allowed, "PNG: {found} at {i}, not {due}");
    }
}

/// A map without pressure is a map without energy, to the bit.
pub(crate) async fn nothing_in_nothing_out(service: &Service) {
    let answer = service.render("/v1/sed", OCTETS, OCTETS, vec![0; 4 * MAP_LEN]).await;
    assert!(floats_of(&answer.body).iter().all(|e| e.to_bits() == 0));
    assert_eq!(answer.header("x-papilla-infer-us"), Some("0"));
}

/// Every mistake over HTTP has its code and its status.
pub(crate) async fn http_mistakes_are_named(service: &Service, sample: &Sample) {
    let good = bytes_of(&service.pressure_map(sample));
    let limit_pa = service.models[0].info().pressure_max_pa;
    let with = |value: f32| [&value.to_le_bytes()[..], &good[4..]].concat();
    for (path, input, output, body, code) in [
        ("/v1/sed", OCTETS, OCTETS, good[1..].to_vec(), ErrorCode::WrongLength),
        ("/v1/sed", OCTETS, OCTETS, vec![0; 3 << 20], ErrorCode::TooLarge),
        ("/v1/sed", OCTETS, OCTETS, with(f32::NAN), ErrorCode::NotFinite),
        ("/v1/sed", OCTETS, OCTETS, with(f32::INFINITY), ErrorCode::NotFinite),
        ("/v1/sed", OCTETS, OCTETS, with(-1.0), ErrorCode::NegativePressure),
        ("/v1/sed", OCTETS, OCTETS, with(1.1 * limit_pa), ErrorCode::OutOfRange),
        ("/v1/sed", "text/plain", OCTETS, good.clone(), ErrorCode::WrongType),
        ("/v1/sed", OCTETS, "text/html", good.clone(), ErrorCode::NotAcceptable),
        ("/v1/sed", JSON, OCTETS, b"[1".to_vec(), ErrorCode::BadJson),
        ("/v1/sed", NPY, OCTETS, good.clone(), ErrorCode::BadNpy),
        ("/v1/sed?pressure_max_pa=1", PNG, OCTETS, good.clone(), ErrorCode::BadPng),
        ("/v1/sed?tier=nobody", OCTETS, OCTETS, good.clone(), ErrorCode::UnknownTier),
        ("/v1/sed?teir=tiny", OCTETS, OCTETS, good.clone(), ErrorCode::BadQuery),
        ("/v1/sed?budget_us=1", OCTETS, OCTETS, good.clone(), ErrorCode::Late),
        ("/v1/nothing", OCTETS, OCTETS, good.clone(), ErrorCode::NotFound),
    ] {
        let request = Request::post(path, body).header("content-type", input);
        let answer = service.send(request.header("accept", output)).await;
        let error: Value = serde_json::from_slice(&answer.body).unwrap_or_default();
        let found = (answer.status, error["error"]["code"].as_str());
        assert_eq!(found, (code.http_status(), Some(code.as_str())), "{path}: {}", answer.text());
    }
}

/// An open session.
struct Session {
    sender: Sender,
    receiver: Receiver,
    sample_type: SampleType,
    scale: f32,
}

impl Session {
    async fn open(service: &Service, tier: &str, sample_type: SampleType, peak_pa: f32) -> Self {
        let hello = Hello {
            tier: Some(tier.to_owned()),
            sample_type,
            atlas_hash: Some(service.atlas.hash().to_owned()),
            out_of_range: Some(OutOfRange::Refuse),
            ..Hello::default()
        };
        let (ready, sender, receiver) = socket::open(&service.address, &hello).await.unwrap();
        assert_eq!((ready.tier.as_str(), ready.sample_type), (tier, sample_type));
        assert_eq!(ready.atlas_hash, service.atlas.hash());
        let scale = if sample_type.is_scaled() { peak_pa / sample_type.unit_max() } else { 1.0 };
        Self { sender, receiver, sample_type, scale }
    }

    fn frame(&self, sequence: u32, map: &[f32]) -> Vec<u8> {
        let header = FrameHeader::pressure(sequence, 7, 0, self.sample_type, self.scale);
        let mut payload = vec![0; header.payload_len()];
        self.sample_type.encode(map, self.scale, &mut payload).unwrap();
        socket::frame(&header, &payload)
    }

    async fn receive(&mut self) -> Received {
        let heard = timeout(Duration::from_secs(60), self.receiver.receive()).await;
        heard.expect("no answer").unwrap()
    }

    /// Sends a map; returns the answer and the header it came under.
    async fn render(&mut self, sequence: u32, map: &[f32]) -> (FrameHeader, Vec<f32>) {
        self.sender.send(self.frame(sequence, map)).await.unwrap();
        let Received::Frame(header, payload) = self.receive().await else {
            panic!("a frame is due")
        };
        assert_eq!((header.kind, header.status), (FrameKind::Sed, FrameStatus::Ok));
        assert_eq!((header.sequence, header.client_time_us), (sequence, 7));
        let mut sed_j_per_m3 = vec![0.0; MAP_LEN];
        self.sample_type.decode(&payload, header.scale, &mut sed_j_per_m3).unwrap();
        (header, sed_j_per_m3)
    }
}

/// Sends the samples through sessions of every sample type; all answers are the library's.
pub(crate) async fn session_answers_are_the_librarys(service: &Service, samples: &[Sample]) {
    let maps: Vec<_> = samples.iter().map(|sample| service.pressure_map(sample)).collect();
    let peak_pa = maps.iter().flatten().copied().fold(0.0, f32::max);
    let model = service.models[0].as_ref();
    for sample_type in SampleType::ALL {
        let mut session = Session::open(service, &model.info().name, sample_type, peak_pa).await;
        for (sequence, map) in (0..).zip(&maps) {
            let (header, found) = session.render(sequence, map).await;
            let frame = session.frame(sequence, map);
            let mut seen = vec![0.0; MAP_LEN];
            sample_type.decode(&frame[HEADER_LEN..], session.scale, &mut seen).unwrap();
            let due = infer(model, &seen);
            let share = EQUAL * due.iter().copied().fold(0.0, f32::max);
            for (i, (found, due)) in found.iter().zip(&due).enumerate() {
                let allowed = share + sample_type.error_max(*due, header.scale);
                let near = (found - due).abs() <= allowed;
                assert!(near, "{sample_type:?}, frame {sequence}: {found} at {i}, not {due}");
            }
        }
        let (_, nothing) = session.render(99, &vec![0.0; MAP_LEN]).await;
        assert!(nothing.iter().all(|e| e.to_bits() == 0));
        session.sender.close().await;
    }
}

/// A session names every mistake and renders the next frame all the same.
pub(crate) async fn sessions_survive_mistakes(service: &Service, sample: &Sample) {
    let map = service.pressure_map(sample);
    let model = service.models[0].as_ref();
    let due = infer(model, &map);
    let name = &model.info().name;
    let mut session = Session::open(service, name, SampleType::F32, 0.0).await;
    let good = session.frame(5, &map);
    let with = |at: usize, bytes: &[u8]| {
        let mut bad = good.clone();
        bad[at..at + bytes.len()].copy_from_slice(bytes);
        bad
    };
    for (sequence, (bad, code, is_named)) in (5..).zip([
        (good[..31].to_vec(), ErrorCode::TruncatedHeader, true),
        (with(0, b"PNG1"), ErrorCode::BadMagic, false),
        (with(4, &[9]), ErrorCode::UnknownVersion, true),
        (with(6, &[1]), ErrorCode::WrongType, true),
        (with(12, &[225]), ErrorCode::WrongShape, true),
        (good[..good.len() - 4].to_vec(), ErrorCode::WrongLength, true),
        (with(HEADER_LEN, &f32::NAN.to_le_bytes()), ErrorCode::NotFinite, true),
        (with(HEADER_LEN, &(-1.0_f32).to_le_bytes()), ErrorCode::NegativePressure, true),
        (with(HEADER_LEN, &1e9_f32.to_le_bytes()), ErrorCode::OutOfRange, true),
    ]) {
        // Each frame is newer than those before it.
        let mut bad = bad;
        bad[8..12].copy_from_slice(&u32::to_le_bytes(sequence));
        session.sender.send(bad).await.unwrap();
        let Received::Error(error) = session.receive().await else { panic!("{code} is due") };
        let named = is_named.then_some(sequence);
        assert_eq!((error.code, error.sequence, error.closes), (code, named, false));
    }
    session.sender.send("press harder".to_owned()).await.unwrap();
    let Received::Error(error) = session.receive().await else { panic!("a refusal is due") };
    assert_eq!((error.code, error.closes), (ErrorCode::UnexpectedText, false));
    let (_, found) = session.render(99, &map).await;
    assert_close("after ten mistakes", &found, &due, EQUAL);
}

/// Renders the samples in a session of the default tier; the median relative L2 error
/// against the FE truth over the pixels of the interface.
pub(crate) async fn median_error(service: &Service, maps: &[[Vec<f32>; 2]]) -> f64 {
    let name = &service.models[0].info().name;
    let mut session = Session::open(service, name, SampleType::F32, 0.0).await;
    let mut errors = Vec::new();
    for (sequence, [pressure_pa, truth]) in (0..).zip(maps) {
        let (_, found) = session.render(sequence, pressure_pa).await;
        let (mut difference, mut size) = (0.0, 0.0);
        for &pixel in service.interface.indices() {
            let (p, t) = (f64::from(found[pixel as usize]), f64::from(truth[pixel as usize]));
            difference += (p - t) * (p - t);
            size += t * t;
        }
        errors.push((difference / size).sqrt());
    }
    quantile(&errors, 0.5).unwrap()
}
