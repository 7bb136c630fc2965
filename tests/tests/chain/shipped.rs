//! What ships: the models answer the indentations they come with, and the indentations can be solved
//! again.

use std::{
    fs,
    path::{Path, PathBuf},
};

use papilla_dataset::{Dataset, Field, IndentationEntry, Maps, Shard, ShardMaps, Split};
use papilla_engine::Card;
use papilla_fingertip::{campaign::CampaignSpec, scene::Scene};
use papilla_proto::{
    MAP_LEN,
    atlas::{Atlas, Patch, VertexSampler},
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
        "{name}/ is missing or empty in the repository: models/ and data/ ship with it; \
         docs/reference/dataset.md and docs/guides/training.md say how they are made"
    );
    path
}

/// A text file that ships; it must be there.
pub(crate) fn text(path: &Path) -> String {
    fs::read_to_string(path)
        .unwrap_or_else(|error| panic!("{}: {error}; it ships with the repository", path.display()))
}

/// The plates of the published campaign.
fn dataset() -> Dataset {
    Dataset::open(&folder("data/s1-graded")).unwrap()
}

/// The shipped dataset that a card was measured on.
fn judged_on(card: &Card) -> Dataset {
    let due = card.metrics.dataset_sha256.as_ref().unwrap_or(&card.dataset_sha256);
    let dataset = Dataset::open(&folder("data/broad-graded")).unwrap();
    assert_eq!(dataset.manifest().dataset_sha256, *due, "{}: its dataset does not ship", card.name);
    dataset
}

fn held_out(dataset: &Dataset) -> Vec<&IndentationEntry> {
    let indentations = dataset.manifest().presses.iter();
    indentations.filter(|indentation| indentation.split == Split::Test).collect()
}

fn map(states: &ShardMaps<'_>, field: Field, state: usize) -> Vec<f32> {
    let mut map = vec![0.0; MAP_LEN];
    states.draw(field, state, &mut map).unwrap();
    map
}

/// Maps of a dataset's states.
struct Drawn {
    dataset: Dataset,
    maps: Maps,
}

impl Drawn {
    fn of(dataset: Dataset) -> Self {
        let maps = Maps::read(dataset.folder(), dataset.atlas()).unwrap();
        Self { dataset, maps }
    }

    /// The states of a simulation as their maps have them at the atlas' vertices.
    fn samples(&self, shard: &Shard) -> Vec<Sample> {
        let states = self.maps.of(shard);
        let at_vertices = |field, patch, state| {
            let sampler = VertexSampler::new(self.dataset.atlas(), self.maps.raster(patch));
            let mut values = vec![0.0; sampler.vertex_count()];
            sampler.sample(&map(&states, field, state), &mut values).unwrap();
            values.iter().map(|v: &f32| v.max(0.0)).collect()
        };
        let sample = |state| Sample {
            pressure_pa: at_vertices(Field::Pressure, Patch::Skin, state),
            sed_j_per_m3: at_vertices(Field::SedDermis, Patch::Interface, state),
            depth_mm: shard.depth_mm[state],
        };
        (0..shard.len()).map(sample).collect()
    }
}

/// What the load modes of the contact model are of: two datasets that graded ones have replaced
/// (docs/concepts/contact.md, 'The model's file').
const OF_MODES: [&str; 2] = [
    "47e9d3921cb8fb18d3bc8450e99283e2aaa6027559177f7f616d3c5e2ba90e54",
    "5e79a134e820429279ae9ce85a663acdefc6cbdfb2f9f9251e6fc83dd01e4dae",
];

/// The contact model is of the networks' finger, and says of which datasets its load modes are.
#[test]
fn the_shipped_contact_model_says_where_it_is_from() {
    let bytes = fs::read(folder("models").join("finger.contact")).unwrap();
    let model = papilla_contact::ContactModel::read(&bytes).unwrap();
    let atlas = Atlas::from_json(&text(&folder("models").join("atlas.json"))).unwrap();
    model.require_atlas(atlas.hash()).unwrap();
    assert_eq!(model.vertices(), atlas.vertex_count());
    let header = model.header();
    assert_eq!(header.datasets, OF_MODES);
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
        assert_eq!(judged_on(card).atlas().hash(), dataset.atlas().hash(), "{}", card.name);
    }
    let drawn = Drawn::of(dataset);
    let states = drawn.samples(&drawn.dataset.shard(held_out(&drawn.dataset)[0]).unwrap());
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
    let drawn = Drawn::of(judged_on(&service.cards[0]));
    let mut all = Vec::new();
    for indentation in held_out(&drawn.dataset) {
        let shard = drawn.dataset.shard(indentation).unwrap();
        let states = drawn.maps.of(&shard);
        for state in 0..shard.len() {
            all.push([Field::Pressure, Field::SedDermis].map(|field| map(&states, field, state)));
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
    let drawn = Drawn::of(dataset());
    let (dataset, skin) = (&drawn.dataset, drawn.maps.raster(Patch::Skin));
    for indentation in held_out(dataset) {
        let shard = dataset.shard(indentation).unwrap();
        let states = drawn.maps.of(&shard);
        for (state, force_n) in shard.force_n.rows().into_iter().enumerate() {
            let map = map(&states, Field::Pressure, state);
            let force_n = force_n.iter().map(|f| f64::from(f * f)).sum::<f64>().sqrt();
            let share = map_integral(dataset.atlas(), skin, &map) / force_n;
            let what = format!("press {}, {} mm", indentation.id, shard.depth_mm[state]);
            assert!((share - 1.0).abs() < 0.1, "{what}: {share} of the force");
        }
    }
}

/// The solver of today finds what the dataset holds, on the atlas that the models carry.
#[test]
fn a_shipped_press_can_be_solved_again() {
    let dataset = Dataset::open(&folder("data/rungs/medium-linear")).unwrap();
    let spec = CampaignSpec::read(&folder("campaigns").join("final.toml")).unwrap();
    let indentation = held_out(&dataset).into_iter().find(|i| i.indenter == "table top").unwrap();
    let shard = dataset.shard(indentation).unwrap();
    let mut scene = Scene::read(&folder("scenes").join("flat-press.toml")).unwrap();
    scene.geometry =
        toml::from_str("kind = \"fingertip\"\ndensity = \"medium\"\norder = \"linear\"").unwrap();
    let candidates = spec.candidates();
    scene.indenter =
        candidates.into_iter().find(|c| c.name == indentation.indenter).unwrap().indenter;
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
    let [pressure_pa, sed_j_per_m3] = [&shard.pressure_pa, &shard.sed_dermis_j_per_m3]
        .map(|at_vertices| at_vertices.row(0).to_vec());
    assert_close("pressure", &found.pressure_pa, &pressure_pa, 1e-3);
    assert_close("SED", &found.sed_j_per_m3, &sed_j_per_m3, 1e-3);
}
