//! Sealing: authenticated encryption under keys that the services share.

use std::time::{Duration, SystemTime, UNIX_EPOCH};

use papilla_proto::{Resumption, SEALED_MAGIC};
use ring::{
    aead::{Aad, CHACHA20_POLY1305, LessSafeKey, NONCE_LEN, Nonce, UnboundKey},
    error::Unspecified,
    rand::{SecureRandom, SystemRandom},
};
use sha2::{Digest, Sha256};

/// Longest message that a session takes, bytes.
pub const SEALED_BYTES_MAX: usize = 1 << 20;

/// What a sealed state begins with; the last byte is the version of the form.
const MAGIC: [u8; 4] = [SEALED_MAGIC[0], SEALED_MAGIC[1], SEALED_MAGIC[2], 1];

/// How long a sealed state is good for. Clocks of two machines may be apart by as much.
const GOOD_FOR: Duration = Duration::from_secs(60);

/// Bytes of a key, of the terms' digest, of the time, and of the tag.
const KEY_LEN: usize = 32;
const DIGEST_LEN: usize = 32;
const TIME_LEN: usize = 8;
const TAG_LEN: usize = 16;

/// Why there are no keys.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum KeyError {
    /// The file has none.
    #[error("it holds no key; `openssl rand -hex 32` makes one")]
    None,
    /// A line is none.
    #[error("line {0} is no key of 64 hexadecimal digits; `openssl rand -hex 32` makes one")]
    Line(usize),
    /// The system gives no random numbers.
    #[error("the system gives no random numbers")]
    Random,
}

/// Why a state is not sealed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum SealError {
    /// It is larger than a message.
    #[error("the state would take {0} bytes; {SEALED_BYTES_MAX} fit in a message")]
    TooLarge(usize),
    /// The system gives no random numbers.
    #[error("the system gives no random numbers")]
    Random,
}

impl From<Unspecified> for SealError {
    fn from(_: Unspecified) -> Self {
        Self::Random
    }
}

/// What a state belongs to: it is of no use anywhere else.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SealedFor {
    tier: String,
    digest: [u8; DIGEST_LEN],
}

impl SealedFor {
    /// Those of a tier and of whatever else shapes the state; the version of the software is added.
    #[must_use]
    pub fn of(tier: &str, parts: &[&[u8]]) -> Self {
        let mut digest = Sha256::new();
        for part in [env!("CARGO_PKG_VERSION").as_bytes(), tier.as_bytes()].iter().chain(parts) {
            // With its length, so that no two lists of parts read alike.
            digest.update((part.len() as u64).to_le_bytes());
            digest.update(part);
        }
        // A longer name is not told in clear: it has one byte for its length.
        let tier = Some(tier).filter(|tier| tier.len() <= u8::MAX.into()).unwrap_or_default();
        Self { tier: tier.to_owned(), digest: digest.finalize().into() }
    }
}

/// Whether a message is a sealed state.
#[must_use]
pub fn is_sealed(message: &[u8]) -> bool {
    message.starts_with(&SEALED_MAGIC)
}

/// The tier that a sealed state names, as long as nobody has opened it a wish like any other.
#[must_use]
pub fn tier_of(sealed: &[u8]) -> Option<&str> {
    let (head, _) = split(sealed)?;
    str::from_utf8(head.get(MAGIC.len() + 1..)?).ok().filter(|tier| !tier.is_empty())
}

/// What is in clear, and what is behind it.
fn split(sealed: &[u8]) -> Option<(&[u8], &[u8])> {
    let tier_len = *sealed.strip_prefix(&MAGIC)?.first()?;
    sealed.split_at_checked(MAGIC.len() + 1 + usize::from(tier_len))
}

/// The keys of a service: the first seals, all open.
#[derive(Debug)]
pub struct Keys {
    keys: Vec<LessSafeKey>,
    random: SystemRandom,
}

impl Keys {
    /// A key of this process alone.
    ///
    /// # Errors
    /// The system gives no random numbers.
    pub fn fresh() -> Result<Self, KeyError> {
        let random = SystemRandom::new();
        let mut key = [0; KEY_LEN];
        random.fill(&mut key).map_err(|_| KeyError::Random)?;
        Ok(Self { keys: vec![of_bytes(&key).ok_or(KeyError::Random)?], random })
    }

