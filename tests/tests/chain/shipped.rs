//! What ships: the models answer the indentations they come with, and the indentations can be solved
//! again.

use std::{
    fs,
    path::{Path, PathBuf},
};

use papilla_dataset::{Dataset, Field, IndentationEntry, Maps, Shard, Split};
use papilla_engine::Card;
use papilla_fingertip::scene::Scene;
use papilla_proto::{
    MAP_LEN,
    atlas::{Atlas, Patch, Raster},
};

use crate::{
    assert_close, client,
    scene::{Pressed, map_integral},
    service::{Sample, Service},
};

/// A folder of the repository; it must be there.
pub(crate) fn folder(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(name);
    let there = fs::read_dir(&path).is_ok_and(|mut entries| entries.next().is_some());
    assert!(
        there,
        "{name}/ is missing or empty in the repository: models/ and data/s1/ ship with it; \
         docs/reference/dataset.md and docs/guides/training.md say how they are made"
    );
    path
}

/// A text file that ships; it must be there.
pub(crate) fn text(path: &Path) -> String {
    fs::read_to_string(path)
        .unwrap_or_else(|error| panic!("{}: {error}; it ships with the repository", path.display()))
}

fn dataset() -> Dataset {
    Dataset::open(&folder("data/s1")).unwrap()
}

/// The shipped dataset that a card was measured on, and its folder.
fn judged_on(card: &Card) -> (PathBuf, Dataset) {
    let due = card.metrics.dataset_sha256.as_ref().unwrap_or(&card.dataset_sha256);
    let shipped = ["data/s1", "data/broad", "data/broad-graded"].map(folder);
    let opened = shipped.map(|path| (path.clone(), Dataset::open(&path).unwrap()));
    let found = opened.into_iter().find(|(_, d)| d.manifest().dataset_sha256 == *due);
    found.unwrap_or_else(|| panic!("{}: its dataset {due} does not ship", card.name))
}

fn held_out(dataset: &Dataset) -> Vec<&IndentationEntry> {
    let indentations = dataset.manifest().presses.iter();
    indentations.filter(|indentation| indentation.split == Split::Test).collect()
}

fn samples(shard: &Shard) -> Vec<Sample> {
    let sample = |i: usize| Sample {
        pressure_pa: shard.pressure_pa.row(i).to_vec(),
        sed_j_per_m3: shard.sed_dermis_j_per_m3.row(i).to_vec(),
        depth_mm: shard.depth_mm[i],
    };
    (0..shard.len()).map(sample).collect()
}

/// The contact model is of the networks' finger, and its load modes are of the shipped datasets.
#[test]
fn the_shipped_contact_model_says_where_it_is_from() {
    let bytes = fs::read(folder("models").join("finger.contact")).unwrap();
    let model = papilla_contact::ContactModel::read(&bytes).unwrap();
    let atlas = Atlas::from_json(&text(&folder("models").join("atlas.json"))).unwrap();
    model.require_atlas(atlas.hash()).unwrap();
    assert_eq!(model.vertices(), atlas.vertex_count());
    let hash = |name| Dataset::open(&folder(name)).unwrap().manifest().dataset_sha256.clone();
    let header = model.header();
    assert_eq!(header.datasets, ["data/s1", "data/broad"].map(hash));
    assert_eq!(header.effects, ["finite_strain", "layers"]);
    assert!(header.modes > 0 && header.depth_max_mm > 1.0, "{header:?}");
    // Epidermis, dermis, subcutaneous tissue.
    assert_eq!(header.layers.len(), 3);
}

