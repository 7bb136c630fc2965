//! Hard cases of input: values in another unit than the scene asks for, which are refused.

use super::lab::scene;
use super::{Line, Suite};
use crate::verify::CaseError;

const FINGER: &str = "[geometry]\nkind = \"fingertip\"\ndensity = \"coarse\"\norder = \"linear\"\n";

pub(super) fn run(_: &Suite) -> Result<Vec<Line>, CaseError> {
    let with = |rest: &str| format!("{FINGER}[motion]\ndepth_mm = 1.0\n{rest}");
    let modulus = |tissue: &str, e: f64| {
        with(&format!("[materials.{tissue}]\nyoungs_modulus_mpa = {e:?}\npoissons_ratio = 0.4\n"))
    };
    let moved = |motion: &str| format!("{FINGER}[motion]\n{motion}\n");
    let shaped = |field: &str| with(&format!("[geometry.shape]\n{field}\n"));
    let cases = [
        ("dermis, Pa for MPa", modulus("dermis", 8e4), "was Pa meant?"),
        ("dermis, kPa for MPa", modulus("dermis", 80.0), "was kPa meant?"),
        ("dermis, GPa for MPa", modulus("dermis", 8e-5), "was GPa meant?"),
        ("fat, kPa for MPa", modulus("subcutaneous", 34.0), "was kPa meant?"),
        ("fat, GPa for MPa", modulus("subcutaneous", 3.4e-5), "was GPa meant?"),
        ("epidermis, Pa for MPa", modulus("epidermis", 1.36e5), "kPa meant?"),
        ("epidermis, GPa for MPa", modulus("epidermis", 1.36e-4), "was GPa meant?"),
        ("nail, kPa for MPa", modulus("nail", 1.7e5), "was kPa meant?"),
        ("nail, GPa for MPa", modulus("nail", 0.17), "was GPa meant?"),
        ("bone, kPa for MPa", modulus("bone", 1.7e7), "was kPa meant?"),
        ("bone, Pa for MPa", modulus("bone", 1.7e10), "was Pa meant?"),
        ("bone, GPa for MPa", modulus("bone", 17.0), "was GPa meant?"),
        ("depth in um", moved("depth_mm = 1000.0"), "at most 100 mm"),
        ("force in uN", moved("force_n = 1e6"), "at most 1000 N"),
        ("epidermis in um", shaped("epidermis_mm = 200.0"), "was um meant?"),
        ("finger in m", shaped("length_mm = 0.025"), "was m meant?"),
    ];
    let mut lines: Vec<_> = cases
        .into_iter()
        .map(|(variant, text, word)| Line::refused(variant, scene(&text).map(drop), &[word]))
        .collect();
    let ogden = with(
        "[materials.dermis]\nyoungs_modulus_mpa = 0.08\npoissons_ratio = 0.48\n\
         [materials.dermis.ogden]\nmu_mpa = [6.45e4]\nalpha = [2.0]\n",
    );
    lines.push(Line::refused("Ogden moduli in Pa", scene(&ogden).map(drop), &["was Pa meant?"]));
    Ok(lines)
}
