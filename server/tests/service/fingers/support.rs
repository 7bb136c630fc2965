//! Folders of fingers for the tests: planes of an elastic half-space that differ in size, stiffness
//! and network.

use std::{fs, path::Path};

use papilla_proto::atlas::Atlas;
use papilla_server::Config;
use serde_json::{Value, json};
use tempfile::TempDir;

use crate::support::{
    Service, add_model_of_gain,
    contact::{MODULUS_MPA, atlas, atlas_of, model, model_on},
    model_folder_on, write,
};

/// What the network of `thumb` multiplies the pressure by.
pub(crate) const THUMB_GAIN: f32 = 0.7;

/// A folder of fingers: `thumb`, which is larger, twice as stiff and has a network of its own.
pub(crate) fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    add(folder.path(), "thumb", &thumb_atlas(), THUMB_GAIN);
    folder
}

pub(crate) fn thumb_atlas() -> Atlas {
    atlas_of(0.12)
}

/// Writes a finger with the tiers `own` (its default) and `quick`, and a contact model.
pub(crate) fn add(fingers: &Path, name: &str, atlas: &Atlas, gain: f32) {
    let folder = fingers.join(name);
    fs::create_dir_all(&folder).unwrap();
    write(&folder, "finger.toml", b"[source]\nwho = \"nobody\"\n");
    write(&folder, "atlas.json", atlas.to_json().unwrap().as_bytes());
    add_model_of_gain(&folder, "own", atlas.hash(), 0, 0.1, gain);
    add_model_of_gain(&folder, "quick", atlas.hash(), 0, 0.2, 0.9 * gain);
    index(&folder, &json!({"default": "own", "models": ["own", "quick"]}));
    write(&folder, "finger.contact", &model_on(atlas, 2.0 * MODULUS_MPA));
}

pub(crate) fn index(folder: &Path, index: &Value) {
    write(folder, "index.json", index.to_string().as_bytes());
}

/// A service whose default finger is the plane of the contact tests, with these fingers.
pub(crate) async fn service(fingers: &TempDir) -> Service {
    service_with(fingers, |_| ()).await
}

pub(crate) async fn service_with(fingers: &TempDir, change: impl FnOnce(&mut Config)) -> Service {
    let models = model_folder_on(&atlas());
    write(models.path(), "finger.contact", &model());
    let of_fingers = |config: &mut Config| {
        config.fingers = Some(fingers.path().to_owned());
        // These tests are about answers, and measuring takes seconds in a build without optimisation.
        config.calibration_ms = 0;
        change(config);
    };
    Service::on(models, of_fingers).await.unwrap()
}

/// A service that has one of these fingers as its own.
pub(crate) async fn service_of(fingers: &TempDir, name: &str) -> Service {
    let folder = fingers.path().join(name);
    let of_finger = |config: &mut Config| {
        config.models = Some(folder);
        config.calibration_ms = 0;
    };
    Service::on(model_folder_on(&atlas()), of_finger).await.unwrap()
}

/// Fingers for a hello.
pub(crate) fn named(names: &[&str]) -> Value {
    let fingers = names.iter().map(|name| json!({"name": name}));
    json!({"fingers": fingers.collect::<Vec<Value>>()})
}
