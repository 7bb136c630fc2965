//! The mechanics of a run: slices, resuming, threads, failures. The solver here is a formula of
//! pose and depth; its results do not matter.

mod slices;

use super::*;
use papilla_atlas::Atlas;
use papilla_dataset::testing::{atlas, posed_record};
use papilla_dataset::{Dataset, ImageOptions, Sample, Split, images, stats, verify};
use papilla_fingertip::campaign::testing::{several, spec};
use papilla_fingertip::campaign::{CampaignSpec, Indentation, Slice, indentations};
use papilla_fingertip::scene::Pose;
use papilla_output::map_image::Bits;
use std::collections::BTreeMap;
use std::num::NonZero;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::{AtomicUsize, Ordering};

/// What goes wrong, in which indentation counted over all workers.
#[derive(Clone, Copy, PartialEq)]
enum Trouble {
    None,
    Abort(usize),
    Fail(usize),
    Panic(usize),
    BadSample(usize),
    /// The process is asked to stop.
    Stop(usize),
}

struct Formula<'a> {
    vertex_count: usize,
    trouble: Trouble,
    calls: &'a AtomicUsize,
    options: &'a RunOptions,
}

impl IndentationSolver for Formula<'_> {
    fn solve(
        &mut self,
        press: &Indentation,
        checkpoints: &mut Checkpoints<'_>,
    ) -> Result<Vec<Sample>, PressError> {
        let Pose { pitch_deg, roll_deg, yaw_deg } = press.pose;
        let pose = papilla_dataset::Pose { pitch_deg, roll_deg, yaw_deg };
        let call = self.calls.fetch_add(1, Ordering::SeqCst);
        let mut records: Vec<Sample> = checkpoints.stored().unwrap_or_default();
        for depth_mm in press.depths_mm.iter().skip(records.len()) {
            records.push(posed_record(pose, *depth_mm, self.vertex_count));
            if self.trouble == Trouble::Stop(call) {
                self.options.stop.store(true, Ordering::Relaxed);
            }
            if checkpoints.at_state(records.len(), || records.clone()).is_break() {
                return Err(checkpoints.interrupted());
            }
        }
        match self.trouble {
            // Not even a destructor runs: what kill -9 does.
            Trouble::Abort(n) if n == call => std::process::abort(),
            Trouble::Fail(n) if n == call => {
                return Err(PressError::Failed("no convergence at 0.5 mm".into()));
            }
            Trouble::Panic(n) if n == call => panic!("index out of bounds"),
            Trouble::BadSample(n) if n == call => records[0].checks.energy_vs_work = 0.02,
            _ => {}
        }
        Ok(records)
    }
}

/// Solves a slice.
fn part(
    spec: &CampaignSpec,
    folder: &Path,
    options: &RunOptions,
    trouble: Trouble,
) -> Result<SliceReport, CampaignError> {
    let (calls, atlas) = (AtomicUsize::new(0), atlas(6));
    let vertex_count = atlas.vertex_count();
    let build = || Ok(Formula { vertex_count, trouble, calls: &calls, options });
    solve(spec, (&atlas, None), build, folder, options)
}

fn silent(slice: Slice, threads: usize) -> RunOptions {
    let threads = NonZero::new(threads);
    RunOptions { slice, threads, progress: false, ..RunOptions::default() }
}

/// A serial run: the slice of all, and the merge.
fn go_on(
    spec: &CampaignSpec,
    folder: &Path,
    threads: usize,
    trouble: Trouble,
) -> Result<(SliceReport, CampaignReport), CampaignError> {
    let slice = part(spec, folder, &silent(Slice::WHOLE, threads), trouble)?;
    Ok((slice, merge(spec, folder)?))
}

fn go(
    folder: &Path,
    threads: usize,
    trouble: Trouble,
) -> Result<(SliceReport, CampaignReport), CampaignError> {
    go_on(&spec(), folder, threads, trouble)
}

/// All files of the dataset; `progress` holds wall times and is not part of it.
fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut files = BTreeMap::new();
    for part in ["", "shards"] {
        for entry in std::fs::read_dir(folder.join(part)).unwrap() {
            let path = entry.unwrap().path();
            if path.is_file() {
                let name = path.strip_prefix(folder).unwrap().to_path_buf();
                files.insert(name, std::fs::read(path).unwrap());
            }
        }
    }
    files
}

#[test]
fn threads_do_not_change_a_byte() {
    let folders = [tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap()];
    for (threads, folder) in [1, 3].into_iter().zip(&folders) {
        let (slice, report) = go(folder.path(), threads, Trouble::None).unwrap();
        assert!(slice.is_complete() && report.is_complete());
        assert_eq!((slice.solved, report.samples), (7, 14));
    }
    let [one, three] = folders.map(|f| files(f.path()));
    assert_eq!(one.len(), 3 + 7, "manifest, atlas, raster and 7 shards: {:?}", one.keys());
    assert!(one == three);
}

