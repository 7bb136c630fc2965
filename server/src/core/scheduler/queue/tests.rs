//! Turns by what frames cost, without threads: costs are given, not measured.

use proptest::prelude::*;
use tokio::sync::mpsc;

use super::{super::account::LONG, *};
use crate::core::buffers::Recycler;

/// A session with some fingers, all of which have a frame whenever one is done.
struct Client {
    account: Arc<Account>,
    slots: Vec<Arc<Slot>>,
}

fn client(fingers: usize) -> Client {
    let account = Account::new(fingers);
    let slot = |_| {
        let (sink, _) = mpsc::channel(1);
        Arc::new(Slot::new(Recycler::default(), Arc::new(sink), Arc::clone(&account)))
    };
    let slots = (0..fingers).map(slot).collect();
    Client { account, slots }
}

impl Client {
    fn enter(&self, queue: &Queue) {
        assert!(self.slots.iter().all(|slot| queue.push(Arc::clone(slot))));
    }

    fn owns(&self, turn: &Turn) -> bool {
        Arc::ptr_eq(&self.account, turn.slot.account())
    }
}

fn queue_of(threads: usize) -> Queue {
    let queue = Queue::new(64, threads);
    queue.remember_light();
    queue
}

fn ms(ms: u64) -> Duration {
    Duration::from_millis(ms)
}

/// A frame that held a thread for this time, none of it in the network.
fn spent(busy: Duration) -> Spent {
    Spent { busy, beside_network: Some(busy) }
}

fn pop(queue: &Queue) -> Option<Turn> {
    match queue.pop(Duration::ZERO) {
        Next::Turn(turn) => Some(turn),
        Next::Nothing | Next::Closed => None,
    }
}

/// One short frame of a client, after which it is known to be light.
fn show_light(queue: &Queue, client: &Client) {
    assert!(queue.push(Arc::clone(&client.slots[0])));
    let turn = pop(queue).unwrap();
    assert!(client.owns(&turn));
    queue.done(turn, spent(ms(1)), false);
}

/// How many of `turns` turns of one thread each client gets, if its frames cost as given.
fn shared(turns: usize, clients: &[(Client, Duration)]) -> Vec<usize> {
    let queue = queue_of(1);
    clients.iter().for_each(|(client, _)| client.enter(&queue));
    let mut counts = vec![0; clients.len()];
    for _ in 0..turns {
        let turn = pop(&queue).unwrap();
        let whose = clients.iter().position(|(client, _)| client.owns(&turn)).unwrap();
        counts[whose] += 1;
        queue.done(turn, spent(clients[whose].1), true);
    }
    counts
}

#[test]
fn ten_fingers_have_the_share_of_one_session() {
    let counts = shared(300, &[(client(10), ms(5)), (client(1), ms(5)), (client(2), ms(5))]);
    assert!(counts.iter().all(|count| count.abs_diff(100) <= 3), "{counts:?}");
}

#[test]
fn shares_are_of_time_whatever_a_frame_costs() {
    let costs = [ms(900), ms(3), ms(30)];
    let counts = shared(2000, &costs.map(|cost| (client(10), cost)));
    let times: Vec<_> = counts.iter().zip(costs).map(|(&n, cost)| cost * n as u32).collect();
    let (least, most) = (times.iter().min().unwrap(), times.iter().max().unwrap());
    assert!(*most - *least <= 2 * costs[0], "{times:?}");
}

#[test]
fn fingers_of_a_session_go_in_the_order_in_which_they_came() {
    let (queue, one) = (queue_of(1), client(10));
    one.enter(&queue);
    for round in 0..3 {
        for slot in &one.slots {
            let turn = pop(&queue).unwrap();
            assert!(Arc::ptr_eq(&turn.slot, slot), "round {round}");
            queue.done(turn, spent(ms(1)), true);
        }
    }
}

