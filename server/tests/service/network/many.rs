//! Thousands of clients, one after the other: nothing of them stays.

use std::{net::SocketAddr, time::Duration};

use papilla_proto::{FrameStatus, SampleType};
use serde_json::json;
use tokio::{
    io::AsyncWriteExt,
    net::TcpStream,
    time::{sleep, timeout},
};

use super::{HANG, until_open};
use crate::support::{
    Running, Socket, frame, hello, metric_at, model_folder, ramp, raw::HANDSHAKE,
};

/// How many times `clients_come_and_go` reconnects; 10 000 in the long form.
fn reconnects() -> u32 {
    std::env::var("PAPILLA_RECONNECTS").map_or(1000, |n| n.parse().unwrap())
}

/// Connects once and leaves in one of seven ways.
async fn come_and_go(address: SocketAddr, n: u32) {
    if n.is_multiple_of(7) {
        // Half a handshake.
        let mut stream = TcpStream::connect(address).await.unwrap();
        stream.write_all(&HANDSHAKE.as_bytes()[..40]).await.unwrap();
        return;
    }
    let mut socket = loop {
        match Socket::connect(address).await {
            Ok(socket) => break socket,
            // The places of those that just left are given back in a moment.
            Err((status, _)) => assert_eq!(status, 503),
        }
        sleep(Duration::from_millis(1)).await;
    };
    if n % 7 == 1 {
        return;
    }
    socket.open(hello(&json!({"sample_type": "u8"}))).await;
    match n % 7 {
        2 => {}
        3 => socket.close(None).await,
        4 => socket.send(frame(1, 0, SampleType::U8, 30.0, &ramp())).await,
        5 => {
            socket.send(frame(1, 0, SampleType::U8, 30.0, &ramp())).await;
            assert_eq!(socket.hear_frame().await.0.sequence, 1);
            socket.close(None).await;
        }
        _ => {
            for sequence in 0..3 {
                socket.send(frame(sequence, 0, SampleType::U8, 30.0, &ramp())).await;
            }
        }
    }
}

/// `PAPILLA_RECONNECTS=10000 cargo test -p papilla-server clients_come_and_go`
#[cfg(target_os = "linux")]
#[tokio::test(flavor = "multi_thread")]
async fn clients_come_and_go_and_nothing_of_them_stays() {
    let models = model_folder();
    let running = Running::start(models.path());
    let address = running.address;
    let settled = async || {
        until_open(address, 0).await;
        // The one that asks is counted too.
        let wait = async {
            while metric_at(address, "papilla_connections_open").await > 1.5 {
                sleep(Duration::from_millis(20)).await;
            }
        };
        timeout(HANG, wait).await.expect("a connection is still open");
        let fds = metric_at(address, "process_open_fds").await;
        (fds, metric_at(address, "process_resident_memory_bytes").await)
    };
    for n in 0..210 {
        come_and_go(address, n).await;
    }
    let (mut came, mut is_flat) = (210, false);
    let mut before = settled().await;
    // A busy machine may have more of them at once than before, and keep room for them: what stays of
    // clients makes it grow every time.
    for _ in 0..4 {
        if is_flat {
            break;
        }
        for n in 0..reconnects() {
            come_and_go(address, n).await;
        }
        came += reconnects();
        let after = settled().await;
        println!("{before:?} and {after:?} descriptors and bytes");
        // A session takes 1.2 MB; one in a hundred that stayed would show.
        is_flat = after.0 <= before.0 && after.1 - before.1 < 12e6;
        before = after;
    }
    assert!(is_flat, "descriptors and bytes grew with every round to {before:?}");
    let opened = metric_at(address, "papilla_sessions_total").await;
    // A client that leaves before the answer to its handshake may never become a session.
    let due = f64::from(came);
    assert!((0.7 * due..due).contains(&opened), "{opened} sessions of {due} connections");
    let mut socket = Socket::connect(address).await.unwrap();
    socket.open(hello(&json!({}))).await;
    socket.send(frame(9, 0, SampleType::F32, 1.0, &ramp())).await;
    assert_eq!(socket.hear_frame().await.0.status, FrameStatus::Ok);
}
