//! The labels metrics carry.

use prometheus_client::encoding::{EncodeLabelSet, EncodeLabelValue, LabelValueEncoder};

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
pub(super) struct StageLabels {
    pub(super) tier: String,
    pub(super) stage: &'static str,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
pub(super) struct MapLabels {
    pub(super) transport: Word,
    pub(super) outcome: Word,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
pub(super) struct LateLabels {
    pub(super) stage: Word,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
pub(super) struct CodeLabels {
    pub(super) code: Word,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
pub(super) struct ShedLabels {
    pub(super) reason: Word,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
pub(super) struct ReloadLabels {
    pub(super) outcome: Word,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
pub(super) struct RequestLabels {
    pub(super) route: Word,
    pub(super) status: u16,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
pub(super) struct ModelLabels {
    pub(super) tier: String,
    pub(super) atlas_hash: String,
    pub(super) onnx_sha256: String,
    pub(super) backend: String,
    pub(super) default: Word,
}

/// A label value that is one of a few fixed words.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct Word(pub(super) &'static str);

impl EncodeLabelValue for Word {
    fn encode(&self, encoder: &mut LabelValueEncoder<'_>) -> Result<(), std::fmt::Error> {
        EncodeLabelValue::encode(&self.0, encoder)
    }
}

/// Why work was turned away.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum Shed {
    /// Every place for sessions is taken.
    Sessions,
    /// Every place for posted maps is taken.
    Requests,
    /// The token has all the sessions it may have.
    TokenSessions,
    /// The client sends more requests a second than it may.
    Rate,
}

impl Shed {
    pub(super) const ALL: [Self; 4] =
        [Self::Sessions, Self::Requests, Self::TokenSessions, Self::Rate];

    pub(super) fn word(self) -> Word {
        Word(match self {
            Self::Sessions => "sessions",
            Self::Requests => "requests",
            Self::TokenSessions => "token_sessions",
            Self::Rate => "rate",
        })
    }
}

/// How a map came in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum Transport {
    /// Posted.
    Http,
    /// In a session.
    Session,
    /// Posted by a client of the Open Inference Protocol.
    Oip,
}

/// Where a deadline was found to have passed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum Stage {
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
    pub(super) const ALL: [Self; 4] =
        [Self::Admission, Self::Dequeue, Self::Inference, Self::Sending];

    pub(super) fn word(self) -> Word {
        Word(match self {
            Self::Admission => "admission",
            Self::Dequeue => "dequeue",
            Self::Inference => "inference",
            Self::Sending => "sending",
        })
    }
}

/// What the labels of a tier say.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TierLabels<'a> {
    pub(crate) name: &'a str,
    pub(crate) atlas_hash: &'a str,
    pub(crate) onnx_sha256: &'a str,
    /// What runs it, with version.
    pub(crate) backend: &'a str,
    /// Whether clients get it unasked.
    pub(crate) is_default: bool,
    /// Whether new clients get it at all.
    pub(crate) is_offered: bool,
}
