//! The named suite of hard cases: each converges to a right answer or is refused by a
//! typed error that says what and where.
//!
//! One file a group of cases; [`CASES`] is the registry. A case is hard if a reasonable
//! implementation would lock, invert, oscillate, overflow, diverge or quietly return a
//! wrong map. What a case yields is a [`Line`] a variant, and a line passes only by its
//! checks: against a closed form, another discretisation, an invariant, or the words of a
//! refusal. How a single quantity is compared is [`crate::verify::Check`]'s business.

mod bodies;
mod differential;
mod edges;
mod files;
mod friction;
mod history;
mod incompressible;
mod indentation;
mod lab;
mod line;
mod ogden;
mod report;
pub mod scenes;
mod snap;
mod stretches;
mod touch;
mod units;
mod volume;

pub use line::{End, Hardness, Line};
pub use report::Report;

use crate::verify::CaseError;
use papilla_fingertip::simulation::body::{Body, SimulationError};
use serde::Serialize;
use std::cell::OnceCell;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Instant;

/// How much of the suite to run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Extent {
    /// Every case, by its cheapest variants that can still break the promise: for a test run.
    Quick,
    /// Every variant.
    #[default]
    Usual,
    /// Finer meshes and more random problems.
    Long,
}

/// How much to run, and what several cases share.
pub(crate) struct Suite {
    extent: Extent,
    /// The coarse fingertip, meshed when first asked for.
    finger: OnceCell<Body>,
}

impl Suite {
    fn quick(&self) -> bool {
        self.extent == Extent::Quick
    }

    fn long(&self) -> bool {
        self.extent == Extent::Long
    }

    fn finger(&self) -> Result<&Body, SimulationError> {
        if let Some(body) = self.finger.get() {
            return Ok(body);
        }
        let body = Body::usual(papilla_fingertip::mesh::fingertip::Density::Coarse)?;
        Ok(self.finger.get_or_init(|| body))
    }
}

/// A hard case.
pub struct Case {
    /// Name on the command line.
    pub name: &'static str,
    /// What it promises, one sentence.
    pub promise: &'static str,
    run: fn(&Suite) -> Result<Vec<Line>, CaseError>,
}