#[tokio::test(flavor = "multi_thread")]
async fn the_shipped_models_answer_every_client() {
    let service = Service::shipped().await;
    let dataset = dataset();
    assert_eq!(service.atlas.hash(), dataset.atlas().hash());
    for card in &service.cards {
        assert_eq!(judged_on(card).1.atlas().hash(), dataset.atlas().hash(), "{}", card.name);
    }
    let states = samples(&dataset.shard(held_out(&dataset)[0]).unwrap());
    let deepest = states.last().unwrap();
    client::http_answers_are_the_librarys(&service, deepest).await;
    client::nothing_in_nothing_out(&service).await;
    client::http_mistakes_are_named(&service, deepest).await;
    client::session_answers_are_the_librarys(&service, &states).await;
    client::sessions_survive_mistakes(&service, deepest).await;
}

/// The figure on the card is what a client of the service finds.
#[tokio::test(flavor = "multi_thread")]
async fn the_card_tells_the_truth() {
    let service = Service::shipped().await;
    let (path, dataset) = judged_on(&service.cards[0]);
    let maps = Maps::read(&path, dataset.atlas()).unwrap();
    let mut all = Vec::new();
    for indentation in held_out(&dataset) {
        let shard = dataset.shard(indentation).unwrap();
        let states = maps.of(&shard);
        for state in 0..shard.len() {
            let drawn = |field| {
                let mut map = vec![0.0; MAP_LEN];
                states.draw(field, state, &mut map).unwrap();
                map
            };
            all.push([drawn(Field::Pressure), drawn(Field::SedDermis)]);
        }
    }
    let card = &service.cards[0].metrics;
    assert_eq!((card.split.as_str(), card.samples), ("test", all.len()));
    let found = client::median_error(&service, &all).await;
    let due = card.relative_l2.median;
    assert!((found / due - 1.0).abs() < 1e-3, "median relative L2 {found}, the card says {due}");
}

/// The map knows the undeformed area, the force the deformed one: they agree to some percent.
#[test]
fn maps_of_the_dataset_carry_the_force_of_the_plate() {
    let dataset = dataset();
    let skin = Raster::new(dataset.atlas(), Patch::Skin);
    let mut map = vec![0.0; MAP_LEN];
    for indentation in held_out(&dataset) {
        let shard = dataset.shard(indentation).unwrap();
        for (sample, force_n) in samples(&shard).iter().zip(shard.force_n.rows()) {
            skin.rasterise(&sample.pressure_pa, &mut map).unwrap();
            let force_n = force_n.iter().map(|f| f64::from(f * f)).sum::<f64>().sqrt();
            let share = map_integral(dataset.atlas(), &skin, &map) / force_n;
            let what = format!("press {}, {} mm", indentation.id, sample.depth_mm);
            assert!((share - 1.0).abs() < 0.1, "{what}: {share} of the force");
        }
    }
}

/// The solver of today finds what the dataset holds, on the atlas that the models carry.
#[test]
fn a_shipped_press_can_be_solved_again() {
    let dataset = dataset();
    let indentation = held_out(&dataset)[0];
    let shard = dataset.shard(indentation).unwrap();
    // The campaign's plate is this scene's; mesh and pose are the indentation's.
    let mut scene = Scene::read(&folder("scenes").join("flat-press.toml")).unwrap();
    scene.geometry =
        toml::from_str("kind = \"fingertip\"\ndensity = \"medium\"\norder = \"linear\"").unwrap();
    scene.motion.pitch_deg = indentation.pose.pitch_deg;
    scene.motion.roll_deg = indentation.pose.roll_deg;
    scene.motion.yaw_deg = indentation.pose.yaw_deg;
    scene.motion.depth_mm = Some(f64::from(shard.depth_mm[0]));
    scene.motion.increments = 1;
    scene.validate().unwrap();
    let pressed = Pressed::solve(&scene);
    let shipped = Atlas::from_json(&text(&folder("models").join("atlas.json")));
    assert_eq!(pressed.atlas.hash(), shipped.unwrap().hash(), "the atlas of the models");
    let found = &pressed.samples()[0];
    let due = &samples(&shard)[0];
    assert_close("pressure", &found.pressure_pa, &due.pressure_pa, 1e-3);
    assert_close("SED", &found.sed_j_per_m3, &due.sed_j_per_m3, 1e-3);
}
