//! A person's own records: force over depth and time under a plate or a ball.
//!
//! A file is a table of comma-separated values with the columns of [`COLUMNS`], in any order. Lines
//! that start with `#` are comments. Rows of the same `press` belong together, in the order of time.

use crate::people::PeopleError;
use papilla_sdf::{IndenterSpec, Plate, Sphere};
use serde::Serialize;
use std::path::Path;

/// Columns of a file, each with its unit.
pub const COLUMNS: [(&str, &str); 7] = [
    ("press", "any name: rows of the same name are one press"),
    ("indenter", "plate or ball"),
    ("radius_mm", "radius of the ball, mm; empty for a plate"),
    ("pitch_deg", "inclination of the plate, tip first, degrees; 0 for a ball"),
    ("time_s", "time since first touch, s"),
    ("depth_mm", "depth from first touch, mm"),
    ("force_n", "force into the finger, N"),
];

/// Fewest samples of a press that are of use.
const SAMPLES_MIN: usize = 3;
/// Beyond it a force must have been meant in another unit, N.
const FORCE_MAX_N: f64 = 50.0;
/// Beyond it a depth must have been meant in another unit: pulps are thinner, mm.
const DEPTH_MAX_MM: f64 = 6.0;
/// A press that goes no deeper must have been meant in another unit, mm.
const DEEPEST_MIN_MM: f64 = 0.05;

/// One press of a record.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RecordedPress {
    /// Its name.
    pub name: String,
    /// What pressed.
    pub indenter: IndenterSpec,
    /// Inclination, degrees.
    pub pitch_deg: f64,
    /// What was measured, in the order of time.
    pub samples: Vec<RecordedSample>,
}

/// One row.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct RecordedSample {
    /// Time since first touch, s.
    pub time_s: f64,
    /// Depth, mm.
    pub depth_mm: f64,
    /// Force, N.
    pub force_n: f64,
}

impl RecordedPress {
    /// Deepest depth, mm.
    #[must_use]
    pub fn deepest_mm(&self) -> f64 {
        self.samples.iter().map(|s| s.depth_mm).fold(0.0, f64::max)
    }
}

/// The presses of a file.
///
/// # Errors
/// [`PeopleError::Record`] names file, line and column, and what to do.
pub fn read(path: &Path) -> Result<Vec<RecordedPress>, PeopleError> {
    let text = papilla_json::read_text(path)
        .map_err(|e| PeopleError::Read { path: path.into(), why: e.to_string() })?;
    parse(path, &text)
}

fn parse(path: &Path, text: &str) -> Result<Vec<RecordedPress>, PeopleError> {
    let said = |line: &&(u64, &str)| !line.1.trim().is_empty() && !line.1.starts_with('#');
    let lines: Vec<(u64, &str)> = (1..).zip(text.lines()).filter(|l| said(&l)).collect();
    let file = File { path, lines: lines.iter().map(|l| l.0).collect() };
    let table = lines.iter().flat_map(|l| [l.1, "\n"]).collect::<String>();
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(table.as_bytes());
    let head = reader.headers().map_err(|e| file.csv(&e))?.clone();
    let first = file.line(1);
    let column = |name: &str| {
        head.iter().position(|h| h == name).ok_or_else(|| {
            let known: Vec<&str> = COLUMNS.iter().map(|c| c.0).collect();
            let known = known.join(", ");
            file.bad(first, format!("no column '{name}': the first line has to name {known}"))
        })
    };
    let mut places = [0; COLUMNS.len()];
    for (place, (name, _)) in places.iter_mut().zip(COLUMNS) {
        *place = column(name)?;
    }
    if let Some(unknown) = head.iter().find(|h| !COLUMNS.iter().any(|c| c.0 == *h)) {
        return Err(file.bad(first, format!("unknown column '{unknown}': leave it out")));
    }
    let mut presses: Vec<(u64, RecordedPress)> = Vec::new();
    for row in reader.records() {
        let row = row.map_err(|e| file.csv(&e))?;
        let line = file.line(row.position().map_or(1, csv::Position::line));
        let cells = places.map(|p| row.get(p).unwrap_or(""));
        file.take(line, cells, &mut presses)?;
    }
    if presses.is_empty() {
        return Err(file.bad(first, "no rows below the names of the columns".into()));
    }
    presses.iter().try_for_each(|(line, press)| file.check(*line, press))?;
    Ok(presses.into_iter().map(|p| p.1).collect())
}