/// Not a test of its own: the process that the next test starts and that dies.
#[test]
#[ignore = "started by a_killed_campaign_goes_on"]
fn dies_in_the_fourth_press() {
    if let Ok(folder) = std::env::var("PAPILLA_TEST_CAMPAIGN") {
        let _ = go(Path::new(&folder), 1, Trouble::Abort(3));
    }
}

#[test]
fn a_killed_campaign_goes_on() {
    let (killed, whole) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let output = Command::new(std::env::current_exe().unwrap())
        .args(["--exact", "--ignored", "tests::dies_in_the_fourth_press"])
        .env("PAPILLA_TEST_CAMPAIGN", killed.path())
        .output()
        .unwrap();
    assert!(!output.status.success(), "the child has to die");
    assert!(!killed.path().join("manifest.json").exists(), "it died before the end");
    // What a kill in the midst of a write leaves, and a shard without record.
    std::fs::write(killed.path().join("shards/.partial-x7"), b"half").unwrap();
    std::fs::write(killed.path().join("shards/press-00005.npz"), b"torn").unwrap();
    let (slice, _) = go(killed.path(), 2, Trouble::None).unwrap();
    assert_eq!((slice.reused, slice.solved), (3, 4), "three indentations were finished");
    go(whole.path(), 1, Trouble::None).unwrap();
    assert!(files(killed.path()) == files(whole.path()));
    // A third run finds nothing left to do.
    let (again, _) = go(killed.path(), 1, Trouble::Fail(0)).unwrap();
    assert_eq!((again.reused, again.solved), (7, 0));
    assert!(files(killed.path()) == files(whole.path()));
}

#[test]
fn an_altered_shard_is_solved_again() {
    let folder = tempfile::tempdir().unwrap();
    go(folder.path(), 1, Trouble::None).unwrap();
    let before = files(folder.path());
    let shard = folder.path().join("shards/press-00002.npz");
    let mut bytes = std::fs::read(&shard).unwrap();
    bytes[200] ^= 1;
    std::fs::write(&shard, bytes).unwrap();
    assert!(verify(folder.path()).unwrap_err().to_string().contains("press-00002"));
    let error = merge(&spec(), folder.path()).unwrap_err().to_string();
    assert!(error.contains("press-00002.npz is not what its record"), "{error}");
    let (slice, _) = go(folder.path(), 1, Trouble::None).unwrap();
    assert_eq!((slice.reused, slice.solved), (6, 1));
    assert!(files(folder.path()) == before);
}

#[test]
fn a_failed_press_is_reported_and_the_rest_is_kept() {
    for (trouble, word) in
        [(Trouble::Fail(4), "no convergence at 0.5 mm"), (Trouble::Panic(4), "index out of bounds")]
    {
        let folder = tempfile::tempdir().unwrap();
        let (slice, report) = go(folder.path(), 1, trouble).unwrap();
        assert!(!slice.is_complete() && !report.is_complete());
        assert_eq!((slice.solved, slice.failed.len(), slice.failed[0].id), (6, 1, 4));
        assert_eq!((report.failed.len(), report.failed[0].id, report.samples), (1, 4, 12));
        assert!(report.failed[0].error.contains(word), "{}", report.failed[0].error);
        assert!(report.to_string().contains(word));
        assert!(!folder.path().join("shards/press-00004.npz").exists());
        let dataset = Dataset::open(folder.path()).unwrap();
        let manifest = dataset.manifest();
        assert_eq!(manifest.failed, report.failed);
        assert!(manifest.presses.iter().all(|p| p.id != 4));
        assert!([&manifest.splits.train, &manifest.splits.test].iter().all(|s| !s.contains(&4)));
        verify(folder.path()).unwrap();
        // The next run tries it again.
        let (next, whole) = go(folder.path(), 1, Trouble::None).unwrap();
        assert_eq!((next.reused, next.solved, whole.is_complete()), (6, 1, true));
    }
}

#[test]
fn a_sample_that_fails_its_checks_is_left_out() {
    let folder = tempfile::tempdir().unwrap();
    let (slice, report) = go(folder.path(), 1, Trouble::BadSample(2)).unwrap();
    assert!(!slice.is_complete() && !report.is_complete());
    assert_eq!((report.samples, report.dropped.len()), (13, 1));
    assert_eq!((report.dropped[0].press, report.dropped[0].depth_mm), (2, Some(0.25)));
    let dataset = Dataset::open(folder.path()).unwrap();
    let press = &dataset.manifest().presses[2];
    assert_eq!(dataset.shard(press).unwrap().depth_mm.to_vec(), [0.5]);
}

