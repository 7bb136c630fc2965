//! The presses that a finger is taught with: a campaign in its folder.

use papilla_fingertip::campaign::{CampaignSpec, DepthRange};
use papilla_fingertip::geometry::fingertip::{
    FingertipShape, FingertipShapeError, SurfaceParameter,
};
use papilla_fingertip::scene::Finger;
use papilla_fingertip::scene::effects::add_needed;
use papilla_vector::{minus, norm};
use std::path::{Path, PathBuf};

/// The sequence, for the default finger.
const SEQUENCE: &str = include_str!("../../../../../campaigns/teach.toml");

/// How much larger a finger is than the default one.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Scale {
    /// Soft tissue below the middle of the pad.
    pulp: f64,
    /// Width of the thickest section.
    width: f64,
}

impl Scale {
    fn of(shape: &FingertipShape) -> Result<Self, FingertipShapeError> {
        let usual = Finger::usual().shape;
        let per_mille = |ratio: f64| (1e3 * ratio).round() / 1e3;
        Ok(Self {
            pulp: per_mille(pulp_mm(shape)? / pulp_mm(&usual)?),
            width: per_mille(shape.width_mm / usual.width_mm),
        })
    }
}

/// From skin to bone, below the middle of the pad, to a hundredth of a millimetre.
fn pulp_mm(shape: &FingertipShape) -> Result<f64, FingertipShapeError> {
    let bounds = shape.layers(SurfaceParameter::Body([0.0, -1.0], 0.0))?;
    Ok((100.0 * norm(minus(bounds[3], bounds[0]))).round() / 100.0)
}

/// What a finger is pressed with.
#[derive(Debug)]
pub(super) struct Sequence {
    /// The presses, for the default finger, with the effects that the finger's tissues were fitted with.
    template: CampaignSpec,
    scale: Scale,
}

impl Sequence {
    /// The presses of another campaign, or of `campaigns/teach.toml`, for a finger.
    pub(super) fn of(file: Option<&Path>, finger: &Finger) -> anyhow::Result<Self> {
        let mut template = match file {
            Some(file) => CampaignSpec::read(file),
            None => CampaignSpec::parse(Path::new("campaigns/teach.toml"), SEQUENCE),
        }?;
        add_needed(&mut template.effects, &finger.tissue);
        Ok(Self { template, scale: Scale::of(&finger.shape)? })
    }

