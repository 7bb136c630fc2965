//! A contact that comes and goes, 90 times a second.
//!
//! `cargo run --release -p papilla-client --example contact [HOST:PORT]`

use std::{env, time::Duration};

use papilla_client::{Contact, Session, Skin, Status, atlas, proto::Hello};
use tokio::{task, time};

#[tokio::main]
async fn main() -> Result<(), Box<dyn std::error::Error>> {
    let server = env::args().nth(1).unwrap_or_else(|| "127.0.0.1:7224".to_owned());
    let of = server.clone();
    let skin = Skin::new(&task::spawn_blocking(move || atlas(&of)).await??);
    let hello = Hello { effects: vec!["summary".to_owned()], ..Hello::default() };
    let session = Session::open(&server, hello).await?;
    println!("{} renders", session.ready().tier);
    let mut beat = time::interval(Duration::from_micros(11_111));
    for frame in 0..180 {
        beat.tick().await;
        let force_n = 0.5 * (f64::from(frame) / 57.0).sin().powi(2);
        let contact = Contact { at_mm: [11.25, 0.0, -6.53], force_n, radius_mm: 2.5 };
        let answer = session.render(&skin.contacts(&[contact])).await?;
        if answer.status != Status::Ok {
            // Lost, late or refused: an actuator goes to zero, and the next frame is tried.
            println!("{force_n:.3} N: no map, the frame is {:?}", answer.status);
            continue;
        }
        let area_mm2 = answer.summary.map_or(0.0, |summary| summary.contact_area_mm2);
        println!(
            "{force_n:.3} N: {:.0} J/m3 at most, {area_mm2:.1} mm2 in contact, {} us in the server",
            answer.max(),
            answer.total_us
        );
    }
    Ok(())
}
