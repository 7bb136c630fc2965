//! How wrong an answer is likely to be: laws of the errors of networks and contact, fitted to
//! simulations that no training saw, and checked on others.
//!
//! [`States::of`] computes the answers for the states, [`Outcome::of`] fits and checks the
//! [laws](papilla_engine::error_law), and [`report`] writes the page about them.

mod cost;
mod fit;
mod plot;
mod quantile;
pub mod report;
mod states;

pub(crate) use self::fit::FOLDS;
use self::fit::{Checked, Form, checked, checked_without_its_set, law, usable, weighed};
use crate::metrics::quantile;
use crate::split::SplitOrAll;
use papilla_dataset::Split;
use papilla_engine::MODEL_FORMAT;
use papilla_engine::error_law::{ErrorLaws, Fact, MethodLaw, NetworkLaws};
use papilla_proto::contact::ContactMethod;
use serde::Serialize;

pub use self::cost::Cost;
pub use self::plot::reliability;
pub use self::states::{Case, States};

/// A set of states, and what it is for.
#[derive(Debug, Clone, Copy)]
pub struct Set {
    /// Folder of the dataset.
    pub folder: &'static str,
    /// What it holds.
    pub about: &'static str,
    split: SplitOrAll,
    /// The bound holds in each group by itself.
    group: &'static str,
    /// It is set aside: nothing is fitted to it.
    is_final: bool,
    /// So many simulations it counts for at most.
    simulations_max: f64,
    /// One state of so many is taken, another one of each simulation.
    every: usize,
}

impl Set {
    const PLAIN: Self = Self {
        folder: "",
        about: "",
        split: SplitOrAll::Split(Split::Test),
        group: "trained shapes",
        is_final: false,
        simulations_max: f64::INFINITY,
        every: 1,
    };

    /// Presses as those of the training, of whatever shape.
    fn is_ordinary(&self) -> bool {
        ["trained shapes", "unseen shapes"].contains(&self.group)
    }

    fn takes(&self, simulation: usize, state: usize) -> bool {
        // 5 and 16 have no common factor: depths are taken evenly.
        (5 * simulation + state).is_multiple_of(self.every)
    }
}

/// The groups, in the order in which they are drawn.
pub(crate) const GROUPS: [&str; 5] =
    ["trained shapes", "unseen shapes", "hard and deep", "tilted plates", "set aside"];

/// The sets, in the order of tables. No network was trained on any of their states.
pub const SETS: [Set; 11] = [
    Set {
        folder: "broad-graded",
        about: "shapes and depths of the training, the held-out part: *other simulations*",
        ..Set::PLAIN
    },
    Set { folder: "more-graded", about: "likewise", ..Set::PLAIN },
    Set {
        folder: "fidelity",
        about: "likewise, on the finest mesh",
        split: SplitOrAll::All,
        ..Set::PLAIN
    },
    Set {
        folder: "heldout-graded",
        about: "shapes that training never saw: *unseen shapes*",
        split: SplitOrAll::All,
        group: "unseen shapes",
        ..Set::PLAIN
    },
    Set {
        folder: "pressed-graded",
        about: "plates to 7 N, keys (plates of 7 x 7 mm), gratings",
        group: "hard and deep",
        ..Set::PLAIN
    },
    Set {
        folder: "hard-graded",
        about: "plates to 7 N, edges",
        group: "hard and deep",
        ..Set::PLAIN
    },
    Set {
        folder: "proximal-graded",
        about: "indenters near the end towards the hand",
        group: "hard and deep",
        ..Set::PLAIN
    },
    Set {
        folder: "deep-graded",
        about: "2.2 and 2.6 mm deep",
        split: SplitOrAll::All,
        group: "hard and deep",
        ..Set::PLAIN
    },
    Set {
        folder: "s1-graded",
        about: "one plate at angles to 45 degrees; every 16th of its states",
        split: SplitOrAll::All,
        group: "tilted plates",
        simulations_max: 15.0,
        every: 16,
        ..Set::PLAIN
    },
    Set {
        folder: "final",
        about: "other shapes, on the finest mesh: the *reference set*",
        split: SplitOrAll::All,
        group: "set aside",
        is_final: true,
        ..Set::PLAIN
    },
    Set {
        folder: "final-anew",
        about: "the same shapes in other poses: *twelve more*",
        split: SplitOrAll::All,
        group: "set aside",
        is_final: true,
        ..Set::PLAIN
    },
];

/// The methods of contact that are calibrated; with the two rough ones SED is wrong by half and more.
pub const METHODS: [ContactMethod; 3] =
    [ContactMethod::Pixels, ContactMethod::CoarsePixels, ContactMethod::SecondOrder];

/// What is fitted: an error, and how the pressure was found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Series {
    /// The network; none: the force.
    pub network: Option<String>,
    /// The method of contact; none: FE's pressure is given.
    pub method: Option<ContactMethod>,
}

