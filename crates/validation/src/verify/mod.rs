//! Checks of the whole solver against closed forms, published values and itself.
//!
//! One file a case; [`CASES`] is the registry. Every case solves real problems
//! through the same [`papilla_fem::solve::Solver`] that presses fingers.

mod balances;
pub(crate) mod bodies;
mod check;
pub(crate) mod cook;
pub(crate) mod coulomb;
mod density;
mod disc;
mod file;
mod half_plane;
mod hertz;
mod increments;
mod locking;
mod manufactured;
mod mirror;
mod ogden;
mod patch;
mod punch;
pub(crate) mod relaxation;
mod report;
mod ring;
mod solid_parts;
mod tangent;
mod uniaxial;

pub use bodies::internal_force;
pub use check::Check;
pub use report::{Report, Row};

/// Any error that a case may end with; it fails the case.
pub type CaseError = Box<dyn std::error::Error + Send + Sync>;

/// How much to run.
pub(crate) struct Context {
    /// Smaller meshes, fewer indentations.
    quick: bool,
}

/// One verification case: a problem and the rows that it yields.
pub struct Case {
    /// Name on the command line.
    pub name: &'static str,
    /// What its rows show, one sentence.
    pub shows: &'static str,
    /// Whether it has a form for a test run; without one, `--quick` leaves it out.
    pub quick: bool,
    run: fn(&Context) -> Result<Vec<Check>, CaseError>,
}

/// Every case, cheap and elementary ones first.
pub const CASES: &[Case] = &[
    Case {
        name: "patch",
        shows: "Every element reproduces constant strain exactly on a distorted mesh, at small \
                and at finite strain.",
        quick: true,
        run: patch::run,
    },
    Case {
        name: "uniaxial",
        shows: "One element that is stretched and squeezed with free sides has the stress and the \
                force of the closed form of its material law.",
        quick: true,
        run: uniaxial::run,
    },
    Case {
        name: "ogden",
        shows: "With both published Ogden laws (skin and subcutaneous tissue) one element in \
                uniaxial, planar and equibiaxial strain has the force of the closed form.",
        quick: true,
        run: ogden::run,
    },
    Case {
        name: "relaxation",
        shows: "A confined column whose material relaxes by a Prony series follows the closed \
                forms, both under a held plate and under a rising load. Work is stored or \
                dissipated, but not lost.",
        quick: true,
        run: relaxation::run,
    },
    Case {
        name: "tangent",
        shows: "The assembled tangent stiffness is the derivative of the assembled residual, also \
                in contact with a curved indenter.",
        quick: true,
        run: tangent::run,
    },
    Case {
        name: "convergence",
        shows: "Errors fall with the mesh size at the order that theory gives each element. The \
                truth is a manufactured solution: a curved field of finite strain is prescribed, \
                and the body force that balances it is applied.",
        quick: true,
        run: manufactured::run,
    },
    Case {
        name: "cook",
        shows: "Cook's membrane, a skewed mesh in bending and shear, deflects as published, also \
                at large deflection and nearly incompressible.",
        quick: true,
        run: cook::run,
    },
    Case {
        name: "ring",
        shows: "A ring under internal pressure opens as Lame's solution says, also in plane \
                strain and nearly incompressible.",
        quick: true,
        run: ring::run,
    },
    Case {
        name: "disc",
        shows: "A half-space under a uniform load on a circle sinks in as Boussinesq's solution says.",
        quick: true,
        run: disc::run,
    },
    Case {
        name: "hertz",
        shows: "Under a small load a rigid sphere on a half-space has the force, the pressure and \
                the contact radius of Hertz' theory.",
        quick: true,
        run: hertz::run,
    },
    Case {
        name: "coulomb",
        shows: "A block that is dragged slips with Coulomb's force. Where friction holds it, it \
                has the force of a glued block.",
        quick: true,
        run: coulomb::run,
    },
    Case {
        name: "cylinder",
        shows: "A rigid cylinder that presses a half-plane with a given force (plane strain) has \
                the half-width of contact and the pressure of Hertz' theory.",
        quick: true,
        run: half_plane::cylinder,
    },
    Case {
        name: "wedge",
        shows: "A blunt wedge that presses a half-plane with a given force has the half-width of \
                contact and the pressure of the closed form.",
        quick: true,
        run: half_plane::wedge,
    },
    Case {
        name: "punch",
        shows: "A flat punch has the force of the closed form on a half-space and its pressure on \
                a half-plane. At the edge the pressure grows without end as the elements shrink.",
        quick: true,
        run: punch::run,
    },
    Case {
        name: "file",
        shows: "A block of two layers that is read from a Gmsh file behaves as the block that \
                this code meshes itself.",
        quick: true,
        run: file::run,
    },
    Case {
        name: "locking",
        shows: "No element locks: linear elements give the force of quadratic ones for a bonded \
                block of Poisson's ratio 0.4999 that a plate squeezes, as a solid and in plane \
                strain.",
        quick: true,
        run: locking::run,
    },
    Case {
        name: "balances",
        shows: "At every equilibrium of the fingertip the force on the plate equals that on the \
                supports, and the energy equals the work.",
        quick: true,
        run: balances::run,
    },
    Case {
        name: "density",
        shows: "Force, pressure and SED under a flat plate change less from the medium to the \
                fine mesh than from the coarse to the medium one.",
        quick: false,
        run: density::run,
    },
    Case {
        name: "increments",
        shows: "Pressure and SED of an elastic simulation do not depend on the number of \
                increments.",
        quick: true,
        run: increments::run,
    },
    Case {
        name: "solid-parts",
        shows: "With elastic bone and nail, 5e5 times as stiff as subcutaneous tissue, the solution converges, \
                balances hold, and the force is that with a rigid bone.",
        quick: false,
        run: solid_parts::run,
    },
    Case {
        name: "mirror",
        shows: "A simulation with the finger rolled to the left is the mirror image of one rolled \
                to the right.",
        quick: true,
        run: mirror::run,
    },
];

/// Runs the cases that `wanted` accepts, `quick` ones in their small form and no others; `visit`
/// is told of each before (`None`) and after (`Some(rows)`).
pub fn run(
    quick: bool,
    wanted: &dyn Fn(&Case) -> bool,
    visit: &mut dyn FnMut(&Case, Option<&[Row]>),
) -> Report {
    let context = Context { quick };
    let mut report = Report { quick, ..Report::default() };
    for case in CASES.iter().filter(|c| (c.quick || !quick) && wanted(c)) {
        visit(case, None);
        visit(case, Some(report.take(case.name, || (case.run)(&context))));
    }
    report
}
