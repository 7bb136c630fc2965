//! How many requests a second one client may send: a token bucket each.

use std::{
    collections::HashMap,
    net::{IpAddr, Ipv6Addr},
    num::NonZeroU32,
    sync::{Arc, Mutex, PoisonError},
    time::Instant,
};

use papilla_proto::{ErrorCode, Problem};

use crate::transport::bucket::{Bucket, Rate};

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
pub(super) struct Rates {
    per_s: u32,
    rate: Rate,
    buckets: Mutex<HashMap<Key, Bucket>>,
}

impl Rates {
    /// None if any rate is allowed.
    pub(super) fn new(per_s: u32, burst: Option<NonZeroU32>) -> Option<Self> {
        let per_s = NonZeroU32::new(per_s)?;
        let rate = Rate::new(per_s.get(), burst.unwrap_or(per_s).get());
        Some(Self { per_s: per_s.get(), rate, buckets: Mutex::default() })
    }

    /// Takes one request's worth from the client's bucket.
    ///
    /// # Errors
    /// It holds less.
    pub(super) fn check(&self, key: &Key) -> Result<(), Problem> {
        self.check_at(key, Instant::now())
    }

    fn check_at(&self, key: &Key, now: Instant) -> Result<(), Problem> {
        let mut buckets = self.buckets.lock().unwrap_or_else(PoisonError::into_inner);
        if buckets.len() >= BUCKETS_MAX {
            buckets.retain(|_, bucket| !bucket.is_full(now));
        }
        let mut bucket = buckets.get(key).copied().unwrap_or_else(|| Bucket::full(now));
        bucket.take(self.rate, now).map_err(|wait| {
            let (per_s, wait_ms) = (self.per_s, wait.as_millis() + 1);
            let message =
                format!("more than {per_s} requests a second; the next is taken in {wait_ms} ms");
            Problem::new(ErrorCode::RateLimited, message)
        })?;
        buckets.insert(key.clone(), bucket);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    fn key(text: &str) -> Key {
        Key::of_address(text.parse().unwrap())
    }

    #[test]
    fn a_client_has_its_burst_and_then_its_rate() {
        let rates = Rates::new(10, NonZeroU32::new(20)).unwrap();
        let (a, b, start) = (key("10.0.0.1"), key("10.0.0.2"), Instant::now());
        let taken = |key: &Key, ms: u64, tries: usize| {
            let now = start + Duration::from_millis(ms);
            (0..tries).filter(|_| rates.check_at(key, now).is_ok()).count()
        };
        assert_eq!(taken(&a, 0, 100), 20);
        assert_eq!(taken(&b, 0, 5), 5, "one client takes nothing from another");
        assert_eq!(taken(&a, 99, 100), 0);
        assert_eq!(taken(&a, 500, 100), 5);
        assert_eq!(taken(&a, 60_000, 100), 20, "a bucket holds no more than its burst");
        assert_eq!(rates.check_at(&a, start).unwrap_err().code, ErrorCode::RateLimited);
        assert!(Rates::new(0, None).is_none());
    }

    #[test]
    fn silent_clients_are_forgotten() {
        let rates = Rates::new(100, NonZeroU32::new(1)).unwrap();
        let start = Instant::now();
        for n in 0..3 * BUCKETS_MAX as u32 {
            let now = start + Duration::from_millis(n.into());
            rates.check_at(&Key::of_address(IpAddr::from(n.to_be_bytes())), now).unwrap();
        }
        let left = rates.buckets.lock().unwrap().len();
        assert!(left <= BUCKETS_MAX, "{left}");
    }

    #[test]
    fn one_network_of_ipv6_is_one_client() {
        assert_eq!(key("2001:db8::1"), key("2001:db8::ffff:1"));
        assert_ne!(key("2001:db8::1"), key("2001:db8:0:1::1"));
    }
}