/// The file that errors name.
struct File<'a> {
    path: &'a Path,
    /// Line in the file of each line of the table.
    lines: Vec<u64>,
}

impl File<'_> {
    fn line(&self, of_table: u64) -> u64 {
        let at = usize::try_from(of_table).ok().and_then(|n| self.lines.get(n.checked_sub(1)?));
        at.copied().unwrap_or(1)
    }

    fn bad(&self, line: u64, why: String) -> PeopleError {
        PeopleError::Record { path: self.path.into(), line, why }
    }

    fn csv(&self, error: &csv::Error) -> PeopleError {
        let line = self.line(error.position().map_or(1, csv::Position::line));
        let why = match error.kind() {
            csv::ErrorKind::UnequalLengths { expected_len, len, .. } => {
                format!("{len} cells: the first line has {expected_len}")
            }
            _ => error.to_string(),
        };
        self.bad(line, why)
    }

    fn number(&self, line: u64, column: &str, cell: &str) -> Result<f64, PeopleError> {
        let number = cell.parse::<f64>().ok().filter(|v| v.is_finite());
        number.ok_or_else(|| {
            self.bad(line, format!("{column} has to be a number with a point; found '{cell}'"))
        })
    }

    /// One row, into the press that it belongs to.
    fn take(
        &self,
        line: u64,
        [name, indenter, radius, pitch, time, depth, force]: [&str; COLUMNS.len()],
        presses: &mut Vec<(u64, RecordedPress)>,
    ) -> Result<(), PeopleError> {
        let indenter = self.indenter(line, indenter, radius)?;
        let pitch_deg = self.number(line, "pitch_deg", pitch)?;
        if !(0.0..=60.0).contains(&pitch_deg) {
            return Err(self.bad(line, format!("pitch_deg has to be 0 to 60; found {pitch_deg}")));
        }
        let sample = RecordedSample {
            time_s: self.number(line, "time_s", time)?,
            depth_mm: self.number(line, "depth_mm", depth)?,
            force_n: self.number(line, "force_n", force)?,
        };
        self.believed(line, sample)?;
        let known = presses.iter_mut().map(|p| &mut p.1).find(|p| p.name == name);
        let Some(press) = known else {
            let samples = vec![sample];
            let name = name.to_owned();
            presses.push((line, RecordedPress { name, indenter, pitch_deg, samples }));
            return Ok(());
        };
        if press.indenter != indenter || press.pitch_deg.total_cmp(&pitch_deg).is_ne() {
            let why =
                format!("press '{name}' has another indenter or pitch_deg above: name it apart");
            return Err(self.bad(line, why));
        }
        let last_s = press.samples.last().map_or(0.0, |s| s.time_s);
        if sample.time_s <= last_s {
            let why = format!(
                "time_s has to rise within a press; found {} after {last_s}",
                sample.time_s
            );
            return Err(self.bad(line, why));
        }
        press.samples.push(sample);
        Ok(())
    }

    fn indenter(&self, line: u64, kind: &str, radius: &str) -> Result<IndenterSpec, PeopleError> {
        match kind {
            "plate" if radius.is_empty() => {
                Ok(IndenterSpec::Plate(Plate { size_mm: [30.0, 30.0], ..Plate::default() }))
            }
            "plate" => Err(self.bad(line, "radius_mm of a plate has to be empty".into())),
            "ball" => {
                let radius_mm = self.number(line, "radius_mm", radius)?;
                if !(0.2..=50.0).contains(&radius_mm) {
                    let why = format!("radius_mm has to be 0.2 to 50 mm; found {radius_mm}");
                    return Err(self.bad(line, why));
                }
                Ok(IndenterSpec::Sphere(Sphere { radius_mm }))
            }
            other => {
                Err(self.bad(line, format!("indenter has to be plate or ball; found '{other}'")))
            }
        }
    }

    fn believed(&self, line: u64, sample: RecordedSample) -> Result<(), PeopleError> {
        let RecordedSample { time_s, depth_mm, force_n } = sample;
        if time_s < 0.0 {
            return Err(self.bad(line, format!("time_s has to be 0 or more; found {time_s}")));
        }
        if !(0.0..=DEPTH_MAX_MM).contains(&depth_mm) {
            let why = format!(
                "depth_mm has to be 0 to {DEPTH_MAX_MM} mm from first touch; found {depth_mm}: was um \
                 meant?"
            );
            return Err(self.bad(line, why));
        }
        if !(0.0..=FORCE_MAX_N).contains(&force_n) {
            let why = format!(
                "force_n has to be 0 to {FORCE_MAX_N} N, into the finger; found {force_n}: was mN or gram \
                 meant, or the other sign?"
            );
            return Err(self.bad(line, why));
        }
        Ok(())
    }

    fn check(&self, line: u64, press: &RecordedPress) -> Result<(), PeopleError> {
        let RecordedPress { name, samples, .. } = press;
        let felt = samples.iter().filter(|s| s.force_n > 0.0 && s.depth_mm > 0.0).count();
        if felt < SAMPLES_MIN {
            let why = format!(
                "press '{name}' has {felt} rows with depth and force: {SAMPLES_MIN} are due"
            );
            return Err(self.bad(line, why));
        }
        let deepest = press.deepest_mm();
        if deepest < DEEPEST_MIN_MM {
            let why = format!("press '{name}' is {deepest} mm deep at most: was m meant for mm?");
            return Err(self.bad(line, why));
        }
        Ok(())
    }
}