    /// Keys of 64 hexadecimal digits, one a line; empty lines and those with # are passed over.
    ///
    /// # Errors
    /// There is none, or a line is none.
    pub fn read(text: &str) -> Result<Self, KeyError> {
        let mut keys = Vec::new();
        for (number, line) in (1..).zip(text.lines()) {
            let line = line.trim();
            if !line.is_empty() && !line.starts_with('#') {
                let key = hexadecimal(line).as_ref().and_then(of_bytes);
                keys.push(key.ok_or(KeyError::Line(number))?);
            }
        }
        if keys.is_empty() {
            return Err(KeyError::None);
        }
        Ok(Self { keys, random: SystemRandom::new() })
    }

    /// Seals a state of a session of these terms.
    ///
    /// # Errors
    /// It is too large, or the system gives no random numbers.
    pub fn seal(
        &self,
        terms: &SealedFor,
        state: &[u8],
        now: SystemTime,
    ) -> Result<Vec<u8>, SealError> {
        let key = self.keys.first().ok_or(SealError::Random)?;
        let head_len = MAGIC.len() + 1 + terms.tier.len();
        let len = head_len + NONCE_LEN + TIME_LEN + DIGEST_LEN + state.len() + TAG_LEN;
        if len > SEALED_BYTES_MAX {
            return Err(SealError::TooLarge(len));
        }
        let mut sealed = Vec::with_capacity(len);
        sealed.extend_from_slice(&MAGIC);
        sealed.push(terms.tier.len() as u8);
        sealed.extend_from_slice(terms.tier.as_bytes());
        let mut nonce = [0; NONCE_LEN];
        self.random.fill(&mut nonce)?;
        sealed.extend_from_slice(&nonce);
        let start = sealed.len();
        sealed.extend_from_slice(&unix_ms(now).to_le_bytes());
        sealed.extend_from_slice(&terms.digest);
        sealed.extend_from_slice(state);
        let (head, content) = sealed.split_at_mut(start);
        let aad = Aad::from(&head[..head_len]);
        let nonce = Nonce::assume_unique_for_key(nonce);
        let tag = key.seal_in_place_separate_tag(nonce, aad, content)?;
        sealed.extend_from_slice(tag.as_ref());
        Ok(sealed)
    }

    /// Opens a sealed state for a session of these terms.
    ///
    /// # Errors
    /// Why the session starts anew: unreadable, expired, or of other terms.
    pub fn open(
        &self,
        terms: &SealedFor,
        sealed: &[u8],
        now: SystemTime,
    ) -> Result<Vec<u8>, Resumption> {
        let (head, rest) = split(sealed).ok_or(Resumption::Unreadable)?;
        let (nonce, content) =
            rest.split_first_chunk::<NONCE_LEN>().ok_or(Resumption::Unreadable)?;
        let opened = self.keys.iter().find_map(|key| {
            let (nonce, mut content) = (Nonce::assume_unique_for_key(*nonce), content.to_vec());
            let len = key.open_in_place(nonce, Aad::from(head), &mut content).ok()?.len();
            content.truncate(len);
            Some(content)
        });
        let mut opened = opened.ok_or(Resumption::Unreadable)?;
        let (sealed_at, rest) =
            opened.split_first_chunk::<TIME_LEN>().ok_or(Resumption::Unreadable)?;
        let digest = rest.first_chunk::<DIGEST_LEN>().ok_or(Resumption::Unreadable)?;
        if *digest != terms.digest {
            return Err(Resumption::OtherTerms);
        }
        let apart_ms = unix_ms(now).abs_diff(u64::from_le_bytes(*sealed_at));
        if u128::from(apart_ms) > GOOD_FOR.as_millis() {
            return Err(Resumption::Expired);
        }
        opened.drain(..TIME_LEN + DIGEST_LEN);
        Ok(opened)
    }
}

fn of_bytes(key: &[u8; KEY_LEN]) -> Option<LessSafeKey> {
    UnboundKey::new(&CHACHA20_POLY1305, key).ok().map(LessSafeKey::new)
}

