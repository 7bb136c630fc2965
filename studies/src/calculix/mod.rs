//! Cases that this code and CalculiX solve on equal meshes.
//!
//! [`Ccx`] runs CalculiX on the decks of `papilla-calculix`, [`Dat`] reads what it prints.

mod dat;
mod finger;
mod indentation;
mod limit;
mod one_element;
mod ours;
mod patch;
mod run;
mod section;
mod sphere;

pub use dat::{Dat, DatError, Quantity, Table};
pub use run::{Ccx, CcxError, Run};

use papilla_validation::verify::{CaseError, Check, Report, Row};
use std::path::Path;

/// Where the references come from.
const SOURCE: &str = "CalculiX";

/// What the cases share.
struct Context<'a> {
    ccx: &'a Ccx,
    /// Folder for decks and results.
    folder: &'a Path,
    /// Smaller meshes.
    quick: bool,
}

/// One problem that both codes solve.
pub struct Case {
    /// Name on the command line.
    pub name: &'static str,
    /// What its rows show, one sentence.
    pub shows: &'static str,
    run: fn(&Context<'_>) -> Result<Vec<Check>, CaseError>,
}

/// Every case, cheap ones first.
pub const CASES: &[Case] = &[
    Case {
        name: "one-element",
        shows: "One element of each material and kind, stretched and sheared: the laws and their \
                constants mean the same in both codes.",
        run: one_element::run,
    },
    Case {
        name: "patch",
        shows: "Even strain of a block whose cells are halved: nodes that hang follow exactly in \
                both codes.",
        run: patch::run,
    },
    Case {
        name: "sphere",
        shows: "A block of two layers under a rigid sphere: contact, force, displacement, and SED \
                where the layers meet.",
        run: sphere::run,
    },
    Case {
        name: "section",
        shows: "The plane-strain section under a flat plate: three laws in two dimensions.",
        run: section::run,
    },
    Case {
        name: "finger",
        shows: "The fingertip under a tilted plate, from a scene.",
        run: finger::plate,
    },
    Case {
        name: "finger-ball-compressible",
        shows: "The finger with cells halved where a ball of 6 mm touches, coarse, nu = 0.3: \
                without the elements' treatment of volume both codes agree.",
        run: finger::ball_compressible,
    },
    Case {
        name: "finger-ball-coarse",
        shows: "The same as it is, nu = 0.48.",
        run: finger::ball_coarse,
    },
    Case {
        name: "finger-bar-coarse",
        shows: "The finger with cells halved where a bar of 1 mm touches, coarse.",
        run: finger::bar_coarse,
    },
    Case {
        name: "finger-ball",
        shows: "The ball on the finger that datasets are made with, medium.",
        run: finger::ball,
    },
    Case {
        name: "finger-bar",
        shows: "The bar on that finger, medium: some ten minutes of CalculiX.",
        run: finger::bar,
    },
    Case {
        name: "finger-ball-fine",
        shows: "The ball on the reference's mesh: six minutes.",
        run: finger::ball_fine,
    },
    Case {
        name: "finger-bar-fine",
        shows: "The bar on that mesh: half an hour of CalculiX.",
        run: finger::bar_fine,
    },
];

/// Runs the cases that `wanted` accepts, with decks and results in `folder`;
/// `visit` is told of each before (`None`) and after (`Some(rows)`).
pub fn run(
    ccx: &Ccx,
    folder: &Path,
    quick: bool,
    wanted: &dyn Fn(&Case) -> bool,
    visit: &mut dyn FnMut(&Case, Option<&[Row]>),
) -> Report {
    let context = Context { ccx, folder, quick };
    let mut report = Report { quick, ..Report::default() };
    for case in CASES.iter().filter(|c| wanted(c)) {
        visit(case, None);
        visit(case, Some(report.take(case.name, || (case.run)(&context))));
    }
    report
}