impl Series {
    fn form(&self) -> Form {
        match self.network {
            Some(_) => Form {
                median: Fact::OF_SED.to_vec(),
                bound: vec![Fact::Strange],
                group: |set| set.group,
            },
            // The error of one number varies so much that a small group says nothing by itself.
            None => Form {
                median: Fact::OF_FORCE.to_vec(),
                bound: vec![Fact::Load],
                group: |set| if set.is_ordinary() { "ordinary" } else { "off range" },
            },
        }
    }

    fn is_of(&self, case: &Case) -> bool {
        case.network == self.network && case.method == self.method
    }

    /// Name in tables.
    #[must_use]
    pub fn name(&self) -> String {
        let from = self.method.map_or("FE's pressure".to_owned(), |of| format!("`{of}`"));
        match &self.network {
            Some(network) => format!("SED by `{network}` from {from}"),
            None => format!("force by {from}"),
        }
    }
}

/// How a law does on the cases of one set.
#[derive(Debug, Clone, Serialize)]
pub struct Row {
    /// The set; none: all that are not set aside.
    pub set: Option<&'static str>,
    /// How many answers.
    pub states: usize,
    /// Of which an error is stated.
    pub stated: usize,
    /// Median of the true errors of those.
    pub true_median: f64,
    /// Their 90th percentile.
    pub true_p90: f64,
    /// Median of the stated medians.
    pub stated_median: f64,
    /// Median of the stated bounds.
    pub stated_p90: f64,
    /// Share of the true errors below the stated median.
    pub below_median: f64,
    /// Share of the true errors below the stated bound.
    pub below_p90: f64,
    /// Greatest true error over its bound.
    pub worst: f64,
    /// Median of bound over median, both stated.
    pub bound_over_median: f64,
    /// Median of the true errors of which nothing is stated.
    pub unstated_median: Option<f64>,
}

/// A true error, and what was stated of it: median and bound.
type Told = (f64, [f64; 2]);

impl Row {
    fn of(set: Option<&'static str>, cases: &[Checked<'_>]) -> Option<Self> {
        if cases.is_empty() {
            return None;
        }
        let told: Vec<Told> =
            cases.iter().filter_map(|c| Some((c.of.case.error, c.stated?))).collect();
        let part = |values: &[f64], share: f64| quantile(values, share).unwrap_or(f64::NAN);
        let all = |value: &dyn Fn(&Told) -> f64| told.iter().map(value).collect::<Vec<_>>();
        let errors = all(&|(error, _)| *error);
        let share = |is: &dyn Fn(&Told) -> bool| {
            told.iter().filter(|of| is(of)).count() as f64 / told.len() as f64
        };
        let untold: Vec<f64> =
            cases.iter().filter(|c| c.stated.is_none()).map(|c| c.of.case.error).collect();
        Some(Self {
            set,
            states: cases.len(),
            stated: told.len(),
            true_median: part(&errors, 0.5),
            true_p90: part(&errors, 0.9),
            stated_median: part(&all(&|(_, [median, _])| *median), 0.5),
            stated_p90: part(&all(&|(_, [_, p90])| *p90), 0.5),
            below_median: share(&|(error, [median, _])| error <= median),
            below_p90: share(&|(error, [_, p90])| error <= p90),
            worst: all(&|(error, [_, p90])| error / p90).into_iter().fold(f64::NAN, f64::max),
            bound_over_median: part(&all(&|(_, [median, p90])| p90 / median), 0.5),
            unstated_median: quantile(&untold, 0.5),
        })
    }
}

