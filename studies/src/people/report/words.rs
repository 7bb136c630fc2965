//! What rows call their quantities, and what would mend them.

use crate::people::measured::Quantity;

/// What would bring rates nearer.
pub(super) const RATES_MEND: &str = "another stimulus, deeper and over a disc (table below), or a monkey's finger, which is smaller";

/// A quantity with its unit.
pub(crate) fn quantity(quantity: &Quantity) -> String {
    let plate = |pitch_deg: f64| match pitch_deg {
        0.0 => "flat plate".to_owned(),
        p => format!("plate at {p} degrees"),
    };
    match *quantity {
        Quantity::Stiffness { force_n, pitch_deg } => {
            format!("stiffness at {force_n} N, {}, N/mm", plate(pitch_deg))
        }
        Quantity::Stiffening { from_n, to_n, pitch_deg } => {
            format!("stiffness at {to_n} N over that at {from_n} N, {}", plate(pitch_deg))
        }
        Quantity::Exponential { to_n, pitch_deg } => {
            format!("R2 of a line through stiffness over force, to {to_n} N, {}", plate(pitch_deg))
        }
        Quantity::RelaxationTime { rank } => format!("relaxation time {rank}, s"),
        Quantity::PeakOverMean { force_n, pitch_deg } => {
            format!("peak over mean pressure at {force_n} N, {}", plate(pitch_deg))
        }
        Quantity::AreaRatio { from_n, to_n, pitch_deg } => {
            format!("contact area at {from_n} N over that at {to_n} N, {}", plate(pitch_deg))
        }
        Quantity::HertzModulus { force_n, pitch_deg } => {
            format!("Hertz' modulus at {force_n} N, {}, MPa", plate(pitch_deg))
        }
        Quantity::VolumeLost { to_n, pitch_deg } => {
            format!("largest loss of volume to {to_n} N, {}, %", plate(pitch_deg))
        }
        Quantity::EnergyLost { depth_mm, time_s } => {
            format!("energy lost in a tap of {depth_mm} mm, {:.0} ms down and up, %", 1e3 * time_s)
        }
        Quantity::EnergyOutside { force_n, shift_mm, .. } => {
            format!(
                "share of the skin's strain energy outside of contact, plate at {force_n} N moved by \
                 {shift_mm} mm"
            )
        }
        Quantity::ProfileTurn { curvature_per_m, turn_deg, .. } => {
            format!(
                "SA1 from SED at the interface: turn of the profile under a cylinder of \
                 {curvature_per_m} 1/m turned by {turn_deg} degrees, degrees"
            )
        }
        Quantity::ShearRatio { from_n, to_n } => {
            format!("vertical over horizontal shear of the epidermis from {from_n} to {to_n} N")
        }
    }
}

/// What would bring the finger's figure nearer.
pub(super) const fn mends(quantity: &Quantity) -> &'static str {
    match quantity {
        Quantity::Stiffness { .. }
        | Quantity::Stiffening { .. }
        | Quantity::Exponential { .. }
        | Quantity::AreaRatio { .. }
        | Quantity::HertzModulus { .. } => {
            "fat that stiffens as it is squeezed (an exponential law), or a skin under tension"
        }
        Quantity::RelaxationTime { .. } | Quantity::EnergyLost { .. } => {
            "Prony terms of 4 and 70 ms, of whose amplitudes the abstract says nothing"
        }
        Quantity::PeakOverMean { .. } => "tissue that stiffens as it is squeezed, or a finer mesh",
        Quantity::VolumeLost { .. } => "a Poisson's ratio nearer to 1/2",
        Quantity::EnergyOutside { .. } => {
            "another course of friction; the preprint's is not known here"
        }
        Quantity::ProfileTurn { .. } => "another pad: its curvatures turn the profile",
        Quantity::ShearRatio { .. } => "ridges: smooth skin stays flat on a plate",
    }
}
