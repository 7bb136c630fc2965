//! The effect `spikes` over the wire: units in `ready`, spikes in answers, refusals.

use papilla_proto::{
    FrameStatus, HEADER_LEN, MAP_LEN, MAP_SIDE_PX, SampleType, Window, effects::RATES_HEAD_LEN,
    spikes::Fired,
};
use serde_json::{Value, json};

use crate::{
    effects::windowed,
    support::{Service, Socket, hello},
};

/// A round press that goes up and down in 80 ms.
fn press(time_us: u64) -> Vec<f32> {
    let wave = (time_us as f32 * 1e-6 * std::f32::consts::TAU * 12.5).sin().max(0.0);
    let value = |index: usize| {
        let [x, y] =
            [index % MAP_SIDE_PX, index / MAP_SIDE_PX].map(|px| px as f32 - 0.5 * 224.0 + 0.5);
        4000.0 * wave * (1.0 - (x * x + y * y) / 900.0).max(0.0)
    };
    (0..MAP_LEN).map(value).collect()
}

/// A session that fires, and where the section lies.
struct Firing {
    socket: Socket,
    ready: Value,
    sequence: u32,
}

impl Firing {
    async fn open(service: &Service, members: &Value) -> Self {
        let mut socket = service.socket().await;
        let mut wish = json!({"effects": ["spikes"], "map": false, "tier": "quick"});
        let members = members.as_object().unwrap().clone();
        wish.as_object_mut().unwrap().extend(members);
        let ready = socket.open(hello(&wish)).await;
        Self { socket, ready, sequence: 0 }
    }

    async fn frame(&mut self, time_us: u64, window: Window) -> Fired {
        self.sequence += 1;
        self.socket.send(windowed(self.sequence, time_us, window, &press(time_us))).await;
        let (header, payload) = self.socket.hear_frame().await;
        assert_eq!(header.status, FrameStatus::Ok);
        let section = &self.ready["sections"][0];
        assert_eq!(section["name"], "spikes");
        let [offset, bytes] = ["offset", "bytes"].map(|name| section[name].as_u64().unwrap());
        // `hear_frame` takes the header off.
        let part = &payload[offset as usize - HEADER_LEN..][..bytes as usize];
        Fired::decode(part, time_us).unwrap()
    }

    async fn run(&mut self, window: Window) -> Vec<Fired> {
        let mut all = Vec::new();
        for ms in 0..60 {
            all.push(self.frame(1000 * ms, window).await);
        }
        all
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_seed_decides_units_and_spikes_whatever_a_frame_carries() {
    let service = Service::start().await;
    let seeded = |seed: u32| json!({"spikes": {"seed": seed, "noise": true}});
    let mut one = Firing::open(&service, &seeded(5)).await;
    let units = one.ready["units"].as_array().unwrap().clone();
    assert!(units.len() > 100, "{}", one.ready);
    assert!(units.iter().any(|unit| unit["class"] == "pc" && unit["px"][0].is_f64()));
    let heard = one.run(Window::WHOLE).await;
    let fired: usize = heard.iter().map(|fired| fired.spikes.len()).sum();
    assert!(fired > 200, "{fired} spikes");
    assert_eq!(heard.last().unwrap().total as usize, fired);
    // The pixels in contact alone, and a map in the answer too.
    let window = Window { x: 80, y: 80, width: 64, height: 64 };
    let mut members = seeded(5);
    members["map"] = json!(true);
    members["answer_sample_type"] = json!(SampleType::U16);
    assert!(Firing::open(&service, &members).await.run(window).await == heard);
    let mut other = Firing::open(&service, &seeded(6)).await;
    assert_ne!(other.ready["units"], one.ready["units"]);
    assert!(other.run(Window::WHOLE).await != heard);
}

#[tokio::test(flavor = "multi_thread")]
async fn sessions_without_the_effect_have_no_units_and_no_section() {
    let service = Service::start().await;
    let mut socket = service.socket().await;
    let ready = socket.open(hello(&json!({"effects": ["summary", "afferents"]}))).await;
    assert_eq!(ready.get("units"), None, "{ready}");
    let names: Vec<_> =
        ready["sections"].as_array().unwrap().iter().map(|section| &section["name"]).collect();
    assert_eq!(names, ["summary", "rates", "map"]);
    let time_us = 20_000;
    socket.send(windowed(1, time_us, Window::WHOLE, &press(time_us))).await;
    let (_, payload) = socket.hear_frame().await;
    let rates_len = RATES_HEAD_LEN + 4 * MAP_LEN;
    assert_eq!(payload.len(), 64 + rates_len + 4 * MAP_LEN);
}

#[tokio::test(flavor = "multi_thread")]
async fn what_gives_no_unit_is_named() {
    let service = Service::start().await;
    let mut socket = service.socket().await;
    for (bad, code) in [
        (json!({"spikes": {}}), "bad_effect"),
        (
            json!({"effects": ["spikes"], "spikes":
                {"sa1_per_cm2": 0, "ra_per_cm2": 0, "pc_per_cm2": 0}}),
            "bad_effect",
        ),
        (
            json!({"effects": ["spikes"], "spikes":
                {"units": [{"class": "ra", "at": {"px": [1, 1]}}]}}),
            "bad_effect",
        ),
        (json!({"effects": ["spikes"], "spikes": {"seed": -1}}), "bad_json"),
    ] {
        socket.send(hello(&bad).to_string()).await;
        let error = socket.hear_refusal(code).await;
        assert!(error["field"].as_str().is_some_and(|f| f.starts_with("spikes")), "{error}");
    }
}
