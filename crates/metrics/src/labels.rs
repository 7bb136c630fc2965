//! The labels metrics carry.

use std::borrow::Cow;

use prometheus_client::encoding::{EncodeLabelSet, EncodeLabelValue, LabelValueEncoder};

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
pub(crate) struct StageLabels {
    pub(crate) tier: String,
    pub(crate) stage: &'static str,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
pub(crate) struct MapLabels {
    pub(crate) transport: Word,
    pub(crate) outcome: Word,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
pub(crate) struct LateLabels {
    pub(crate) stage: Word,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
pub(crate) struct CodeLabels {
    pub(crate) code: Word,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
pub(crate) struct ShedLabels {
    pub(crate) reason: Word,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
pub(crate) struct GrantLabels {
    pub(crate) what: Word,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
pub(crate) struct ReloadLabels {
    pub(crate) outcome: Word,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
pub(crate) struct RequestLabels {
    pub(crate) route: Word,
    pub(crate) status: u16,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
pub(crate) struct ModelLabels {
    pub(crate) tier: String,
    pub(crate) atlas_hash: String,
    pub(crate) onnx_sha256: String,
    pub(crate) backend: String,
    pub(crate) default: Word,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
pub(crate) struct SolveLabels {
    pub(crate) outcome: Word,
}

/// A label value that is one of a few fixed words.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) struct Word(pub(crate) &'static str);

impl EncodeLabelValue for Word {
    fn encode(&self, encoder: &mut LabelValueEncoder<'_>) -> Result<(), std::fmt::Error> {
        EncodeLabelValue::encode(&self.0, encoder)
    }
}

/// Why work was turned away.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Shed {
    /// Every place for sessions is taken.
    Sessions,
    /// Every place for posted maps is taken.
    Requests,
    /// The token has all the sessions it may have.
    TokenSessions,
    /// The client sends more requests a second than it may.
    Rate,
    /// Too many hellos wait to be worked out, or one takes too long.
    Hellos,
}

impl Shed {
    pub(crate) const ALL: [Self; 5] =
        [Self::Sessions, Self::Requests, Self::TokenSessions, Self::Rate, Self::Hellos];

    pub(crate) fn word(self) -> Word {
        Word(match self {
            Self::Sessions => "sessions",
            Self::Requests => "requests",
            Self::TokenSessions => "token_sessions",
            Self::Rate => "rate",
            Self::Hellos => "hellos",
        })
    }
}

/// How a map came in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Transport {
    /// Posted.
    Http,
    /// In a session.
    Session,
    /// Posted by a client of the Open Inference Protocol.
    Oip,
}

/// Where a deadline was found to have passed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Stage {
    /// Before the map entered the slot.
    Admission,
    /// When a thread took it from the slot.
    Dequeue,
    /// Decoded, but what is left of the time is less than any inference takes.
    Inference,
    /// Rendered, but not yet sent.
    Sending,
}

impl Stage {
    pub(crate) const ALL: [Self; 4] =
        [Self::Admission, Self::Dequeue, Self::Inference, Self::Sending];

    pub(crate) fn word(self) -> Word {
        Word(match self {
            Self::Admission => "admission",
            Self::Dequeue => "dequeue",
            Self::Inference => "inference",
            Self::Sending => "sending",
        })
    }
}

/// What the labels of a tier say.
#[derive(Debug, Clone)]
pub struct TierLabels<'a> {
    /// Its number among all tiers of all fingers.
    pub number: usize,
    /// Its name, after that of its finger if that is not the default.
    pub name: Cow<'a, str>,
    /// Hash of its atlas.
    pub atlas_hash: &'a str,
    /// SHA-256 of its file.
    pub onnx_sha256: &'a str,
    /// What runs it, with version.
    pub backend: &'a str,
    /// Whether clients get it unasked.
    pub is_default: bool,
    /// Whether new clients get it at all.
    pub is_offered: bool,
}
