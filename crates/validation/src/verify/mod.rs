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

pub use check::Check;
pub use report::{Report, Row};

/// Any error that a case may end with; it fails the case.
pub(crate) type CaseError = Box<dyn std::error::Error + Send + Sync>;

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
        shows: "Material law and stress: one element stretched and squeezed with free sides, \
                against the closed form.",
        quick: true,
        run: uniaxial::run,
    },
    Case {
        name: "ogden",
        shows: "Both published Ogden laws: one element in uniaxial, planar and equibiaxial \
                strain, against the closed form.",
        quick: true,
        run: ogden::run,
    },
    Case {
        name: "relaxation",
        shows: "Prony series: a confined column relaxes under a held plate and creeps under a \
                rising load as the closed forms say, and energy is stored or dissipated but \
                not lost.",
        quick: true,
        run: relaxation::run,
    },
    Case {
        name: "tangent",
        shows: "The assembled tangent is the derivative of the assembled residual, also with \
                contact of a curved indenter.",
        quick: true,
        run: tangent::run,
    },
    Case {
        name: "convergence",
        shows: "Errors fall with the mesh size at the order that theory gives each element, \
                for a curved solution at finite strain that was manufactured with its body \
                force.",
        quick: true,
        run: manufactured::run,
    },
    Case {
        name: "cook",
        shows: "Cook's membrane: bending and shear of a skewed mesh at large deflection, \
                compressible and nearly incompressible.",
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
        shows: "A uniformly loaded disc sinks into a half-space as Boussinesq's solution says.",
        quick: true,
        run: disc::run,
    },
    Case {
        name: "hertz",
        shows: "Contact: force and contact radius of a rigid sphere on a half-space at small \
                load.",
        quick: true,
        run: hertz::run,
    },
    Case {
        name: "coulomb",
        shows: "Friction: a block that is dragged slips with Coulomb's force, and sticks as if \
                it were glued.",
        quick: true,
        run: coulomb::run,
    },
    Case {
        name: "cylinder",
        shows: "Line contact in plane strain: half-width and pressure of a rigid cylinder on a \
                half-plane for its force.",
        quick: true,
        run: half_plane::cylinder,
    },
    Case {
        name: "wedge",
        shows: "A blunt wedge on a half-plane: half-width and pressure for its force.",
        quick: true,
        run: half_plane::wedge,
    },
    Case {
        name: "punch",
        shows: "A flat punch: force on a half-space, pressure on a half-plane, and growth of \
                the pressure at the edge as elements shrink.",
        quick: true,
        run: punch::run,
    },
    Case {
        name: "file",
        shows: "A body from a Gmsh file: a block of two layers under a sphere is the block \
                that this code makes itself.",
        quick: true,
        run: file::run,
    },
    Case {
        name: "locking",
        shows: "No volumetric locking: a bonded block of Poisson's ratio 0.4999 squeezed by a \
                plate, linear against quadratic elements, solid and in plane strain.",
        quick: true,
        run: locking::run,
    },
    Case {
        name: "balances",
        shows: "The fingertip under an indenter balances at every equilibrium: plate against \
                supports, energy against work.",
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
        shows: "Elastic bone and nail, 5e5 times as stiff as fat, converge and balance, and \
                the bone carries as a rigid one does.",
        quick: false,
        run: solid_parts::run,
    },
    Case {
        name: "mirror",
        shows: "A simulation with the finger rolled to the left is the mirror image of one \
                rolled to the right.",
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
