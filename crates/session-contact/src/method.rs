//! Which method finds the pressure: the one that the hello names, or else the most accurate one that
//! can serve it.

use papilla_contact::{Method, PixelSpacing};
use papilla_proto::{
    Hello, Problem, Warning,
    contact::{ContactErrors, ContactMethod, Input, MethodError, Spread},
};

use super::{Skin, announced, unusable};

/// What finds the pressure of a session's frames.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Chosen {
    pub(crate) method: ContactMethod,
    /// What the client is told where the hello names none and the most accurate method cannot
    /// serve it.
    pub(crate) warning: Option<Warning>,
}

impl Chosen {
    /// Of a hello whose members go together; none where frames are pressure.
    ///
    /// # Errors
    /// The method that the hello names cannot serve it.
    pub(crate) fn of(hello: &Hello, input: Input, skin: Skin<'_>) -> Result<Option<Self>, Problem> {
        if input == Input::Pressure {
            return Ok(None);
        }
        let obstacle = obstacle_to_pixels(input, skin);
        match (hello.method, obstacle) {
            (Some(method), Some(obstacle)) if method.is_on_pixels() => {
                let message = format!(
                    "{obstacle}, which '{method}' cannot serve; leave 'method' out, or name \
                     'second_order'"
                );
                Err(unusable("method", message))
            }
            (Some(ContactMethod::Springs), _) if announced::has_friction(hello) => {
                let message = "springs know neither friction nor 'shear'; leave 'method' out, or \
                               name 'second_order'";
                Err(unusable("method", message))
            }
            (Some(ContactMethod::Springs), _) if hello.displacement == Some(true) => {
                let message = "springs give way each by itself, so that they know no 'displacement' \
                               of the skin; leave 'method' out, or name 'second_order'";
                Err(unusable("method", message))
            }
            (Some(method), _) => Ok(Some(Self { method, warning: None })),
            (None, None) => Ok(Some(Self { method: ContactMethod::Pixels, warning: None })),
            (None, Some(obstacle)) => {
                let method = ContactMethod::SecondOrder;
                let warning = Some(warning(obstacle, method, skin.errors));
                Ok(Some(Self { method, warning }))
            }
        }
    }

    /// What solves at vertices.
    pub(crate) fn at_vertices(&self) -> Method {
        match self.method {
            ContactMethod::Springs => Method::Springs,
            ContactMethod::SmallStrain => Method::SmallStrain,
            ContactMethod::SecondOrder | ContactMethod::Pixels | ContactMethod::CoarsePixels => {
                Method::SecondOrder
            }
        }
    }

    /// Which pixels are solved for; none: vertices alone.
    pub(crate) fn pixel_spacing(&self) -> Option<PixelSpacing> {
        match self.method {
            ContactMethod::Springs | ContactMethod::SmallStrain | ContactMethod::SecondOrder => {
                None
            }
            ContactMethod::Pixels => Some(PixelSpacing::One),
            ContactMethod::CoarsePixels => Some(PixelSpacing::Two),
        }
    }
}

/// Why pixels cannot serve a hello; none if they can.
fn obstacle_to_pixels(input: Input, skin: Skin<'_>) -> Option<&'static str> {
    if input == Input::Gaps {
        Some("gaps say nothing of what lies between their places")
    } else if skin.model.is_some() && skin.pixels.is_none() {
        Some("this service's contact model names no layers of the skin")
    } else {
        None
    }
}

fn warning(obstacle: &str, method: ContactMethod, errors: Option<&ContactErrors>) -> Warning {
    let told = |method| errors.and_then(|errors| errors.of(method)).map(in_words);
    let costs = match (told(method), told(ContactMethod::Pixels)) {
        (Some(this), Some(pixels)) => {
            format!("against finite elements it is off by {this}; pixels by {pixels}")
        }
        _ => "it is less accurate than pixels, and nobody measured by how much with this finger"
            .to_owned(),
    };
    let question = format!("'{method}' finds the pressure, since {obstacle}: {costs}");
    Warning { member: "method".to_owned(), value: None, question }
}

/// Medians, in percent.
fn in_words(error: &MethodError) -> String {
    let percent = |Spread { median, .. }: Spread| format!("{:.0} %", 100.0 * median);
    let sed =
        error.sed_relative_l2.map_or_else(String::new, |of| format!("{} of SED, ", percent(of)));
    let pressure = percent(error.pressure_relative_l2);
    format!("{sed}{pressure} of pressure, {} of force", percent(error.force_relative))
}
