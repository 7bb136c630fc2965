//! Balls that go down on fingers, and what pushes back: objects in, forces out.
//!
//! `cargo run --release -p papilla-client --example touch -- [HOST:PORT [FRAMES [HZ [FINGERS [TIER]]]]]`.
//! With a tier, answers carry SED at the vertices. Says at the end how long the way there and back
//! took.

use std::{
    env,
    time::{Duration, Instant},
};

use papilla_client::{
    Answer, Session,
    proto::{
        Hello,
        contact::{AnnouncedFinger, AnnouncedObject, Input, Pose, SampleLayout},
        sdf::{AnnouncedShape, Sphere},
    },
};
use tokio::time::{MissedTickBehavior, interval};

#[tokio::main]
async fn main() -> Result<(), Box<dyn std::error::Error>> {
    let argument =
        |n: usize, default: &str| env::args().nth(n).unwrap_or_else(|| default.to_owned());
    let (server, tier) = (argument(1, "127.0.0.1:7224"), env::args().nth(5));
    let (frames, hz): (u32, f64) = (argument(2, "1000").parse()?, argument(3, "1000").parse()?);
    let fingers: u8 = argument(4, "1").parse()?;
    let shape = AnnouncedShape::Sphere(Sphere { radius_mm: 10.0 });
    let object = AnnouncedObject { shape, stiffness_mpa_per_mm: None, friction: None };
    let hello = Hello {
        input: Some(Input::Objects),
        objects: Some(vec![object]),
        fingers: Some(vec![AnnouncedFinger::default(); fingers.into()]),
        map: Some(tier.is_some()),
        answer_layout: Some(SampleLayout::Vertices),
        tier,
        ..Hello::default()
    };
    let session = Session::open(&server, hello).await?;
    let mut times = Times::default();
    let mut beat = interval(Duration::from_secs_f64(1.0 / hz));
    beat.set_missed_tick_behavior(MissedTickBehavior::Delay);
    for frame in 0..frames {
        beat.tick().await;
        let depth_mm = 0.5 + 0.5 * (frame as f32 / 300.0).sin();
        // The pad's lowest point, seen from the finger's frame.
        let pose = Pose { origin_mm: [11.25, 0.0, -16.53 + depth_mm], ..Pose::default() };
        let start = Instant::now();
        let sent = (0..fingers).map(|finger| session.send_poses(finger, &[pose], None));
        for outcome in sent.collect::<Result<Vec<_>, _>>()? {
            let answer = outcome.await?;
            times.take(start, &answer)?;
            if frame % 250 == 0 && answer.finger == 0 {
                print(depth_mm, &answer);
            }
        }
    }
    times.print();
    Ok(())
}

fn print(depth_mm: f32, answer: &Answer) {
    if let Some(touch) = answer.touch {
        let [x, y, z] = touch.force_n;
        println!("{depth_mm:.2} mm: ({x:.3}, {y:.3}, {z:.3}) N on {:.1} mm2", touch.area_mm2);
    }
}

#[derive(Default)]
struct Times {
    round_trip_us: Vec<u32>,
    in_server_us: Vec<u32>,
    solve_us: Vec<u32>,
    beside_us: Vec<u32>,
}

impl Times {
    fn take(&mut self, start: Instant, answer: &Answer) -> Result<(), String> {
        let touch = answer.touch.ok_or_else(|| format!("no touch: {:?}", answer.status))?;
        let solve_us = touch.solve_us as u32;
        self.round_trip_us.push(start.elapsed().as_micros() as u32);
        self.in_server_us.push(answer.total_us);
        self.solve_us.push(solve_us);
        let beside = answer.total_us.saturating_sub(solve_us).saturating_sub(answer.infer_us);
        self.beside_us.push(beside);
        Ok(())
    }

    fn print(self) {
        for (what, mut times) in [
            ("round trip", self.round_trip_us),
            ("in the server", self.in_server_us),
            ("of which solving", self.solve_us),
            ("beside solve and network", self.beside_us),
        ] {
            times.sort_unstable();
            let at = |part: f64| times[((times.len() - 1) as f64 * part) as usize];
            let (half, most) = (at(0.5), at(0.99));
            println!("{what}: median {half} us, 99 % {most} us, 99.9 % {} us", at(0.999));
        }
    }
}