#[test]
fn a_light_session_that_arrives_goes_ahead_of_all_that_wait() {
    let (queue, heavy, light) = (queue_of(1), client(10), client(1));
    heavy.enter(&queue);
    for _ in 0..7 {
        let turn = pop(&queue).unwrap();
        queue.done(turn, spent(ms(400)), true);
    }
    // The light session sends a frame while the thread is busy with another frame of the heavy one.
    let busy = pop(&queue).unwrap();
    light.enter(&queue);
    queue.done(busy, spent(ms(400)), true);
    assert!(light.owns(&pop(&queue).unwrap()));
}

#[test]
fn heavy_sessions_leave_a_thread_to_light_ones() {
    let (queue, light) = (queue_of(2), client(1));
    let heavy = [client(10), client(10)];
    show_light(&queue, &light);
    heavy.iter().for_each(|heavy| heavy.enter(&queue));
    let first = pop(&queue).unwrap();
    assert!(pop(&queue).is_none(), "heavy sessions hold all threads");
    for _ in 0..5 {
        light.enter(&queue);
        let turn = pop(&queue).unwrap();
        assert!(light.owns(&turn), "the light one waits");
        queue.done(turn, spent(ms(2)), false);
    }
    queue.done(first, spent(ms(3000)), true);
    // The heavy sessions still have one thread.
    let next = pop(&queue).unwrap();
    assert!(heavy[1].owns(&next), "it has cost less");
    assert!(pop(&queue).is_none());
    // Once the queue is closed, no thread is kept free.
    queue.close();
    assert!(pop(&queue).is_some());
}

#[test]
fn a_session_is_heavy_by_what_its_frames_take_beside_the_network() {
    let (queue, light, other) = (queue_of(2), client(1), client(10));
    show_light(&queue, &light);
    show_light(&queue, &other);
    other.enter(&queue);
    let held: Vec<_> = (0..2).map(|_| pop(&queue).unwrap()).collect();
    for turn in held {
        // Time in the network does not count, since the operator chooses the networks.
        queue.done(turn, Spent { busy: ms(500), beside_network: Some(ms(1)) }, true);
    }
    let held: Vec<_> = (0..2).map(|_| pop(&queue).unwrap()).collect();
    for turn in held {
        queue.done(turn, spent(LONG * 3 + ms(1)), true);
    }
    light.enter(&queue);
    let turn = pop(&queue).unwrap();
    assert!(light.owns(&turn));
    queue.done(turn, spent(ms(1)), false);
    let _one = pop(&queue).unwrap();
    assert!(pop(&queue).is_none(), "it was short once");
}

#[test]
fn a_cold_press_makes_no_session_heavy_and_long_frames_one_after_the_other_do() {
    let (queue, light, other) = (queue_of(2), client(1), client(10));
    show_light(&queue, &light);
    show_light(&queue, &other);
    other.enter(&queue);
    let take = |took: Duration| {
        let held: Vec<_> = std::iter::from_fn(|| pop(&queue)).take(2).collect();
        let count = held.len();
        held.into_iter().for_each(|turn| queue.done(turn, spent(took), true));
        count
    };
    assert_eq!(take(LONG + ms(4)), 2);
    assert_eq!(take(LONG + ms(4)), 2, "two cold presses");
    let counts: Vec<_> = (0..8).map(|_| take(LONG + ms(4))).collect();
    assert_eq!(counts.last(), Some(&1), "{counts:?}");
}

#[test]
fn heavy_sessions_have_all_threads_where_no_light_one_is_about() {
    let (queue, heavy) = (queue_of(3), client(10));
    heavy.enter(&queue);
    assert_eq!((0..3).filter(|_| pop(&queue).is_some()).count(), 3);
    // With one thread there is none to keep free.
    let (queue, light, heavy) = (queue_of(1), client(1), client(10));
    show_light(&queue, &light);
    heavy.enter(&queue);
    assert!(pop(&queue).is_some());
}

