//! Clients that send without a pause, on threads of their own, within a budget of bytes.

use std::{
    io::{Read, Write},
    net::{Shutdown, SocketAddr, TcpStream},
    sync::{
        Arc,
        atomic::{AtomicBool, AtomicU64, Ordering},
    },
    thread::{self, JoinHandle},
    time::Duration,
};

/// What a flooding client sends: `opening` once, `block` again and again.
#[derive(Clone)]
pub(crate) struct Flood {
    pub(crate) opening: Vec<u8>,
    pub(crate) block: Vec<u8>,
}

/// Flooding clients; dropped, they stop.
pub(crate) struct Flooding {
    is_stopped: Arc<AtomicBool>,
    sent_bytes: Vec<Arc<AtomicU64>>,
    budget_bytes: u64,
    threads: Vec<JoinHandle<()>>,
}

impl Flooding {
    /// So many clients; one that is turned away comes again. Each ends once it has sent its
    /// budget, so a server that serves a flood first comes to its end.
    pub(crate) fn start(
        address: SocketAddr,
        flood: &Flood,
        clients: usize,
        budget_bytes: u64,
    ) -> Self {
        let is_stopped = Arc::new(AtomicBool::new(false));
        let sent_bytes: Vec<_> = (0..clients).map(|_| Arc::default()).collect();
        let threads = sent_bytes.iter().map(|sent: &Arc<AtomicU64>| {
            let (flood, is_stopped, sent) = (flood.clone(), is_stopped.clone(), sent.clone());
            thread::spawn(move || {
                while !is_stopped.load(Ordering::Relaxed)
                    && sent.load(Ordering::Relaxed) < budget_bytes
                {
                    flood_once(address, &flood, &is_stopped, &sent, budget_bytes);
                }
            })
        });
        let threads = threads.collect();
        Self { is_stopped, sent_bytes, budget_bytes, threads }
    }

    /// Waits until every client has sent something.
    pub(crate) async fn until_under_way(&self) {
        while self.sent_bytes.iter().any(|sent| sent.load(Ordering::Relaxed) == 0) {
            tokio::time::sleep(Duration::from_millis(5)).await;
        }
    }

    /// Whether no client has come to the end of its budget.
    pub(crate) fn is_going_on(&self) -> bool {
        self.sent_bytes.iter().all(|sent| sent.load(Ordering::Relaxed) < self.budget_bytes)
    }
}

impl Drop for Flooding {
    fn drop(&mut self) {
        self.is_stopped.store(true, Ordering::Relaxed);
        for thread in self.threads.drain(..) {
            let _ = thread.join();
        }
    }
}

/// One connection, until the server ends it or the budget is spent.
fn flood_once(
    address: SocketAddr,
    flood: &Flood,
    is_stopped: &AtomicBool,
    sent: &AtomicU64,
    budget_bytes: u64,
) {
    let Ok(mut stream) = TcpStream::connect(address) else { return };
    let Ok(mut reading) = stream.try_clone() else { return };
    // A write that waits for room looks up now and then whether it is to stop.
    let _ = stream.set_write_timeout(Some(Duration::from_millis(100)));
    // What is sent back is read, so that the server has no reason to wait.
    let reader = thread::spawn(move || {
        let mut unread = vec![0; 1 << 16];
        while matches!(reading.read(&mut unread), Ok(1..)) {}
    });
    let _ = stream.write_all(&flood.opening);
    let mut at = 0;
    while !is_stopped.load(Ordering::Relaxed) && sent.load(Ordering::Relaxed) < budget_bytes {
        match stream.write(&flood.block[at..]) {
            Ok(n) => {
                at = (at + n) % flood.block.len();
                sent.fetch_add(n as u64, Ordering::Relaxed);
            }
            Err(error) if error.kind() == std::io::ErrorKind::WouldBlock => {}
            Err(_) => break,
        }
    }
    let _ = stream.shutdown(Shutdown::Both);
    let _ = reader.join();
}
