//! Objects and gaps in, forces out, several fingers.

mod answers;
mod hellos;
mod poses;
mod traction;

use papilla_proto::{FrameHeader, contact::Touch};

use crate::support::Socket;

const VERTICES: usize = 361;

/// The next answer's header and touch, and the whole payload.
async fn hear(socket: &mut Socket) -> (FrameHeader, Touch, Vec<u8>) {
    let (header, payload) = socket.hear_frame().await;
    (header, Touch::decode(&payload).unwrap_or_default(), payload)
}