/// Every case.
pub const CASES: &[Case] = &[
    Case {
        name: "incompressible",
        promise: "Up to a Poisson's ratio of .49999 no element locks: the deflection of Cook's \
                  membrane and the force on a squeezed block are those of quadratic elements.",
        run: incompressible::run,
    },
    Case {
        name: "thin-layer",
        promise: "With an epidermis of .02 mm, whose elements are 50 times as wide as thick, \
                  linear elements give the same force as quadratic ones, and balances hold.",
        run: bodies::thin_layer,
    },
    Case {
        name: "elastic-bone",
        promise: "With elastic bone 5e5 to 5e6 times as stiff as fat, the difference from the \
                  solution on rigid bone falls as 1 / E, where E is the bone's Young's modulus.",
        run: bodies::elastic_bone,
    },
    Case {
        name: "ogden",
        promise: "Ogden's law with an exponent alpha of 25 or a negative mu, at the edge of its \
                  stability and far beyond: all results are finite. Inside the calibrated \
                  stretches they are those of the closed form, outside they are flagged.",
        run: ogden::run,
    },
    Case {
        name: "equal-stretches",
        promise: "At principal stretches that differ by 0 to 1e-6, stress and tangent are those of \
                  the limit of equal stretches, and those of a law that needs no principal \
                  stretches.",
        run: stretches::run,
    },
    Case {
        name: "volume",
        promise: "A confined body squeezed to a volume ratio J of .05 on distorted meshes follows \
                  the closed form; J below 0 is refused.",
        run: volume::run,
    },
    Case {
        name: "one-increment",
        promise: "An indenter that goes 2 mm deep in one increment ends in the state that ten \
                  increments end in.",
        run: indentation::one_increment,
    },
    Case {
        name: "deep",
        promise: "At 3 mm depth, near the bone, balances hold, no element inverts, and linear and \
                  quadratic elements agree.",
        run: indentation::deep,
    },
    Case {
        name: "tilt",
        promise: "A plate at 0, 30, 60 and 80 degrees, and one that touches with a corner first, \
                  balance and keep the finger's symmetry.",
        run: indentation::tilt,
    },
    Case {
        name: "sharp-wedge",
        promise: "Under a ruler 2 mm thick on element faces of 1 and .73 mm, balances hold and the \
                  force is that of a finer mesh. Wedges with tips of .05 and .005 mm balance, or \
                  are refused with the depth that was not reached. A wedge that fits between two \
                  nodes is refused before anything is solved.",
        run: edges::run,
    },
    Case {
        name: "contact-lost",
        promise: "After contact is lost the body returns to rest; pressed again, it returns to its \
                  first state.",
        run: touch::lost_and_regained,
    },
    Case {
        name: "grazing",
        promise: "If an indenter grazes one face, the force rises smoothly from nothing.",
        run: touch::grazing,
    },
    Case {
        name: "first-gap",
        promise: "An indenter that starts 1e-9, 5 or 100 mm away from the body ends in the same \
                  state as one that starts in touch.",
        run: touch::gaps,
    },
    Case {
        name: "penetration",
        promise: "An indenter that starts inside the body is refused, or the body is pushed out of \
                  it into the state that an indenter from outside causes.",
        run: touch::penetration,
    },
    Case {
        name: "time-steps",
        promise: "A ramp of 1e-6 s shows the instantaneous modulus of a relaxing tissue, one of \
                  1e6 s the long-term modulus, both in a bounded number of steps.",
        run: history::durations,
    },
    Case {
        name: "relaxation-times",
        promise: "Tiny and huge relaxation times give the limits of fast and slow relaxation; \
                  times of zero, below zero or not finite are refused.",
        run: history::relaxation_times,
    },
    Case {
        name: "friction",
        promise: "A block that is dragged has no drag at a coefficient of friction of 0, Coulomb's \
                  drag at 1e-9 and 1, and the force of a glued block at 10.",
        run: friction::run,
    },
    Case {
        name: "free-modes",
        promise: "A body, or a part of one, that no support holds is refused, and the error names \
                  its free motion.",
        run: bodies::free_modes,
    },
    Case {
        name: "mesh-files",
        promise: "Inverted, duplicate and sliver elements, loose parts and absurd scales in a Gmsh \
                  file (.msh) are refused; the error names the line and the cure.",
        run: files::run,
    },
    Case {
        name: "units",
        promise: "Values that are wrong by a factor of 1000 or more are refused, and the error \
                  names the unit that was probably meant.",
        run: units::run,
    },
    Case {
        name: "snap-through",
        promise: "The truth is the equilibrium path of a shallow arch under prescribed \
                  displacement. Under a load below the limit load the arch is on this path. Above, \
                  it is on the far branch of the path, or refused at the limit load.",
        run: snap::run,
    },
    Case {
        name: "differential",
        promise: "Random small problems agree for loose and tight tolerances, one step and many, \
                  three elimination orders, one and two threads, linear and quadratic elements. A \
                  second run repeats bit for bit.",
        run: differential::run,
    },
];

/// Runs the cases that `wanted` accepts; `visit` is told of each before (`None`) and
/// after (`Some(lines)`).
pub fn run(
    extent: Extent,
    wanted: &dyn Fn(&Case) -> bool,
    visit: &mut dyn FnMut(&Case, Option<&[Line]>),
) -> Report {
    let suite = Suite { extent, finger: OnceCell::new() };
    let mut report = Report { extent, lines: Vec::new() };
    for case in CASES.iter().filter(|c| wanted(c)) {
        visit(case, None);
        let before = report.lines.len();
        report.lines.extend(case.lines(&suite));
        visit(case, Some(&report.lines[before..]));
    }
    report
}

impl Case {
    /// The lines of the case; an error or a panic of its own is a line that fails.
    fn lines(&self, suite: &Suite) -> Vec<Line> {
        let clock = Instant::now();
        let broken = |what: String| vec![Line::broken("", what)];
        let mut lines = match catch_unwind(AssertUnwindSafe(|| (self.run)(suite))) {
            Ok(Ok(lines)) if lines.is_empty() => broken("gave no line".into()),
            Ok(Ok(lines)) => lines,
            Ok(Err(error)) => broken(error.to_string()),
            Err(panic) => broken(format!("panicked: {}", panic_text(panic.as_ref()))),
        };
        let seconds = clock.elapsed().as_secs_f64();
        for line in &mut lines {
            (line.case, line.seconds) = (self.name, seconds);
        }
        lines
    }
}

fn panic_text(panic: &(dyn std::any::Any + Send)) -> &str {
    let text = panic.downcast_ref::<String>().map(String::as_str);
    text.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("no message")
}
