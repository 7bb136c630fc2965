//! Many processes that write into one folder.

use super::*;
use std::fs;
use std::time::{Duration, SystemTime};

fn slice(index: usize, count: usize) -> RunOptions {
    silent(Slice::new(index, count).unwrap(), 1)
}

/// The files of a serial run.
fn serial() -> BTreeMap<PathBuf, Vec<u8>> {
    let folder = tempfile::tempdir().unwrap();
    go(folder.path(), 1, Trouble::None).unwrap();
    files(folder.path())
}

/// What `part` is after `text` was replaced in it.
fn edit(path: &Path, text: &str, by: &str) {
    let whole = fs::read_to_string(path).unwrap();
    assert!(whole.contains(text), "{whole}");
    fs::write(path, whole.replace(text, by)).unwrap();
}

/// Slices of one division and of another at once, in one folder.
#[test]
fn slices_at_once_make_the_bytes_of_a_serial_run() {
    let folder = tempfile::tempdir().unwrap();
    std::thread::scope(|scope| {
        for (index, count) in [(3, 3), (1, 3), (2, 3), (2, 2), (1, 2), (2, 3)] {
            let path = folder.path();
            scope.spawn(move || part(&spec(), path, &slice(index, count), Trouble::None).unwrap());
        }
    });
    let report = merge(&spec(), folder.path()).unwrap();
    assert!(report.is_complete());
    assert!(files(folder.path()) == serial());
    // Again: nothing is left to do, and nothing changes.
    let again = part(&spec(), folder.path(), &slice(2, 3), Trouble::Fail(0)).unwrap();
    assert_eq!((again.solved, again.reused, again.is_complete()), (0, again.presses, true));
    merge(&spec(), folder.path()).unwrap();
    assert!(files(folder.path()) == serial());
}

/// More presses than at first: those that are solved are taken over.
#[test]
fn a_campaign_is_gone_on_with_after_more_presses_were_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let fewer = CampaignSpec { presses: 4, test_fraction: Some(0.5), ..spec() };
    part(&fewer, folder.path(), &slice(1, 1), Trouble::None).unwrap();
    merge(&fewer, folder.path()).unwrap();
    assert!(files(folder.path()) != serial());
    let (report, _) = go(folder.path(), 1, Trouble::None).unwrap();
    assert_eq!((report.solved, report.reused), (spec().presses - 4, 4));
    assert!(files(folder.path()) == serial());
}

#[test]
fn a_merge_with_holes_names_them_and_changes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let error = merge(&spec(), path).unwrap_err();
    assert!(matches!(error, CampaignError::NotBegun { .. }), "{error}");
    part(&spec(), path, &slice(1, 3), Trouble::None).unwrap();
    part(&spec(), path, &slice(3, 3), Trouble::None).unwrap();
    // What a full disk or a lost node leaves: a shard that is cut off, one without a record, a
    // record without its shard, half a file.
    let shard = |id: usize| path.join(format!("shards/press-{id:05}.npz"));
    let bytes = fs::read(shard(6)).unwrap();
    fs::write(shard(6), &bytes[..bytes.len() / 2]).unwrap();
    fs::write(shard(3), &bytes).unwrap();
    fs::remove_file(shard(5)).unwrap();
    fs::write(path.join("progress/.partial-x"), b"half").unwrap();
    let text = merge(&spec(), path).unwrap_err().to_string();
    let cut = "6 (";
    for word in ["4 of 7", "2 (not solved)", "3 (not solved)", "5 (cannot read", cut, "is not what"]
    {
        assert!(text.contains(word), "{word}: {text}");
    }
    assert!(!path.join("manifest.json").exists());
    let (rest, _) = go(path, 1, Trouble::None).unwrap();
    assert_eq!((rest.solved, rest.reused), (4, 3));
    assert!(files(path) == serial());
    assert!(!path.join("progress/.partial-x").exists());
}

