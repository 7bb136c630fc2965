//! Clients whose clock is set, runs backward or wraps: what is promised of time still holds.

use papilla_proto::{FrameHeader, FrameStatus, MAP_LEN, Window};
use serde_json::{Value, json};

use crate::{
    effects::windowed,
    support::{GAIN, Service, Socket, floats_of, hello},
};

const DAY_US: u64 = 86_400_000_000;
const PRESSURE_PA: f32 = 5000.0;

struct Clocked {
    socket: Socket,
    sequence: u32,
}

impl Clocked {
    async fn open(service: &Service, wish: &Value) -> Self {
        let mut socket = service.socket().await;
        socket.open(hello(wish)).await;
        Self { socket, sequence: 0 }
    }

    /// A held contact at this time of the client's; the answer's header and first sample.
    async fn held(&mut self, time_us: u64) -> (FrameHeader, Option<f32>) {
        self.sequence += 1;
        let map = vec![PRESSURE_PA; MAP_LEN];
        let window = Window { x: 100, y: 100, width: 4, height: 4 };
        self.socket.send(windowed(self.sequence, time_us, window, &map)).await;
        let (header, payload) = self.socket.hear_frame().await;
        assert_eq!((header.sequence, header.client_time_us), (self.sequence, time_us));
        let sed = floats_of(&payload);
        assert!(sed.iter().all(|v| v.is_finite() && *v >= 0.0));
        // The map comes last.
        let map = &sed[sed.len().saturating_sub(MAP_LEN)..];
        (header, map.get(100 * 224 + 100).copied())
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_clock_that_is_set_back_makes_frames_stale_for_a_while_and_no_longer() {
    let service = Service::start().await;
    // Longer than all of it takes anywhere: clients' clocks run by 1 ms a frame, this one's by more.
    let mut session = Clocked::open(&service, &json!({"stale_after_us": 600_000_000})).await;
    let now = 20_000 * DAY_US;
    assert_eq!(session.held(now).await.0.status, FrameStatus::Ok);
    // Back by a day, to nothing, to before the wrap of 64 bits and of their sign.
    for start in [now - DAY_US, 0, u64::MAX - 30_000, (1 << 63) - 30_000] {
        let mut stale = 0;
        for n in 0..200 {
            let (header, sed) = session.held(start.wrapping_add(1000 * n)).await;
            match header.status {
                FrameStatus::Stale => stale += 1,
                FrameStatus::Ok => assert!((sed.unwrap() - GAIN * PRESSURE_PA).abs() < 1.0),
                other => panic!("{other:?} at {start} + {n} ms"),
            }
        }
        // A clock set forward looks like a faster line: nothing is stale. Set back, 64 in a row
        // are, and then the clock is believed; its wrap is no event.
        assert!(stale == 0 || stale == 64, "{stale} stale frames from {start}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn relaxation_stays_between_its_limits_whatever_the_clock() {
    let service = Service::start().await;
    let wish =
        json!({"effects": ["relaxation"], "relaxation": {"prony": [{"g": 0.5, "tau_s": 1.0}]}});
    let mut session = Clocked::open(&service, &wish).await;
    // Instantaneous SED; creep doubles the pressure that the network sees.
    let (least, most) = (GAIN * PRESSURE_PA, 2.0 * GAIN * PRESSURE_PA);
    let mut last = 0.0;
    let year = 365 * DAY_US;
    for time_us in [
        1000,
        1_001_000,
        // Back, the same again, and on from there.
        0,
        0,
        500_000,
        // A year ahead and back; past the wrap.
        year,
        3,
        u64::MAX,
        0,
        1,
        u64::MAX - 1,
        u64::MAX,
        5_000_000,
    ] {
        let (header, sed) = session.held(time_us).await;
        assert_eq!(header.status, FrameStatus::Ok);
        let sed = sed.unwrap();
        assert!((least - 1.0..=most + 1.0).contains(&sed), "{sed} at {time_us}");
        // A contact that is held only creeps on: a clock that runs back undoes nothing.
        assert!(sed >= last - 0.5, "{last} fell to {sed} at {time_us}");
        last = sed;
    }
    assert!((last - most).abs() < 1.0, "after years it has crept all the way: {last}");
}

#[tokio::test(flavor = "multi_thread")]
async fn firing_rates_stay_numbers_whatever_the_clock() {
    let service = Service::start().await;
    let most =
        json!({"e_ref_kpa": 1e6, "theta_kpa": 0, "k_s_hz_per_kpa": 1e6, "k_d_hz_s_per_kpa": 1e6});
    let mut session =
        Clocked::open(&service, &json!({"effects": ["afferents"], "afferents": most})).await;
    for time_us in [0, 1, 2, DAY_US, 3, u64::MAX, 0] {
        // `held` asserts that they are; rates come before the map.
        assert!(session.held(time_us).await.1.unwrap() > 0.0);
    }
    let mut socket = service.socket().await;
    let beyond = json!({"effects": ["afferents"], "afferents": {"k_d_hz_s_per_kpa": 1e35}});
    socket.send(hello(&beyond).to_string()).await;
    assert_eq!(socket.hear_refusal("bad_effect").await["field"], "afferents");
}
