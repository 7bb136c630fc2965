//! Why no finger was made of a surface.

use papilla_fingertip::geometry::fingertip::FingertipShapeError;
use papilla_fingertip::scene::FingerError;
use papilla_sdf::files::FileError;
use std::path::PathBuf;

/// Why no finger was made of a surface. Places are in the file's own frame, mm, unless said
/// otherwise.
#[derive(Debug, thiserror::Error)]
pub enum ScanError {
    /// The file holds no surface.
    #[error(transparent)]
    File(#[from] FileError),
    /// Another unit than was said.
    #[error(
        "{}: the surface is {diagonal:.3} {unit} from corner to corner, which no finger is: it looks like \
         {meant}. Pass --unit {first}",
        path.display()
    )]
    Unit {
        /// The file.
        path: PathBuf,
        /// Size of the box round it, in the unit that was said.
        diagonal: f64,
        /// The unit that was said.
        unit: &'static str,
        /// Units in which it is as large as a finger or a hand.
        meant: String,
        /// The first of them.
        first: &'static str,
    },
    /// Too large or small in any unit.
    #[error(
        "{}: the surface is {diagonal:.3} {unit} from corner to corner: neither a finger nor a hand has that \
         size in any unit",
        path.display()
    )]
    Size {
        /// The file.
        path: PathBuf,
        /// Size of the box round it.
        diagonal: f64,
        /// The unit that was said.
        unit: &'static str,
    },
    /// Nothing but points and lines.
    #[error(
        "all {count} triangles of the surface are without area: export it again, with at least six digits"
    )]
    Flat {
        /// How many.
        count: usize,
    },
    /// Several bodies.
    #[error(
        "the file holds {count} surfaces of a finger's size that are not joined, the largest round {} and {}: \
         two fingers, or a nail that was scanned apart? Keep one in the file",
        place(first_mm),
        place(second_mm)
    )]
    Pieces {
        /// How many.
        count: usize,
        /// Middle of the largest.
        first_mm: [f64; 3],
        /// Middle of the second.
        second_mm: [f64; 3],
    },
    /// A hole that cannot be guessed.
    #[error(
        "the surface has a hole of {around_mm:.1} mm round {}: it is too large to be closed ({most_mm} mm is the \
         most), since nobody knows the skin there. Scan that place, or close it in a mesh editor. The finger's cut \
         end may be open",
        place(at_mm)
    )]
    Hole {
        /// Its length round.
        around_mm: f64,
        /// Its middle.
        at_mm: [f64; 3],
        /// What is closed.
        most_mm: f64,
    },
    /// `--tip` is somewhere else.
    #[error(
        "--tip is {away_mm:.1} mm away from the surface, whose nearest point is {}: give the foremost point of \
         the finger, in the file's own coordinates and unit",
        place(nearest_mm)
    )]
    Tip {
        /// How far.
        away_mm: f64,
        /// Nearest point of the surface.
        nearest_mm: [f64; 3],
    },
    /// `--axis` points out of the finger, or nowhere.
    #[error("--axis {axis:?} {why}: it goes from the tip along the finger towards the hand")]
    Axis {
        /// As given.
        axis: [f64; 3],
        /// What is wrong with it.
        why: &'static str,
    },
    /// A hand.
    #[error(
        "the surface is {across_mm:.0} mm wide across the axis, near {}: it looks like a whole hand, or a finger \
         that is bent. Cut out the last phalanx with a mesh editor, or correct --axis. If it is a fingertip, \
         --unit is not the unit of the file",
        place(at_mm)
    )]
    Hand {
        /// Width.
        across_mm: f64,
        /// A place that is far from the axis.
        at_mm: [f64; 3],
    },
    /// Too short to be a fingertip.
    #[error(
        "only {length_mm:.1} mm of the finger are there behind the tip, {least_mm:.0} mm are the least: scan more of \
         it{}",
        open_mm.as_ref().map_or_else(String::new, |p| format!(
            ", or close the surface where its open end comes nearest to the tip, at {}", place(p)
        ))
    )]
    Short {
        /// From the tip to the cut.
        length_mm: f64,
        /// What is needed.
        least_mm: f64,
        /// Where the open end comes nearest to the tip; none if the surface is closed there.
        open_mm: Option<[f64; 3]>,
    },
    /// Nail and pad cannot be told apart.
    #[error(
        "nail and pad cannot be told apart: with the nail on one side the template fits to {one_mm:.3} mm, on the \
         other to {other_mm:.3} mm (root of the mean square). Say where the nail looks: --nail x,y,z"
    )]
    NailSide {
        /// Better fit.
        one_mm: f64,
        /// The other one.
        other_mm: f64,
    },
    /// Not a fingertip.
    #[error(
        "the template of a fingertip does not fit this surface: {rms_mm:.2} mm are left (root of the mean square, \
         {most_mm} mm is the most), worst at u = {:.2}, v = {:.2}: {worst_mm:+.2} mm at {} of the finger's frame. Check \
         --tip, --axis and --nail", uv[0], uv[1], place(at_mm)
    )]
    Misfit {
        /// Root of the mean square.
        rms_mm: f64,
        /// What is accepted.
        most_mm: f64,
        /// Worst place.
        uv: [f64; 2],
        /// Its distance.
        worst_mm: f64,
        /// The place.
        at_mm: [f64; 3],
    },
    /// A bone that is not where a bone is.
    #[error(
        "the bone's surface reaches {out_mm:.2} mm out of the skin at {} of the finger's frame: it has to be in \
         the same frame and unit as the finger's",
        place(at_mm)
    )]
    BoneOutside {
        /// How far.
        out_mm: f64,
        /// The place.
        at_mm: [f64; 3],
    },
    /// A nail that is not where a nail is.
    #[error(
        "the nail's surface is not on the back of the finger at {} of the finger's frame, where it may be {most_mm} mm \
         from the skin at most: it has to be in the same frame and unit as the finger's, and --nail has to point \
         out of it",
        place(at_mm)
    )]
    NailElsewhere {
        /// The place.
        at_mm: [f64; 3],
        /// How far it may be from the skin.
        most_mm: f64,
    },
    /// The finger that came out makes no sense.
    #[error("the fitted finger cannot be used: {0}")]
    Finger(#[from] FingerError),
    /// Its elements are folded.
    #[error("the fitted finger cannot be meshed: {0}")]
    Mesh(#[from] FingertipShapeError),
    /// No distance can be taken from it.
    #[error("the surface cannot be measured: {0}")]
    Surface(#[from] papilla_sdf::MeshError),
    /// A picture could not be made.
    #[error(transparent)]
    Output(#[from] papilla_output::OutputError),
}

/// A place in words.
fn place(p: &[f64; 3]) -> String {
    format!("({:.1}, {:.1}, {:.1}) mm", p[0], p[1], p[2])
}
