//! How many requests a second one client may send: a token bucket each.

use std::{
    net::{IpAddr, Ipv6Addr},
    num::NonZeroU32,
    sync::Arc,
};

use governor::{
    Quota, RateLimiter,
    clock::{Clock, MonotonicClock},
    middleware::NoOpMiddleware,
    state::keyed::HashMapStateStore,
};
use papilla_proto::{ErrorCode, Problem};

/// Beyond so many buckets the full ones are thrown away: their clients have been silent.
const BUCKETS_MAX: usize = 4096;

/// A client, as far as one can be told from another.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(crate) enum Key {
    /// That of a token, by its name.
    Token(Arc<str>),
    /// That of an address.
    Address(IpAddr),
}

impl Key {
    pub(crate) fn of_address(address: IpAddr) -> Self {
        Self::Address(network_of(address))
    }
}

/// The address that stands for a client: one has a whole /64 of IPv6 to itself.
pub(crate) fn network_of(address: IpAddr) -> IpAddr {
    match address {
        IpAddr::V4(_) => address,
        IpAddr::V6(v6) => IpAddr::V6(Ipv6Addr::from_bits(v6.to_bits() >> 64 << 64)),
    }
}

/// All buckets.
pub(super) struct Rates<C: Clock = MonotonicClock> {
    per_s: NonZeroU32,
    buckets: RateLimiter<Key, HashMapStateStore<Key>, C, NoOpMiddleware<C::Instant>>,
    clock: C,
}

impl Rates {
    /// None if any rate is allowed.
    pub(super) fn new(per_s: u32, burst: Option<NonZeroU32>) -> Option<Self> {
        Some(Self::with_clock(NonZeroU32::new(per_s)?, burst, MonotonicClock))
    }
}

impl<C: Clock + Clone> Rates<C> {
    fn with_clock(per_s: NonZeroU32, burst: Option<NonZeroU32>, clock: C) -> Self {
        let quota = Quota::per_second(per_s).allow_burst(burst.unwrap_or(per_s));
        let buckets = RateLimiter::new(quota, HashMapStateStore::default(), clock.clone());
        Self { per_s, buckets, clock }
    }

    /// Takes one request's worth from the client's bucket.
    ///
    /// # Errors
    /// It holds less.
    pub(super) fn check(&self, key: &Key) -> Result<(), Problem> {
        if self.buckets.len() >= BUCKETS_MAX {
            self.buckets.retain_recent();
        }
        self.buckets.check_key(key).map_err(|refused| {
            let wait = refused.wait_time_from(self.clock.now());
            let (per_s, wait_ms) = (self.per_s, wait.as_millis() + 1);
            let message =
                format!("more than {per_s} requests a second; the next is taken in {wait_ms} ms");
            Problem::new(ErrorCode::RateLimited, message)
        })
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use governor::clock::FakeRelativeClock;

    use super::*;

    fn key(text: &str) -> Key {
        Key::of_address(text.parse().unwrap())
    }

    fn rates(per_s: u32, burst: u32) -> (Rates<FakeRelativeClock>, FakeRelativeClock) {
        let clock = FakeRelativeClock::default();
        let per_s = NonZeroU32::new(per_s).unwrap();
        (Rates::with_clock(per_s, NonZeroU32::new(burst), clock.clone()), clock)
    }

    #[test]
    fn a_client_has_its_burst_and_then_its_rate() {
        let (rates, clock) = rates(10, 20);
        let (a, b) = (key("10.0.0.1"), key("10.0.0.2"));
        let taken =
            |key: &Key, tries: usize| (0..tries).filter(|_| rates.check(key).is_ok()).count();
        assert_eq!(taken(&a, 100), 20);
        assert_eq!(taken(&b, 5), 5, "one client takes nothing from another");
        clock.advance(Duration::from_millis(99));
        assert_eq!(taken(&a, 100), 0);
        let refused = rates.check(&a).unwrap_err();
        assert_eq!(refused.code, ErrorCode::RateLimited);
        assert!(refused.to_string().contains("in 2 ms"), "{refused}");
        clock.advance(Duration::from_millis(401));
        assert_eq!(taken(&a, 100), 5);
        clock.advance(Duration::from_secs(60));
        assert_eq!(taken(&a, 100), 20, "a bucket holds no more than its burst");
        assert!(Rates::new(0, None).is_none());
    }

    #[test]
    fn silent_clients_are_forgotten() {
        let (rates, clock) = rates(100, 1);
        for n in 0..3 * BUCKETS_MAX as u32 {
            clock.advance(Duration::from_millis(1));
            rates.check(&Key::of_address(IpAddr::from(n.to_be_bytes()))).unwrap();
        }
        let left = rates.buckets.len();
        assert!(left <= BUCKETS_MAX, "{left}");
    }

    #[test]
    fn one_network_of_ipv6_is_one_client() {
        assert_eq!(key("2001:db8::1"), key("2001:db8::ffff:1"));
        assert_ne!(key("2001:db8::1"), key("2001:db8:0:1::1"));
    }
}