/// Of two campaigns that begin at once in one folder, one is refused, whichever is first.
#[test]
fn a_folder_serves_one_campaign() {
    for _ in 0..6 {
        let folder = tempfile::tempdir().unwrap();
        let other = CampaignSpec { seed: 4, ..spec() };
        let own = [spec(), other];
        let found: Vec<_> = std::thread::scope(|scope| {
            let run = |spec| {
                let path = folder.path();
                scope.spawn(move || part(spec, path, &slice(1, 7), Trouble::None))
            };
            let both: Vec<_> = own.iter().map(run).collect();
            both.into_iter().map(|one| one.join().unwrap()).collect()
        });
        let refused = |r: &Result<_, _>| matches!(r, Err(CampaignError::Occupied { .. }));
        assert_eq!(found.iter().filter(|r| refused(r)).count(), 1, "{found:?}");
        let winner = found.iter().position(Result::is_ok).unwrap();
        assert!(merge(&own[1 - winner], folder.path()).is_err());
        let error = StatusReader::new(&own[1 - winner], folder.path()).err().unwrap();
        assert!(matches!(error, CampaignError::Occupied { .. }), "{error}");
    }
}

/// A node comes back with what it solved for another campaign that had this folder before.
#[test]
fn records_of_another_campaign_are_not_merged() {
    let folder = tempfile::tempdir().unwrap();
    go(folder.path(), 1, Trouble::None).unwrap();
    let record = folder.path().join("progress/press-00004.json");
    let text = fs::read_to_string(&record).unwrap();
    let state: serde_json::Value = serde_json::from_str(&text).unwrap();
    let fingerprint = state["fingerprint"].as_str().unwrap();
    edit(&record, fingerprint, &fingerprint.chars().rev().collect::<String>());
    let error = merge(&spec(), folder.path()).unwrap_err().to_string();
    assert!(error.contains("1 of 7") && error.contains("of another campaign"), "{error}");
    let (slice, _) = go(folder.path(), 1, Trouble::None).unwrap();
    assert_eq!((slice.solved, slice.reused), (1, 6));
    assert!(files(folder.path()) == serial());
}

/// The folder is given to another campaign while a node is away: it may not write there any more.
#[test]
fn a_process_whose_folder_was_given_away_stores_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let atlas = atlas(6);
    let (first, stop) = (AtomicUsize::new(0), silent(Slice::WHOLE, 1));
    let build = || {
        // Between the start and the first shard.
        edit(&path.join("progress/campaign.json"), "fingerprint\": \"", "fingerprint\": \"0");
        let vertex_count = atlas.vertex_count();
        Ok(Formula { vertex_count, trouble: Trouble::None, calls: &first, options: &stop })
    };
    let error = solve(&spec(), (&atlas, None), build, path, &stop).unwrap_err();
    assert!(matches!(error, CampaignError::Occupied { .. }), "{error}");
    assert_eq!(fs::read_dir(path.join("shards")).unwrap().count(), 0);
}

/// Records as the version before slices wrote them, and its lock.
#[test]
fn a_folder_of_the_version_before_slices_is_gone_on_with() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    part(&spec(), path, &slice(1, 2), Trouble::None).unwrap();
    fs::write(path.join("progress/lock"), b"").unwrap();
    for id in 0..3 {
        let record = path.join(format!("progress/press-{id:05}.json"));
        let text = fs::read_to_string(&record).unwrap();
        let mut state: serde_json::Value = serde_json::from_str(&text).unwrap();
        assert!(state.as_object_mut().unwrap().remove("fingerprint").is_some());
        fs::write(&record, state.to_string()).unwrap();
    }
    let (slice, _) = go(path, 1, Trouble::None).unwrap();
    assert_eq!((slice.solved, slice.reused), (4, 3));
    assert!(files(path) == serial());
}

/// Asked to stop, a process stores where it stands; the next goes on from there.
#[test]
fn a_stopped_indentation_goes_on_from_its_last_state() {
    let folder = tempfile::tempdir().unwrap();
    let (path, standing) = (folder.path(), folder.path().join("progress/press-00002.state"));
    let options = silent(Slice::WHOLE, 1);
    let stopped = part(&spec(), path, &options, Trouble::Stop(2)).unwrap();
    assert_eq!((stopped.solved, stopped.left, stopped.is_complete()), (2, 5, false));
    assert!(standing.exists());
    let status = StatusReader::new(&spec(), path).unwrap().read().unwrap();
    assert_eq!((status.solved, status.unsolved, status.standing, status.running), (2, 5, 1, 0));
    assert_eq!(status.processes[0].beat.ended, Some(Ended::Stopped));
    // It is asked at once: of two states one is left, so it ends without being stopped.
    let next = part(&spec(), path, &silent(Slice::WHOLE, 1), Trouble::Stop(0)).unwrap();
    assert_eq!((next.solved, next.left), (1, 4), "from its last state");
    assert!(!standing.exists());
    go(path, 1, Trouble::None).unwrap();
    assert!(files(path) == serial());
    let status = StatusReader::new(&spec(), path).unwrap().read().unwrap();
    assert!(status.is_over() && status.merged && status.processes.is_empty());
}

