//! The indentations: from a plate to a dot of Braille.

use papilla_fingertip::scene::{Motion, Pose};
use papilla_sdf::IndenterSpec;

/// One indentation of the default finger.
#[derive(Clone, Copy, Debug)]
pub struct Case {
    /// Its name on the command line.
    pub name: &'static str,
    /// What presses.
    pub about: &'static str,
    indenter: &'static str,
    depth_mm: f64,
    yaw_deg: f64,
}

/// Every case. All come tilted by 10 degrees tip first and 5 sideways, and narrow ones across the
/// lattice of the mesh, so that no line of nodes lies under a line of contact by chance.
pub const CASES: [Case; 8] = [
    Case {
        name: "plate",
        about: "plate of 20 x 20 mm",
        indenter: "shape = 'plate'\nsize_mm = [20.0, 20.0]\nedge_radius_mm = 1.0",
        depth_mm: 1.5,
        yaw_deg: 0.0,
    },
    Case {
        name: "ball",
        about: "ball of radius 6 mm",
        indenter: "shape = 'sphere'\nradius_mm = 6.0",
        depth_mm: 1.5,
        yaw_deg: 0.0,
    },
    Case {
        name: "bar-2",
        about: "bar of radius 2 mm",
        indenter: "shape = 'cylinder'\nradius_mm = 2.0\nlength_mm = 30.0\nend_radius_mm = 1.0",
        depth_mm: 1.2,
        yaw_deg: 30.0,
    },
    Case {
        name: "bar-1",
        about: "bar of radius 1 mm",
        indenter: "shape = 'cylinder'\nradius_mm = 1.0\nlength_mm = 30.0\nend_radius_mm = 0.5",
        depth_mm: 1.0,
        yaw_deg: 60.0,
    },
    Case {
        name: "punch-4",
        about: "punch of radius 4 mm, rim of .5 mm",
        indenter: "shape = 'punch'\nradius_mm = 4.0\nrim_radius_mm = 0.5\nheight_mm = 8.0",
        depth_mm: 1.2,
        yaw_deg: 0.0,
    },
    Case {
        name: "punch-2",
        about: "punch of radius 2 mm, rim of .5 mm",
        indenter: "shape = 'punch'\nradius_mm = 2.0\nrim_radius_mm = 0.5\nheight_mm = 8.0",
        depth_mm: 1.0,
        yaw_deg: 0.0,
    },
    Case {
        name: "edge",
        about: "ruler 1 mm thick with edges of .2 mm",
        indenter: "shape = 'plate'\nsize_mm = [1.0, 20.0]\nedge_radius_mm = 0.2",
        depth_mm: 0.8,
        yaw_deg: 20.0,
    },
    Case {
        name: "dot",
        about: "dot of Braille: base 1.6 mm, height .5 mm, on a plate",
        indenter: "shape = 'dots'\ncount = [1, 1]\npitch_mm = 5.0\nbase_mm = 1.6\nheight_mm = 0.5\n\
                   plate_mm = [20.0, 20.0]",
        depth_mm: 0.8,
        yaw_deg: 0.0,
    },
];

impl Case {
    /// The indenter.
    ///
    /// # Errors
    /// What is wrong with its description.
    pub fn indenter(&self) -> Result<IndenterSpec, toml::de::Error> {
        toml::from_str(self.indenter)
    }

    /// The motion, with `states` stored.
    #[must_use]
    pub fn motion(&self, states: usize) -> Motion {
        let pose = Pose { pitch_deg: 10.0, roll_deg: 5.0, yaw_deg: self.yaw_deg };
        Motion::to_depth(self.depth_mm, states, pose)
    }
}
