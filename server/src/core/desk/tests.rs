//! Work that begins, waits and ends as the tests tell it.

use std::{
    future::Future,
    pin::Pin,
    sync::mpsc::{Receiver, SyncSender, sync_channel},
    time::Instant,
};

use futures_util::FutureExt;

use super::*;

/// Far more than a busy machine needs: what is lost must fail a test, not hold it up for ever.
const WAIT_MAX: Duration = Duration::from_secs(120);

fn desk(threads: usize) -> Desk<u32> {
    Desk::start(threads, || {}).unwrap()
}

/// Work that a client has asked for.
type Asked<'a, T> = Pin<Box<dyn Future<Output = Result<T, NoResult>> + 'a>>;

/// Asks for work, and waits for nothing.
fn ask<T: Send + 'static>(
    desk: &Desk<u32>,
    client: u32,
    work: impl FnOnce(&Cancel) -> T + Send + 'static,
) -> Asked<'_, T> {
    let mut asked: Asked<'_, T> = Box::pin(desk.work(client, work));
    assert!(asked.as_mut().now_or_never().is_none());
    asked
}

/// A piece of work that tells when it begins, and ends when it is told to.
struct Gate {
    begun: Receiver<()>,
    go: SyncSender<()>,
}

fn gated() -> (Gate, impl FnOnce(&Cancel) + Send + 'static) {
    let (begin, begun) = sync_channel(1);
    let (go, gone) = sync_channel::<()>(1);
    let work = move |_: &Cancel| {
        begin.send(()).unwrap();
        gone.recv_timeout(WAIT_MAX).unwrap();
    };
    (Gate { begun, go }, work)
}

impl Gate {
    fn wait(&self) {
        self.begun.recv_timeout(WAIT_MAX).expect("the work does not begin");
    }
}

#[tokio::test]
async fn work_of_a_client_that_leaves_is_cancelled() {
    let desk = desk(1);
    let (begin, begun) = sync_channel(1);
    let (end, ended) = sync_channel(1);
    let endless = move |cancel: &Cancel| {
        begin.send(()).unwrap();
        let last = Instant::now() + WAIT_MAX;
        while !cancel.is_set() && Instant::now() < last {
            thread::yield_now();
        }
        end.send(cancel.is_set()).unwrap();
    };
    let asked = ask(&desk, 1, endless);
    begun.recv_timeout(WAIT_MAX).unwrap();
    drop(asked);
    assert!(ended.recv_timeout(WAIT_MAX).unwrap());
    assert_eq!(desk.work(1, |_| 5).await, Ok(5));
}

#[tokio::test]
async fn work_that_has_not_begun_is_taken_back() {
    let desk = desk(1);
    let (gate, work) = gated();
    let first = ask(&desk, 1, work);
    gate.wait();
    let (tell, told) = sync_channel(1);
    let left: Vec<_> = (0..OF_CLIENT_MAX)
        .map(|_| {
            let tell = tell.clone();
            ask(&desk, 1, move |_| tell.send(()).unwrap())
        })
        .collect();
    assert_eq!(desk.work(1, |_| ()).await, Err(NoResult::Busy));
    drop(left);
    assert_eq!(desk.shared.state().waiting, 0);
    gate.go.send(()).unwrap();
    assert_eq!(first.await, Ok(()));
    assert_eq!(desk.work(1, |_| 5).await, Ok(5));
    assert!(told.try_recv().is_err(), "work for nobody was done");
}

#[tokio::test]
async fn a_client_never_has_all_threads() {
    let desk = desk(2);
    let ((one, first), (two, second), (other, third)) = (gated(), gated(), gated());
    let asked = [ask(&desk, 1, first), ask(&desk, 1, second), ask(&desk, 2, third)];
    one.wait();
    other.wait();
    assert!(two.begun.try_recv().is_err());
    other.go.send(()).unwrap();
    one.go.send(()).unwrap();
    two.wait();
    two.go.send(()).unwrap();
    for asked in asked {
        assert_eq!(asked.await, Ok(()));
    }
}

#[tokio::test]
async fn clients_take_turns_and_their_work_keeps_its_order() {
    let desk = desk(1);
    let (gate, work) = gated();
    let first = ask(&desk, 1, work);
    gate.wait();
    let order = Arc::new(Mutex::new(Vec::new()));
    let pieces = [(1, 'a'), (1, 'b'), (1, 'c'), (2, 'd'), (3, 'e'), (2, 'f')];
    let asked: Vec<_> = pieces
        .into_iter()
        .map(|(client, name)| {
            let order = Arc::clone(&order);
            ask(&desk, client, move |_| order.lock().unwrap().push(name))
        })
        .collect();
    gate.go.send(()).unwrap();
    assert_eq!(first.await, Ok(()));
    for asked in asked {
        assert_eq!(asked.await, Ok(()));
    }
    assert_eq!(*order.lock().unwrap(), ['d', 'e', 'a', 'f', 'b', 'c']);
}

#[tokio::test]
async fn a_panic_costs_one_piece_and_waiting_is_bounded() {
    let desk = desk(1);
    assert_eq!(desk.work(1, |_| panic!("as told")).await, Err::<(), _>(NoResult::Broken));
    let (gate, work) = gated();
    let _first = ask(&desk, 0, work);
    gate.wait();
    let mut waiting = Vec::new();
    for client in 0..2 * WAITING_MAX as u32 {
        let mut asked: Asked<'_, ()> = Box::pin(desk.work(client, |_| ()));
        let is_refused = asked.as_mut().now_or_never() == Some(Err(NoResult::Busy));
        assert_eq!(is_refused, client >= WAITING_MAX as u32);
        waiting.push(asked);
    }
    gate.go.send(()).unwrap();
    drop(waiting);
    assert_eq!(desk.work(1, |_| 5).await, Ok(5));
    assert!(desk.shared.state().clients.len() <= 1);
}
