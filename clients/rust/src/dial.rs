//! Opens the TCP connection of a session, with buffers for whole frames.

use std::io;

use tokio::net::{TcpSocket, TcpStream, lookup_host};

/// Buffer of the system for each direction, bytes: more than the largest frame. With less a
/// sender waits for room in the middle of a frame (docs/concepts/real-time.md).
const SOCKET_BUFFER: u32 = 512 * 1024;

/// Connects to `server` (host and port): buffers for a whole frame, `TCP_NODELAY` set.
///
/// # Errors
/// The name has no address, or nobody listens.
pub async fn dial(server: &str) -> io::Result<TcpStream> {
    let mut last = io::Error::new(io::ErrorKind::NotFound, "the name has no address");
    for address in lookup_host(server).await? {
        let socket = if address.is_ipv4() { TcpSocket::new_v4() } else { TcpSocket::new_v6() }?;
        // Before connecting: the window's scale is agreed on then.
        socket.set_recv_buffer_size(SOCKET_BUFFER)?;
        socket.set_send_buffer_size(SOCKET_BUFFER)?;
        match socket.connect(address).await {
            Ok(stream) => {
                stream.set_nodelay(true)?;
                return Ok(stream);
            }
            Err(error) => last = error,
        }
    }
    Err(last)
}