/// One error that was fitted and checked.
#[derive(Debug, Clone, Serialize)]
pub struct Fitted {
    /// Which.
    #[serde(flatten)]
    pub series: Series,
    /// Set by set, by laws of other simulations, and of all sets that are not set aside.
    pub rows: Vec<Row>,
    /// The same by laws that saw nothing of the set.
    pub without_its_set: Vec<Row>,
    /// Of each answer about which something is stated: group, bound, true error.
    #[serde(skip)]
    pub(crate) points: Vec<(&'static str, [f64; 2], f64)>,
}

/// A set of facts that was tried.
#[derive(Debug, Clone, Serialize)]
pub struct Tried {
    /// Which error.
    #[serde(flatten)]
    pub series: Series,
    /// What is left of the facts.
    pub facts: &'static str,
    /// How many facts.
    pub count: usize,
    /// Mean pinball loss of the logarithm of the median; less is better.
    pub loss_median: f64,
    /// The same of the bound.
    pub loss_p90: f64,
    /// Over all sets that are not set aside.
    pub row: Row,
}

/// What a calibration came to.
#[derive(Debug, Serialize)]
pub struct Outcome {
    /// The laws for the models' folder.
    #[serde(skip)]
    pub laws: ErrorLaws,
    /// Error by error.
    pub fitted: Vec<Fitted>,
    /// Other sets of facts.
    pub tried: Vec<Tried>,
    /// What it takes in a frame.
    pub cost: Option<Cost>,
}

/// The networks of which figures stand on the page.
const SHOWN: &str = "small";

impl Outcome {
    /// Fits and checks all laws; of errors without cases there are none. `step` is called after each.
    #[must_use]
    pub fn of(states: &States, mut step: impl FnMut()) -> Self {
        let mut laws = ErrorLaws {
            format: MODEL_FORMAT,
            atlas_hash: states.atlas_hash.clone(),
            contact_sha256: states.contact_sha256.clone(),
            networks: Vec::new(),
            force: Vec::new(),
        };
        let mut fitted = Vec::new();
        let mut fit = |series: Series| {
            let of = weighed(states.cases.iter().filter(|case| series.is_of(case)));
            let form = series.form();
            let law = law(&usable(&of, &form), &form)?;
            fitted.push(Fitted::of(series, &of, &form));
            step();
            Some(law)
        };
        for (name, onnx_sha256) in &states.networks {
            let series = |method| Series { network: Some(name.clone()), method };
            let Some(given) = fit(series(None)) else { continue };
            let by = METHODS
                .into_iter()
                .filter_map(|method| Some(MethodLaw { method, law: fit(series(Some(method)))? }));
            let contact = by.collect();
            let (name, onnx_sha256) = (name.clone(), onnx_sha256.clone());
            laws.networks.push(NetworkLaws { name, onnx_sha256, given, contact });
        }
        for method in METHODS {
            let law = fit(Series { network: None, method: Some(method) });
            laws.force.extend(law.map(|law| MethodLaw { method, law }));
        }
        Self { laws, fitted, tried: tried(states), cost: None }
    }
}

impl Fitted {
    fn of(series: Series, cases: &[fit::Weighed<'_>], form: &Form) -> Self {
        let found = checked(cases, form);
        let rows = |found: &[Checked<'_>]| {
            let of_set = |set: &Set| {
                let is_of = |c: &&Checked<'_>| c.of.set.folder == set.folder;
                Row::of(Some(set.folder), &found.iter().filter(is_of).copied().collect::<Vec<_>>())
            };
            SETS.iter().filter_map(of_set).collect::<Vec<Row>>()
        };
        let kept: Vec<_> = found.iter().filter(|c| !c.of.set.is_final).copied().collect();
        let mut all = rows(&found);
        all.extend(Row::of(None, &kept));
        let point = |c: &Checked<'_>| Some((c.of.set.group, c.stated?, c.of.case.error));
        Self {
            series,
            rows: all,
            without_its_set: rows(&checked_without_its_set(cases, form)),
            points: found.iter().filter_map(point).collect(),
        }
    }

    /// The row of a set; none: of all that are not set aside.
    #[must_use]
    pub fn row(&self, set: Option<&str>) -> Option<&Row> {
        self.rows.iter().find(|row| row.set == set)
    }
}

/// Other sets of facts, of the default network, from FE's pressure and from the default method's.
fn tried(states: &States) -> Vec<Tried> {
    let mut found = Vec::new();
    for method in [None, Some(ContactMethod::Pixels)] {
        let series = Series { network: Some(SHOWN.to_owned()), method };
        let cases = weighed(states.cases.iter().filter(|case| series.is_of(case)));
        let full = series.form();
        let without = |left_out: &[Fact]| {
            let keep = |facts: &[Fact]| {
                facts.iter().filter(|fact| !left_out.contains(fact)).copied().collect()
            };
            Form { median: keep(&full.median), bound: keep(&full.bound), ..full.clone() }
        };
        let only =
            |facts: &[Fact]| Form { median: facts.to_vec(), bound: Vec::new(), ..full.clone() };
        let forms = vec![
            ("none: one figure for all answers", only(&[])),
            ("peak", only(&[Fact::Peak])),
            ("peak, concentration", only(&[Fact::Peak, Fact::Concentration])),
            ("all but energy", without(&[Fact::Energy])),
            ("all but strange and inside", without(&[Fact::Strange, Fact::Inside])),
            ("all but tip, side and heel", without(&[Fact::Tip, Fact::Side, Fact::Heel])),
            ("all", full.clone()),
        ];
        for (facts, form) in forms {
            let checked = checked(&cases, &form);
            let kept: Vec<_> = checked.iter().filter(|c| !c.of.set.is_final).copied().collect();
            let Some(row) = Row::of(None, &kept) else { continue };
            let loss = |share: f64, at: usize| {
                let of = |c: &Checked<'_>| {
                    let miss = c.of.case.error.ln() - c.stated?[at].ln();
                    Some((share * miss).max((share - 1.0) * miss))
                };
                let losses: Vec<f64> = kept.iter().filter_map(of).collect();
                losses.iter().sum::<f64>() / losses.len() as f64
            };
            let (loss_median, loss_p90) = (loss(0.5, 0), loss(0.9, 1));
            let (series, count) = (series.clone(), form.median.len());
            found.push(Tried { series, facts, count, loss_median, loss_p90, row });
        }
    }
    found
}