/// Forces of tissues that all relax alike, under the forces `elastic_n` that they would bear for ever
/// at the depths of the samples: `F(t) = Fe(t) + sum a_k int exp(-(t - s) / tau_k) dFe(s)`, `Fe` along
/// lines between samples. `over_stays` are the `a_k`, over what stays.
#[must_use]
pub fn relaxed_n(
    elastic_n: &[f64],
    time_s: &[f64],
    times_s: &[f64],
    over_stays: &[f64],
) -> Vec<f64> {
    let mut held = vec![0.0; times_s.len()];
    let (mut last_n, mut last_s) = (0.0, 0.0);
    let force = |(&now_n, &now_s): (&f64, &f64)| {
        let step_s: f64 = now_s - last_s;
        for ((h, tau), a) in held.iter_mut().zip(times_s).zip(over_stays) {
            let x = step_s / tau;
            // Mean of exp(-(t - s) / tau) over the step; 1 of a jump.
            let mean = if x > 0.0 { -(-x).exp_m1() / x } else { 1.0 };
            *h = (-x).exp() * *h + a * mean * (now_n - last_n);
        }
        (last_n, last_s) = (now_n, now_s);
        now_n + held.iter().sum::<f64>()
    };
    elastic_n.iter().zip(time_s).map(force).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: &str = "# a comment\npress,indenter,radius_mm,pitch_deg,time_s,depth_mm,force_n\n\
                        a,plate,,20,0.5,0.2,0.01\na,plate,,20,1.0,0.4,0.05\na,plate,,20,2.0,0.8,0.3\n\
                        b,ball,3.5,0,0.5,0.2,0.01\nb,ball,3.5,0,1.0,0.5,0.04\nb,ball,3.5,0,1.5,0.9,0.1\n";

    #[test]
    fn a_record_is_read() {
        let presses = parse("r.csv".as_ref(), GOOD).unwrap();
        assert_eq!(presses.len(), 2);
        assert_eq!((presses[0].pitch_deg, presses[0].samples.len()), (20.0, 3));
        assert_eq!(presses[1].indenter, IndenterSpec::Sphere(Sphere { radius_mm: 3.5 }));
        assert_eq!(presses[1].deepest_mm(), 0.9);
    }

    #[test]
    fn bad_rows_are_named_with_their_line_and_a_cure() {
        for (from, to, line, words) in [
            ("time_s,depth_mm", "time,depth_mm", 2, "no column 'time_s'"),
            (",force_n", ",force_n,temperature", 2, "unknown column 'temperature'"),
            ("0.5,0.2,0.01\na", "0.5,200,0.01\na", 3, "was um meant?"),
            ("0.8,0.3", "0.8,300", 5, "was mN or gram meant"),
            ("0.8,0.3", "0.8,-0.3", 5, "other sign"),
            ("1.0,0.4,0.05", "0.5,0.4,0.05", 4, "time_s has to rise"),
            ("1.0,0.4,0.05", "1.0,\"0,4\",0.05", 4, "number with a point; found '0,4'"),
            ("a,plate,,20,1.0", "a,plate,,30,1.0", 4, "another indenter or pitch_deg"),
            ("ball,3.5,0,0.5", "cone,3.5,0,0.5", 6, "plate or ball; found 'cone'"),
            ("ball,3.5,0,0.5", "ball,,0,0.5", 6, "radius_mm has to be a number"),
            ("a,plate,,20,0.5", "a,plate,5,20,0.5", 3, "has to be empty"),
            ("b,ball,3.5,0,1.5,0.9,0.1\n", "", 6, "has 2 rows"),
            ("a,plate,,20,1.0,0.4,0.05", "a,plate,,20,1.0,0.4", 4, "6 cells"),
        ] {
            let text = GOOD.replacen(from, to, 1);
            assert_ne!(text, GOOD, "{from}");
            let error = parse("r.csv".as_ref(), &text).unwrap_err();
            let PeopleError::Record { line: found, .. } = &error else { panic!("{error}") };
            assert_eq!(*found, line, "{error}");
            let text = error.to_string();
            assert!(text.contains(words) && text.contains("r.csv"), "{text} should say {words}");
        }
    }

    #[test]
    fn metres_are_suspected() {
        let mut text = String::from("press,indenter,radius_mm,pitch_deg,time_s,depth_mm,force_n\n");
        for k in 1..5 {
            text += &format!("a,plate,,0,{k},0.000{k},0.{k}\n");
        }
        let error = parse("r.csv".as_ref(), &text).unwrap_err().to_string();
        assert!(error.contains("was m meant"), "{error}");
    }

    /// A step relaxes as the series does, a slow press does not, and a fast one is stiffer by all.
    #[test]
    fn a_step_relaxes_as_its_series() {
        let (tau, a) = ([0.004, 0.07, 1.4], [3.0, 0.5, 0.2]);
        let time: Vec<f64> = (0..40).map(|k| 0.05 * f64::from(k)).collect();
        let found = relaxed_n(&[2.0; 40], &time, &tau, &a);
        for (t, f) in time.iter().zip(&found) {
            let exact = 2.0 * (1.0 + (0..3).map(|k| a[k] * (-t / tau[k]).exp()).sum::<f64>());
            assert!((f - exact).abs() < 1e-12, "{t}: {f} {exact}");
        }
        let ramp: Vec<f64> = (1..=40).map(f64::from).collect();
        let slow: Vec<f64> = ramp.iter().map(|k| 100.0 * k).collect();
        let last = |time: &[f64]| relaxed_n(&ramp, time, &tau, &a)[39] / 40.0;
        assert!((last(&slow) - 1.0).abs() < 1e-3, "{}", last(&slow));
        let fast: Vec<f64> = ramp.iter().map(|k| 1e-7 * k).collect();
        assert!((last(&fast) - 4.7).abs() < 0.01, "{}", last(&fast));
    }
}