#[test]
fn a_pause_earns_nothing_and_debts_are_forgotten_in_part() {
    let (queue, busy, idle) = (queue_of(1), client(1), client(1));
    show_light(&queue, &idle);
    busy.enter(&queue);
    for _ in 0..100 {
        let turn = pop(&queue).unwrap();
        queue.done(turn, spent(ms(5)), true);
    }
    // From now on both want all the thread time. The one that paused gets no more than half.
    idle.enter(&queue);
    let mut counts = [0_usize; 2];
    for _ in 0..100 {
        let turn = pop(&queue).unwrap();
        counts[usize::from(idle.owns(&turn))] += 1;
        queue.done(turn, spent(ms(5)), true);
    }
    assert!(counts[0].abs_diff(counts[1]) <= 2, "{counts:?}");
    // A frame that costs an hour of thread time leaves, after a pause, one second of debt.
    let turn = pop(&queue).unwrap();
    let debtor = if idle.owns(&turn) { &idle } else { &busy };
    queue.done(turn, spent(Duration::from_secs(3600)), false);
    debtor.enter(&queue);
    let waited = (0..1000).take_while(|_| {
        let turn = pop(&queue).unwrap();
        let is_debtor = debtor.owns(&turn);
        queue.done(turn, spent(ms(5)), true);
        !is_debtor
    });
    assert!((150..=250).contains(&waited.count()), "a second of frames of 5 ms");
}

proptest! {
    /// In any order of arrivals and costs, every slot that enters has one turn, and the queue ends
    /// empty.
    #[test]
    fn every_slot_that_enters_has_its_turn(
        threads in 1_usize..4,
        steps in prop::collection::vec((0_usize..5, 0_usize..3, 0_u64..40, any::<bool>()), 1..200),
    ) {
        let queue = Queue::new(8, threads);
        let clients: Vec<_> = (0..5).map(|n| client(n % 3 + 1)).collect();
        // `Slot` ensures that a slot is in the queue or with a thread at most once.
        let mut is_in = vec![[false; 3]; clients.len()];
        let (mut held, mut entered, mut turns) = (Vec::new(), 0, 0);
        let place = |turn: &Turn| {
            let whose = clients.iter().position(|client| client.owns(turn)).unwrap();
            let of = |slot: &Arc<Slot>| Arc::ptr_eq(slot, &turn.slot);
            (whose, clients[whose].slots.iter().position(of).unwrap())
        };
        for (whose, finger, cost, is_again) in steps {
            let finger = finger % clients[whose].slots.len();
            if !is_in[whose][finger] {
                let waiting = queue.len();
                let is_taken = queue.push(Arc::clone(&clients[whose].slots[finger]));
                prop_assert_eq!(is_taken, waiting < 8);
                is_in[whose][finger] = is_taken;
                entered += usize::from(is_taken);
            }
            if held.len() < threads && let Some(turn) = pop(&queue) {
                let (whose, finger) = place(&turn);
                prop_assert!(is_in[whose][finger]);
                turns += 1;
                held.push(turn);
            }
            if held.len() == threads {
                let turn = held.swap_remove(cost as usize % threads);
                let (whose, finger) = place(&turn);
                is_in[whose][finger] = is_again;
                entered += usize::from(is_again);
                queue.done(turn, spent(ms(cost)), is_again);
            }
        }
        for turn in held.drain(..) {
            queue.done(turn, spent(ms(1)), false);
        }
        while let Some(turn) = pop(&queue) {
            turns += 1;
            queue.done(turn, spent(ms(1)), false);
        }
        prop_assert_eq!((queue.len(), turns), (0, entered));
        prop_assert!(!queue.push(Arc::clone(&clients[0].slots[0])) || pop(&queue).is_some());
        queue.close();
        prop_assert!(matches!(queue.pop(Duration::ZERO), Next::Closed));
    }
}
