//! A ball that goes down on a finger, and what pushes back: objects in, forces out.
//!
//! `cargo run --release -p papilla-client --example touch [HOST:PORT] [FRAMES]`; the service needs
//! `--contact FILE`. Says at the end how long the way there and back took.

use std::{env, time::Instant};

use papilla_client::{
    Session,
    proto::{
        Hello,
        contact::{AnnouncedObject, Input, Pose},
        sdf::{AnnouncedShape, Sphere},
    },
};

#[tokio::main]
async fn main() -> Result<(), Box<dyn std::error::Error>> {
    let server = env::args().nth(1).unwrap_or_else(|| "127.0.0.1:7224".to_owned());
    let frames: u32 = env::args().nth(2).map_or(Ok(1000), |text| text.parse())?;
    let shape = AnnouncedShape::Sphere(Sphere { radius_mm: 10.0 });
    let objects = vec![AnnouncedObject { shape, stiffness_mpa_per_mm: None }];
    let hello = Hello {
        input: Some(Input::Objects),
        objects: Some(objects),
        map: Some(false),
        ..Hello::default()
    };
    let session = Session::open(&server, hello).await?;
    let mut round_trips_us = Vec::new();
    let mut in_server_us = Vec::new();
    for frame in 0..frames {
        let depth_mm = 0.5 + 0.5 * (frame as f32 / 300.0).sin();
        // The pad's lowest point, seen from the finger's frame.
        let pose = Pose { origin_mm: [11.25, 0.0, -6.53 - 10.0 + depth_mm], ..Pose::default() };
        let start = Instant::now();
        let answer = session.touch(0, &[pose]).await?;
        round_trips_us.push(start.elapsed().as_micros() as u32);
        in_server_us.push(answer.total_us);
        let touch = answer.touch.ok_or_else(|| format!("no touch: {:?}", answer.status))?;
        if frame % 250 == 0 {
            let [x, y, z] = touch.force_n;
            println!(
                "{depth_mm:.2} mm: ({x:.3}, {y:.3}, {z:.3}) N on {:.1} mm2, solved in {:.0} us",
                touch.area_mm2, touch.solve_us
            );
        }
    }
    for (what, times) in [("round trip", &mut round_trips_us), ("in the server", &mut in_server_us)]
    {
        times.sort_unstable();
        let at = |part: f64| times[((times.len() - 1) as f64 * part) as usize];
        println!("{what}: median {} us, 99 % {} us, 99.9 % {} us", at(0.5), at(0.99), at(0.999));
    }
    Ok(())
}
