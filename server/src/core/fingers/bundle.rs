//! Reads the bundle of a finger: its description, atlas, networks and contact model.

use std::{path::Path, sync::Arc};

use papilla_proto::contact::DEFAULT_FINGER;
use papilla_session_contact::ContactAssets;

use super::Loaded;
use crate::{
    StartError,
    core::catalogue::{
        Catalogue, Loading, Similar, Tier,
        assets::{Assets, CONTACT, CONTACT_ERRORS, FINGER},
        golden::{self, GoldenError},
    },
};

/// A finger's folder, read and checked.
pub(crate) struct Bundle {
    pub(crate) catalogue: Catalogue,
    pub(crate) contact: Option<ContactAssets>,
    /// Bytes of the files that were read.
    pub(crate) files_bytes: u64,
}

/// Why a folder does not make a finger.
#[derive(Debug, thiserror::Error)]
pub(crate) enum BundleError {
    #[error(transparent)]
    File(#[from] StartError),
    #[error("tier {tier}: {source}")]
    Golden { tier: String, source: GoldenError },
    #[error("{0}")]
    Changed(String),
}

/// Said of a network of another finger.
const OTHER_FINGER: &str = "the network was trained on simulations of another finger, or of this one \
    before its dimensions or tissues were changed, than finger.contact was made of; train it anew, or \
    take it away and lend one of the default finger (\"trained_on\": \"default\" in index.json)";

/// Whether a network was trained on another finger than the one with this hash of dimensions and
/// tissues, which may have the same atlas. An empty hash is not known. Networks that are lent are
/// known to be of another finger, and closed forms are of none.
fn is_of_other_finger(tier: &Tier, finger_sha256: &str) -> bool {
    !finger_sha256.is_empty()
        && tier.kind.is_network()
        && tier.trained_on.is_none()
        && tier.finger_sha256.as_deref() != Some(finger_sha256)
}

impl Bundle {
    /// Reads and checks the folder of the finger called `name`, which gets the place `place`.
    /// Models that `running` has loaded already are shared with it and not loaded again. `default`
    /// is the finger whose networks this one may borrow. None: `is_to_stop` was true before the
    /// folder was read.
    ///
    /// # Errors
    /// A file is missing or unreadable, two files contradict each other, or a network fails its
    /// golden answers.
    pub(crate) fn read(
        folder: &Path,
        (name, place): (&str, usize),
        loading: Loading<'_>,
        default: &Catalogue,
        running: Option<&Loaded>,
        is_to_stop: &dyn Fn() -> bool,
    ) -> Result<Option<Self>, BundleError> {
        let Some(assets) = Assets::of_finger(folder, is_to_stop)? else { return Ok(None) };
        let bad = |file: &str, reason: String| {
            let (file, origin) = (file.to_owned(), assets.origin.clone());
            StartError::Unusable { file, origin, reason }
        };
        // Only the simulation programs need the finger's description, but a folder without one is
        // no finger.
        assets.require(FINGER)?;
        let lender = Similar { name: DEFAULT_FINGER, atlas: &default.atlas };
        let before = running.map(|running| &*running.catalogue);
        let catalogue = Catalogue::load(&assets, loading.of_finger(lender), before)?;
        let is_known = |tier: &Tier| {
            let same = |known: &&Tier| Arc::ptr_eq(&known.held, &tier.held);
            before.is_some_and(|before| before.tiers.iter().find(same).is_some())
        };
        for tier in catalogue.tiers.iter().filter(|tier| !is_known(tier)) {
            if let Some(model) = tier.model() {
                golden::check(catalogue.golden_states(), model.as_ref(), tier.relative_l2_p95)
                    .map_err(|source| BundleError::Golden { tier: tier.name.clone(), source })?;
            }
        }
        let contact = match assets.get(CONTACT) {
            Some(bytes) => {
                let (errors, skin) = (assets.get(CONTACT_ERRORS), &catalogue.skin);
                let contact = ContactAssets::read(bytes, errors, &catalogue.atlas, skin)
                    .and_then(|contact| assets.require_finger_of(&contact).map(|()| contact));
                Some(contact.map_err(|error| bad(CONTACT, error.to_string()))?)
            }
            None => None,
        };
        if let Some(contact) = &contact {
            let finger = &contact.model.header().finger_sha256;
            if let Some(tier) = catalogue.tiers.iter().find(|tier| is_of_other_finger(tier, finger))
            {
                return Err(bad(&format!("{}.json", tier.name), OTHER_FINGER.to_owned()).into());
            }
        }
        let catalogue = Catalogue { name: name.to_owned(), place, ..catalogue };
        Ok(Some(Self { catalogue, contact, files_bytes: assets.bytes() }))
    }
}