    /// The text of the campaign in a finger's folder, `presses` long: depths in proportion to the pulp,
    /// offsets to the width. What lies in the finger's way has the size that it has.
    pub(super) fn text(&self, presses: usize) -> Result<String, toml::ser::Error> {
        let mut spec = self.template.clone();
        spec.presses = presses;
        spec.finger = Some(PathBuf::from(".."));
        spec.finger_sha256 = None;
        let hundredths = |mm: f64, by: f64| (100.0 * mm * by).round() / 100.0;
        let depths = |range: &mut Option<DepthRange>| {
            if let Some(range) = range {
                range.deepest_mm = range.deepest_mm.map(|mm| hundredths(mm, self.scale.pulp));
            }
        };
        let offsets = |ranges: &mut [[f64; 2]; 2]| {
            *ranges = ranges.map(|r| r.map(|mm| hundredths(mm, self.scale.width)));
        };
        depths(&mut spec.depths);
        spec.depths_mm.iter_mut().for_each(|mm| *mm = hundredths(*mm, self.scale.pulp));
        offsets(&mut spec.offset_mm);
        for candidate in &mut spec.indenters {
            depths(&mut candidate.depths);
            candidate.offset_mm.as_mut().map(offsets);
        }
        let head = "# Written by `fe-datagen finger teach`: its presses for the finger in the folder above.\n\
                    # More presses may be asked for later; those that are solved are kept.\n\n";
        Ok(head.to_owned() + &toml::to_string(&spec)?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use papilla_fingertip::campaign::{held_out, indentations};
    use papilla_fingertip::scene::MaterialSet;
    use std::collections::BTreeMap;

    fn usual() -> CampaignSpec {
        Sequence::of(None, &Finger::usual()).unwrap().template
    }

    fn campaigns() -> Vec<CampaignSpec> {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../campaigns");
        ["broad", "more", "pressed", "hard", "proximal"]
            .map(|name| CampaignSpec::read(&folder.join(format!("{name}-graded.toml"))).unwrap())
            .into()
    }

    /// Presses of each shape with its sizes, of all.
    fn of_each_shape<'a>(
        specs: impl IntoIterator<Item = &'a CampaignSpec>,
    ) -> BTreeMap<String, f64> {
        let mut found = BTreeMap::new();
        for spec in specs {
            let candidates = spec.candidates();
            for press in indentations(spec) {
                let shape = format!("{:?}", candidates[press.candidate].indenter);
                *found.entry(shape).or_default() += 1.0;
            }
        }
        let all: f64 = found.values().sum();
        found.into_iter().map(|(shape, count)| (shape, count / all)).collect()
    }

    #[test]
    fn shapes_come_as_often_as_in_the_campaigns_of_the_shipped_networks() {
        let due = of_each_shape(&campaigns());
        let found = of_each_shape([&CampaignSpec { presses: 1000, ..usual() }]);
        assert_eq!(found.keys().collect::<Vec<_>>(), due.keys().collect::<Vec<_>>());
        for (shape, part) in &due {
            assert!((found[shape] - part).abs() < 0.01, "{shape}: {} for {part}", found[shape]);
        }
    }

    #[test]
    fn every_beginning_is_a_good_set_and_lies_in_the_next() {
        let of = |presses| CampaignSpec { presses, ..usual() };
        let all = indentations(&of(100));
        let part = |presses: usize| {
            assert_eq!(indentations(&of(presses)), all[..presses]);
            let mut names: Vec<&str> = all[..presses].iter().map(|p| p.indenter.as_str()).collect();
            names.sort_unstable();
            names.dedup();
            (names.len(), held_out(&of(presses)))
        };
        // As many shapes as there is room for: none a third time before all others came.
        let (ten, split) = part(10);
        assert!(ten >= 9, "{ten} of the first ten are different");
        assert_eq!(split.test.len(), 2);
        let (more, wider) = part(25);
        assert!(more >= 16, "{more} of the first 25 are different");
        let (fifty, _) = part(50);
        assert_eq!(fifty, usual().candidates().len());
        let first = |ids: &[usize]| ids.iter().copied().filter(|id| *id < 10).collect::<Vec<_>>();
        assert_eq!([first(&wider.train), first(&wider.test)], [split.train, split.test]);
    }

    #[test]
    fn a_finger_is_pressed_in_proportion() {
        let scale = Scale::of(&Finger::usual().shape).unwrap();
        assert_eq!(scale, Scale { pulp: 1.0, width: 1.0 });
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("teach")).unwrap();
        let finger = Finger::usual().to_toml().replace("width_mm = 17.44", "width_mm = 13.08");
        std::fs::write(folder.path().join("finger.toml"), finger).unwrap();
        let path = folder.path().join("teach/campaign.toml");
        let finger = Finger::read(folder.path()).unwrap();
        let mut sequence = Sequence::of(None, &finger).unwrap();
        assert!((sequence.scale.width - 0.75).abs() < 1e-9);
        sequence.scale.pulp = 0.5;
        let read = CampaignSpec::parse(&path, &sequence.text(20).unwrap()).unwrap();
        assert_eq!((read.presses, read.test_one_in), (20, Some(5)));
        assert_eq!(read.shape, finger.shape);
        for (own, usual) in indentations(&read).iter().zip(indentations(&usual())) {
            assert_eq!((own.pose, &own.indenter), (usual.pose, &usual.indenter));
            let about = |a: f64, b: f64| (a - b).abs() < 0.011;
            assert!(about(own.deepest_mm(), 0.5 * usual.deepest_mm()));
            assert!((0..2).all(|i| about(own.offset_mm[i], 0.75 * usual.offset_mm[i])));
        }
    }

    #[test]
    fn a_finger_is_pressed_with_the_effects_that_its_tissues_were_fitted_with() {
        let people = Finger { tissue: MaterialSet::People.table(), ..Finger::usual() };
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("teach")).unwrap();
        std::fs::write(folder.path().join("finger.toml"), people.to_toml()).unwrap();
        let text = Sequence::of(None, &people).unwrap().text(5).unwrap();
        let read = CampaignSpec::parse(&folder.path().join("teach/campaign.toml"), &text).unwrap();
        let names: Vec<&str> = read.effects.iter().map(|e| e.as_str()).collect();
        assert_eq!(names, ["finite_strain", "layers", "hyperelastic"]);
        let usual = usual().effects;
        assert_eq!(usual.len(), 2, "those of the default finger are as they were");
    }
}