/// Damaged, of another indentation or in an unknown form, a stored state is not used.
#[test]
fn a_stored_state_that_cannot_be_trusted_is_not_used() {
    for damage in [0, 1, 2] {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path();
        part(&spec(), path, &silent(Slice::WHOLE, 1), Trouble::Stop(1)).unwrap();
        let standing = path.join("progress/press-00001.state");
        let mut bytes = fs::read(&standing).unwrap();
        match damage {
            0 => bytes[200] ^= 1,
            1 => bytes.truncate(40),
            _ => fs::rename(&standing, path.join("progress/press-00003.state")).unwrap(),
        }
        if damage < 2 {
            fs::write(&standing, bytes).unwrap();
        }
        let (slice, _) = go(path, 1, Trouble::None).unwrap();
        assert_eq!((slice.solved, slice.reused), (6, 1));
        assert!(files(path) == serial(), "damage {damage}");
    }
}

#[test]
fn the_status_tells_of_failures_and_hours() {
    let folder = tempfile::tempdir().unwrap();
    part(&spec(), folder.path(), &slice(1, 2), Trouble::Fail(1)).unwrap();
    let mut reader = StatusReader::new(&spec(), folder.path()).unwrap();
    let status = reader.read().unwrap();
    assert_eq!((status.presses, status.solved, status.unsolved), (7, 2, 4));
    assert_eq!((status.failed.len(), status.failed[0].id), (1, 1));
    assert!(status.hours_left.unwrap() >= 0.0 && !status.merged);
    let text = status.to_string();
    assert!(text.contains("FAILED indentation 1") && text.contains("h left"), "{text}");
    // The same reader sees what another process does: the failed one is tried again.
    go(folder.path(), 1, Trouble::None).unwrap();
    let status = reader.read().unwrap();
    assert_eq!((status.solved, status.failed.len(), status.unsolved), (7, 0, 0));
    assert!(status.to_string().contains("solved and merged"));
}

/// What is sized by the number of indentations, at its greatest.
#[test]
fn a_slice_of_a_million_is_a_slice() {
    let folder = tempfile::tempdir().unwrap();
    let million = CampaignSpec { presses: 1 << 20, ..spec() };
    let report = part(&million, folder.path(), &slice(34_953, 34_953), Trouble::None).unwrap();
    assert_eq!((report.presses, report.solved), (30, 30));
    let status = StatusReader::new(&million, folder.path()).unwrap().read().unwrap();
    assert_eq!((status.presses, status.solved, status.unsolved), (1 << 20, 30, (1 << 20) - 30));
    assert!(status.untrusted.is_empty() && status.processes.is_empty());
    assert!(folder.path().join("shards/press-1048575.npz").exists());
    let error = merge(&million, folder.path()).unwrap_err().to_string();
    assert!(error.contains("1048546 of 1048576"), "{error}");
}

/// A clock that jumps changes what a person is told, and nothing else.
#[test]
fn a_clock_that_jumps_only_changes_what_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    part(&spec(), path, &silent(Slice::WHOLE, 1), Trouble::Stop(2)).unwrap();
    let beat = path.join("progress/slice-00001-of-00001.json");
    edit(&beat, "\"stopped\"", "null");
    let day = Duration::from_secs(86_400);
    let told = |then: SystemTime| {
        fs::File::options().write(true).open(&beat).unwrap().set_modified(then).unwrap();
        let status = StatusReader::new(&spec(), path).unwrap().read().unwrap();
        (status.solved, status.unsolved, status.processes[0].silent)
    };
    assert_eq!(told(SystemTime::now() + day), (2, 5, false));
    assert_eq!(told(SystemTime::now() - day), (2, 5, true));
    for entry in fs::read_dir(path.join("progress")).unwrap().flatten() {
        let file = fs::File::options().write(true).open(entry.path()).unwrap();
        file.set_modified(SystemTime::now() + day).unwrap();
    }
    let (slice, _) = go(path, 1, Trouble::None).unwrap();
    assert_eq!((slice.reused, slice.solved), (2, 5));
    assert!(files(path) == serial());
}
