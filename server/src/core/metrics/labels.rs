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
