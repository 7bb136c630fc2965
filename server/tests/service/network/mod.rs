//! Connections that are slow, half there, out of order or many: each ends in time with a word
//! where there is one, and nobody else notices.

mod flood;
mod half;
mod many;
mod messages;
mod slow;

use std::{cell::Cell, net::SocketAddr, time::Duration};

use papilla_proto::{FrameHeader, FrameStatus, HEADER_LEN, SampleType, Window};
use serde_json::json;
use tokio::time::{sleep, timeout};

use crate::support::{
    Service, Socket, assert_rendered, floats_of, frame, hello, metric_at, ramp, raw::opcode,
};

/// Longest wait for what ends within seconds; only a hang takes longer.
const HANG: Duration = Duration::from_secs(60);

/// A session beside the troublemakers. Every frame of it must be rendered.
struct Neighbour {
    socket: Socket,
    sequence: u32,
}

impl Neighbour {
    async fn of(service: &Service) -> Self {
        let mut socket = service.socket().await;
        socket.open(hello(&json!({}))).await;
        Self { socket, sequence: 0 }
    }

    /// Is served for as long as `trouble` lasts, and after it.
    async fn beside<T>(&mut self, trouble: impl Future<Output = T>) -> T {
        let over = Cell::new(false);
        let served = async {
            while !over.get() {
                self.is_served().await;
                sleep(Duration::from_millis(50)).await;
            }
        };
        let trouble = async {
            let result = trouble.await;
            over.set(true);
            result
        };
        let ((), result) = tokio::join!(served, trouble);
        self.is_served().await;
        result
    }

    async fn is_served(&mut self) {
        for _ in 0..5 {
            self.sequence += 1;
            self.socket.send(frame(self.sequence, 0, SampleType::F32, 1.0, &ramp())).await;
            let (header, payload) = self.socket.hear_frame().await;
            assert_eq!((header.sequence, header.status), (self.sequence, FrameStatus::Ok));
            assert_rendered(&ramp(), &floats_of(&payload), |_| 1e-2);
        }
    }
}

/// Waits until so many sessions are open.
async fn until_open(address: SocketAddr, sessions: i64) {
    let wait = async {
        while metric_at(address, "papilla_sessions_open").await as i64 != sessions {
            sleep(Duration::from_millis(20)).await;
        }
    };
    timeout(HANG, wait).await.expect("a dead session is still open");
}

/// A frame that carries 5 x 4 pixels of 100 units.
fn small_frame(sequence: u32) -> Vec<u8> {
    let window = Window { x: 60, y: 70, width: 5, height: 4 };
    let header = FrameHeader::pressure(sequence, 0, 0, SampleType::U8, 10.0).windowed(window);
    let mut frame = header.encode().to_vec();
    frame.resize(HEADER_LEN + 20, 100);
    frame
}

fn small_hello() -> serde_json::Value {
    hello(&json!({"sample_type": "u8", "effects": ["contact_window"],
        "contact_window": {"margin_px": 0}}))
}

/// Asserts that a message is the answer to [`small_frame`].
fn assert_small_answer(message: Option<(u8, Vec<u8>)>, sequence: u32) {
    let (kind, message) = message.expect("the session is over");
    assert_eq!(kind, opcode::BINARY, "{}", String::from_utf8_lossy(&message));
    let header = FrameHeader::decode(&message).unwrap();
    assert_eq!((header.status, header.sequence), (FrameStatus::Ok, sequence));
    assert_eq!((header.width, header.height, message.len()), (5, 4, HEADER_LEN + 20));
}