#[test]
fn a_solver_that_cannot_be_built_stops_the_campaign() {
    let folder = tempfile::tempdir().unwrap();
    let build = || -> Result<Formula<'static>, BoxError> { Err("mesh has no elements".into()) };
    let options = silent(Slice::WHOLE, 1);
    let error = solve(&spec(), (&atlas(6), None), build, folder.path(), &options).unwrap_err();
    assert!(error.to_string().contains("mesh has no elements"), "{error}");
    assert!(!folder.path().join("manifest.json").exists());
}

/// The shipped dataset's poses: its seed has to give them for ever.
#[test]
fn the_poses_of_s1_are_those_of_the_shipped_dataset() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let s1 = CampaignSpec::read(&root.join("campaigns/s1-graded.toml")).unwrap();
    let shipped = Dataset::open(&root.join("data/s1-graded")).unwrap();
    let planned = indentations(&s1);
    for entry in &shipped.manifest().presses {
        let press = &planned[entry.id];
        let (due, found) = (press.pose, entry.pose);
        assert_eq!(
            ([due.pitch_deg, due.roll_deg, due.yaw_deg], press.offset_mm),
            ([found.pitch_deg, found.roll_deg, found.yaw_deg], entry.offset_mm)
        );
        assert_eq!((&press.indenter, &press.shape), (&entry.indenter, &entry.shape));
    }
    let campaign = serde_json::to_value(&s1).unwrap();
    assert_eq!(shipped.manifest().campaign, campaign, "as this program would write it");
}

/// What a campaign's file means stays what its shipped dataset was solved from, mesh and all.
#[test]
fn shipped_datasets_are_of_their_campaigns() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let mut seen = 0;
    for file in std::fs::read_dir(root.join("campaigns")).unwrap() {
        let file = file.unwrap().path();
        let data = root.join("data").join(file.file_stem().unwrap());
        if !data.join("manifest.json").exists() {
            continue;
        }
        let spec = CampaignSpec::read(&file).unwrap();
        let shipped = Dataset::open(&data).unwrap();
        let campaign = serde_json::to_value(&spec).unwrap();
        assert_eq!(shipped.manifest().campaign, campaign, "{}", file.display());
        seen += 1;
    }
    assert!(seen >= 13, "{seen} campaigns");
}

#[test]
fn the_manifest_names_the_indenter_of_every_press() {
    let folder = tempfile::tempdir().unwrap();
    let spec = CampaignSpec { presses: 8, ..several() };
    let (_, report) = go_on(&spec, folder.path(), 1, Trouble::Fail(1)).unwrap();
    // Four indentations of two depths, four of three, one of them failed.
    assert_eq!(spec.samples(), 4 * 2 + 4 * 3);
    assert_eq!((report.samples_due, report.failed.len()), (20, 1));
    let manifest = Dataset::open(folder.path()).unwrap().manifest().clone();
    let planned = indentations(&spec);
    for entry in &manifest.presses {
        assert_eq!(entry.indenter, planned[entry.id].indenter);
        let bits = |offset: [f64; 2]| offset.map(f64::to_bits);
        assert_eq!(bits(entry.offset_mm), bits(planned[entry.id].offset_mm));
    }
    assert_eq!(manifest.failed[0].indenter, planned[manifest.failed[0].id].indenter);
    let stats = stats(folder.path(), None).unwrap();
    assert_eq!(stats.indenters.values().sum::<usize>(), 7);
    assert!(stats.to_string().contains("ball"));
}

#[test]
fn stats_images_and_verify_read_what_was_written() {
    let folder = tempfile::tempdir().unwrap();
    let (_, report) = go(folder.path(), 2, Trouble::None).unwrap();
    let verified = verify(folder.path()).unwrap();
    assert_eq!((verified.samples, &verified.dataset_sha256), (14, &report.dataset_sha256));
    let sheet = folder.path().join("sheet.png");
    let stats = stats(folder.path(), Some(&sheet)).unwrap();
    assert!(sheet.exists());
    assert_eq!(stats.depths.iter().map(|d| d.samples).collect::<Vec<_>>(), [7, 7]);
    // The formula's force is the depth squared.
    assert!((stats.depths[1].force_n.median - 0.25).abs() < 1e-6);
    assert!(stats.to_string().contains("0.500"));
    let out = folder.path().join("images");
    let images = images(folder.path(), &out, &ImageOptions { bits: Bits::Sixteen }).unwrap();
    assert_eq!(images.samples.len(), 14);
    assert_eq!(std::fs::read_dir(&out).unwrap().count(), 2 * 14 + 1);
    let held_out = images.samples.iter().filter(|s| s.split == Split::Test).count();
    assert_eq!(held_out, stats.samples_test);
}

#[test]
fn the_atlas_of_another_dataset_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    go(folder.path(), 1, Trouble::None).unwrap();
    let other: Atlas = atlas(5);
    std::fs::write(folder.path().join("atlas.json"), other.to_json().unwrap()).unwrap();
    let text = Dataset::open(folder.path()).unwrap_err().to_string();
    assert!(text.contains("do not mix"), "{text}");
}
