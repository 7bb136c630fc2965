//! The records that the repository holds.

use super::*;
use papilla_fem::solve::Options;

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

/// Every record in `data/`, with the report that it has to have.
fn committed() -> Vec<(Contents, PathBuf)> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(Path::new(ROOT).join("data")).unwrap() {
        let path = entry.unwrap().path().join("scenes.jsonl");
        let Ok(text) = std::fs::read_to_string(&path) else { continue };
        let folder = path.parent().unwrap().file_name().unwrap().to_str().unwrap();
        let report = format!("docs/reports/stability-{folder}.md");
        let contents = record::read(&path, &text).unwrap().unwrap();
        found.push((contents, Path::new(ROOT).join(report)));
    }
    found
}

/// The campaign that a record's scenes are drawn from.
fn campaign(head: &Head, count: usize) -> CampaignSpec {
    let path = Path::new(ROOT).join("campaigns").join(&head.campaign).with_extension("toml");
    let count = NonZero::new(count).unwrap();
    drawn(&CampaignSpec::read(&path).unwrap(), count, head.seed, head.density)
}

/// Neither records nor reports are edited by hand, and the campaigns still draw those scenes.
#[test]
fn each_committed_report_is_of_its_record() {
    let all = committed();
    assert!(all.iter().any(|(c, _)| c.head.seed == 5 && c.lines.len() > 10_000));
    for (Contents { head, lines }, report) in all {
        let last = lines.iter().map(|l| l.press.id).max().unwrap();
        let given = lines.len();
        let (records, todo) = split(scenes(&campaign(&head, last + 1)), lines);
        assert_eq!(records.len(), last + 1, "drawn differently, or not in the record");
        assert_eq!(records.iter().map(Vec::len).sum::<usize>(), given, "lines of no scene");
        let found = count(head, &records, 0);
        assert_eq!(std::fs::read_to_string(&report).unwrap(), found.markdown(), "{report:?}");
        // A record that nothing is mended on may fail: its page says so.
        assert!(found.of.seed != 5 || (todo.is_empty() && found.passed()));
    }
}

/// Lines of the record, the cheapest of each of four indenters, are found again.
#[test]
fn recorded_scenes_are_found_again() {
    let (Contents { head, lines }, _) =
        committed().into_iter().find(|(c, _)| c.head.density == Density::Coarse).unwrap();
    let finger = Finger::new(&campaign(&head, 1)).unwrap();
    let mut solver = finger.body.solver(Options::default()).unwrap();
    for indenter in ["plate", "ball of 6 mm", "edge", "punch of 4 mm"] {
        let cheapest = lines
            .iter()
            .filter(|l| l.press.indenter == indenter && l.balances())
            .min_by(|a, b| a.seconds.total_cmp(&b.seconds))
            .unwrap();
        let found = finger.solve(&mut solver, &cheapest.press);
        println!("{cheapest:?}\n{found:?}");
        assert_eq!(found.ending, cheapest.ending);
        assert_eq!(found.cuts, cheapest.cuts);
        let iterations = found.newton_iterations.abs_diff(cheapest.newton_iterations);
        assert!(iterations <= 1, "another build rounds differently");
        let (now, then) = (found.j_min.unwrap(), cheapest.j_min.unwrap());
        assert!((now / then - 1.0).abs() < 1e-4, "J min {now}, recorded {then}");
        let How::Recorded { attempts, contact, .. } = found.how else { panic!("unrecorded") };
        assert_eq!(attempts.last().map(|a| a.contact), contact);
    }
}

/// A scene that failed is solved again; its first line stays, and is what is counted.
#[test]
fn a_failure_is_counted_though_it_was_mended() {
    let spec = campaign(
        &Head { campaign: "broad".into(), seed: 5, density: Density::Coarse, mended_on: None },
        3,
    );
    let all = scenes(&spec);
    let line = |id: usize, ending: Ending| SceneRecord {
        press: all[id].clone(),
        ..report::tests::record(id, ending)
    };
    let first = vec![line(0, Ending::Balanced), line(1, Ending::Unbalanced("by 1 %".into()))];
    let (found, todo) = split(all.clone(), first.clone());
    assert_eq!((found.len(), todo.iter().map(|p| p.id).collect::<Vec<_>>()), (2, vec![1, 2]));
    let lines = [first, vec![line(1, Ending::Balanced), line(2, Ending::Balanced)]].concat();
    let (found, todo) = split(all, lines);
    assert_eq!(todo, []);
    let report = count(head(&spec), &found, 0);
    assert_eq!((report.now.balanced, report.first_run.balanced), (3, 2));
    assert_eq!((report.counted, report.first_run.unbalanced.len()), (3, 1));
    assert!(report.failing_at_most > 0.5, "one of three: {}", report.failing_at_most);
}