fn hexadecimal(line: &str) -> Option<[u8; KEY_LEN]> {
    let mut key = [0; KEY_LEN];
    let (pairs, rest) = line.as_bytes().as_chunks::<2>();
    if pairs.len() != KEY_LEN || !rest.is_empty() {
        return None;
    }
    for (byte, pair) in key.iter_mut().zip(pairs) {
        let [high, low] = pair.map(|digit| char::from(digit).to_digit(16));
        *byte = (16 * high? + low?) as u8;
    }
    Some(key)
}

fn unix_ms(time: SystemTime) -> u64 {
    let since = time.duration_since(UNIX_EPOCH).unwrap_or_default();
    u64::try_from(since.as_millis()).unwrap_or(u64::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOW: Duration = Duration::from_secs(1_800_000_000);

    fn now() -> SystemTime {
        UNIX_EPOCH + NOW
    }

    fn terms(tier: &str) -> SealedFor {
        SealedFor::of(tier, &[b"atlas"])
    }

    #[test]
    fn no_bit_of_a_sealed_state_may_change() {
        let keys = Keys::fresh().unwrap();
        let sealed = keys.seal(&terms("nano"), b"state", now()).unwrap();
        assert!(is_sealed(&sealed) && tier_of(&sealed) == Some("nano"));
        assert_eq!(keys.open(&terms("nano"), &sealed, now()), Ok(b"state".to_vec()));
        for bit in 0..8 * sealed.len() {
            let mut forged = sealed.clone();
            forged[bit / 8] ^= 1 << (bit % 8);
            let opened = keys.open(&terms("nano"), &forged, now());
            assert_eq!(opened, Err(Resumption::Unreadable), "bit {bit}");
        }
        for len in 0..sealed.len() {
            assert!(keys.open(&terms("nano"), &sealed[..len], now()).is_err(), "{len} bytes");
        }
    }

    #[test]
    fn a_state_is_good_for_its_terms_and_a_minute() {
        let keys = Keys::fresh().unwrap();
        let sealed = keys.seal(&terms("nano"), b"state", now()).unwrap();
        let open = |terms: SealedFor, now| keys.open(&terms, &sealed, now);
        assert_eq!(open(terms("small"), now()), Err(Resumption::OtherTerms));
        assert_eq!(
            open(SealedFor::of("nano", &[b"at", b"las"]), now()),
            Err(Resumption::OtherTerms)
        );
        assert!(open(terms("nano"), now() + GOOD_FOR).is_ok());
        let late = now() + GOOD_FOR + Duration::from_millis(1);
        assert_eq!(open(terms("nano"), late), Err(Resumption::Expired));
    }

    #[test]
    fn the_first_key_seals_and_all_open() {
        let (old, new) = ("0a".repeat(32), "B1".repeat(32));
        let [before, after] = [&old, &new].map(|key| Keys::read(key).unwrap());
        let both = Keys::read(&format!("# renewed\n{new}\n\n  {old}\n")).unwrap();
        let sealed = |keys: &Keys| keys.seal(&terms("nano"), b"", now()).unwrap();
        let opens = |keys: &Keys, sealed: &[u8]| keys.open(&terms("nano"), sealed, now()).is_ok();
        assert!(opens(&both, &sealed(&before)) && opens(&both, &sealed(&after)));
        assert!(opens(&after, &sealed(&both)) && !opens(&before, &sealed(&both)));
    }

    #[test]
    fn what_is_no_key_is_named_by_its_line() {
        assert_eq!(Keys::read("# none\n\n").unwrap_err(), KeyError::None);
        for bad in ["0", &"0".repeat(63), &"g".repeat(64), &"0".repeat(66)] {
            assert_eq!(Keys::read(&format!("\n{bad}")).unwrap_err(), KeyError::Line(2), "{bad}");
        }
    }

    #[test]
    fn more_than_a_message_is_not_sealed() {
        let keys = Keys::fresh().unwrap();
        let result = keys.seal(&terms("nano"), &vec![0; SEALED_BYTES_MAX], now());
        assert!(matches!(result, Err(SealError::TooLarge(_))), "{result:?}");
    }
}
