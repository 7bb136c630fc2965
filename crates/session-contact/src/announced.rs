//! Objects and fingers as a hello announces them: read and checked.

use papilla_contact::{FRICTION_MAX, Object, Person};
use papilla_proto::{
    Hello, Problem, RuntimeEffect, SampleType, Warning,
    contact::{AnnouncedFinger, AnnouncedObject, FINGERS_MAX, Input, OBJECTS_MAX, SampleLayout},
    sdf::Placement,
};

use super::{Skin, unusable};

/// Most triangles and heights of all shapes of a session: some 10 MB.
const SIZE_MAX: usize = 32_768;
/// Most that the shapes of a session cost, in distances of a sphere: with more a frame would take
/// some tenths of a second.
const COST_MAX: f64 = 512.0;
/// Where an object is before its first pose: beyond all reach, mm.
const AWAY_MM: f64 = 9e4;

/// Whether the members go together.
pub(crate) fn check_members(hello: &Hello, input: Input) -> Result<(), Problem> {
    let of_solve = [
        (hello.method.is_some(), "method"),
        (hello.force_target.is_some(), "force_target"),
        (hello.stiffness.is_some(), "stiffness"),
        (hello.pressure.is_some(), "pressure"),
        (hello.shear.is_some(), "shear"),
        (hello.displacement.is_some(), "displacement"),
    ];
    if let (Input::Pressure, Some((_, member))) = (input, of_solve.iter().find(|(there, _)| *there))
    {
        let message = format!("'{member}' is of input 'objects' or 'gaps'");
        return Err(unusable(*member, message));
    }
    if input == Input::Objects && hello.input_layout.is_some() {
        return Err(unusable("input_layout", "objects have no layout: each has one pose"));
    }
    check_friction_of_gaps(hello, input)?;
    check_traction(hello, input)?;
    let exact = match input {
        Input::Pressure => true,
        Input::Objects => hello.sample_type == SampleType::F32,
        Input::Gaps => matches!(hello.sample_type, SampleType::F32 | SampleType::F16),
    };
    if !exact {
        let message = "poses are f32, gaps f32 or f16; 'answer_sample_type' says what answers are";
        return Err(unusable("sample_type", message));
    }
    Ok(())
}

/// Whether what gaps tell of rubs, and how it moves.
fn check_friction_of_gaps(hello: &Hello, input: Input) -> Result<(), Problem> {
    let of_gaps = [(hello.friction.is_some(), "friction"), (hello.velocity.is_some(), "velocity")];
    if let (true, Some((_, member))) = (input != Input::Gaps, of_gaps.iter().find(|(on, _)| *on)) {
        let message = format!("'{member}' is of input 'gaps'; each object has its own friction");
        return Err(unusable(*member, message));
    }
    if let Some(friction) = hello.friction {
        require_friction(friction, "friction".to_owned())?;
    }
    if hello.velocity == Some(true) {
        if layout(hello) == SampleLayout::Map {
            return Err(unusable("velocity", "'velocity' needs the 'input_layout' \"vertices\""));
        }
        if !hello.friction.is_some_and(|f| f > 0.0) {
            return Err(unusable("velocity", "without 'friction' no motion changes anything"));
        }
    }
    Ok(())
}

fn require_friction(value: f64, field: String) -> Result<(), Problem> {
    if (0.0..=FRICTION_MAX).contains(&value) {
        return Ok(());
    }
    let message = format!("{value}; a coefficient of friction is 0 to {FRICTION_MAX}");
    Err(unusable(field, message))
}

/// Whether traction can come with pressure.
fn check_traction(hello: &Hello, input: Input) -> Result<(), Problem> {
    if hello.traction != Some(true) {
        return Ok(());
    }
    if input != Input::Pressure || layout(hello) == SampleLayout::Map {
        let message = "'traction' is of input 'pressure' with \"input_layout\": \"vertices\"";
        return Err(unusable("traction", message));
    }
    if !matches!(hello.sample_type, SampleType::F32 | SampleType::F16) {
        return Err(unusable("sample_type", "traction has a sign: with it frames are f32 or f16"));
    }
    Ok(())
}

/// Whether contact has to find friction.
pub(crate) fn has_friction(hello: &Hello) -> bool {
    hello.shear == Some(true) || hello.has_traction()
}

/// The objects, each as far away as can be, and what is to be asked about them; worked out for as
/// long as `go_on` says so.
pub(crate) fn objects(
    hello: &Hello,
    input: Input,
    go_on: &dyn Fn() -> bool,
) -> Result<(Vec<Object>, Vec<Warning>), Problem> {
    let list = match (&hello.objects, input) {
        (Some(list), Input::Objects) => list,
        (None, Input::Objects) => {
            return Err(unusable("objects", "the input 'objects' needs the member 'objects'"));
        }
        (Some(_), _) => return Err(unusable("objects", "'input' has to be 'objects' with them")),
        (None, _) => return Ok((Vec::new(), Vec::new())),
    };
    if !(1..=OBJECTS_MAX).contains(&list.len()) {
        let message = format!("{} objects; announce 1 to {OBJECTS_MAX}", list.len());
        return Err(unusable("objects", message));
    }
    let size: usize = list.iter().map(|object| object.shape.size()).sum();
    if size > SIZE_MAX {
        let message = format!("{size} triangles and heights in all; {SIZE_MAX} at most");
        return Err(unusable("objects", message));
    }
    let mut warnings = Vec::new();
    let object = |(index, announced): (usize, &AnnouncedObject)| {
        let field = format!("objects[{index}].shape");
        let shape = announced.shape.build_until(&field, go_on);
        let shape = shape.map_err(|error| unusable(&field, error.to_string()))?;
        if let Some((member, value)) = announced.shape.tiny(shape.as_ref()) {
            warnings.push(tiny(format!("{field}.{member}"), member, value));
        }
        warnings.extend(shape.mended().into_iter().map(|done| Warning {
            member: field.clone(),
            value: None,
            question: format!("{done}; is this the body that is meant?"),
        }));
        let stiffness_mpa_per_mm = announced.stiffness_mpa_per_mm.unwrap_or(f64::INFINITY);
        if !(stiffness_mpa_per_mm > 0.0) {
            let message = format!("{stiffness_mpa_per_mm} MPa/mm; a stiffness is positive");
            let field = format!("objects[{index}].stiffness_mpa_per_mm");
            return Err(unusable(field, message));
        }
        let friction = announced.friction.unwrap_or(0.0);
        require_friction(friction, format!("objects[{index}].friction"))?;
        let mut placement = Placement::turned(0.0, 0.0, 0.0, [0.0; 3]);
        placement.origin_mm[2] = -AWAY_MM;
        Ok(Object { shape, placement, stiffness_mpa_per_mm, friction })
    };
    let objects = list.iter().enumerate().map(object).collect::<Result<Vec<_>, Problem>>()?;
    check_cost(&objects)?;
    Ok((objects, warnings))
}

/// Says that SED leaves out what pulls along the skin, where it could be taken into account.
pub(crate) fn traction_without_sed(hello: &Hello, skin: Skin<'_>) -> Option<Warning> {
    let names = |effect: RuntimeEffect| hello.effects.iter().any(|name| name == effect.as_str());
    // Traction has no creep: the two effects go not together.
    let has_choice = !names(RuntimeEffect::ShearEnergy) && !names(RuntimeEffect::Relaxation);
    let shows_sed = hello.map != Some(false) || !hello.effects.is_empty();
    if !hello.has_traction() || !has_choice || !shows_sed || skin.interface.is_none() {
        return None;
    }
    let question = "SED is that of the pressure alone: the forces along the skin are left out of it. With a \
                    coefficient of friction of .5 the error of SED against finite elements is then 1.6 \
                    times as large (median). Was 'shear_energy' meant to be among the 'effects'?";
    Some(Warning { member: "effects".to_owned(), value: None, question: question.to_owned() })
}

/// Whether the shapes are not too slow together.
fn check_cost(objects: &[Object]) -> Result<(), Problem> {
    let costs = || objects.iter().map(|object| object.shape.cost());
    let total: f64 = costs().sum();
    if total <= COST_MAX {
        return Ok(());
    }
    let (worst, most) = costs().enumerate().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or_default();
    let message = format!(
        "a distance from all shapes costs as much as {total:.0} of a sphere, objects[{worst}] alone \
         {most:.0}; {COST_MAX} at most: announce fewer objects, unions with fewer parts in one place, \
         or meshes whose triangles are fewer or less slender"
    );
    Err(unusable(format!("objects[{worst}].shape"), message))
}

/// Asks whether metres were meant.
fn tiny(member: String, of: &str, value: f64) -> Warning {
    let what =
        if of == "heights_mm" { "the heights differ by" } else { "the whole object measures" };
    let question = format!("{what} {value} mm; lengths are in mm, was m meant?");
    Warning { member, value: Some(value), question }
}

/// The factors of each finger.
pub(crate) fn persons(hello: &Hello) -> Result<Vec<Person>, Problem> {
    let default = [AnnouncedFinger::default()];
    let list = hello.fingers.as_deref().unwrap_or(&default);
    if !(1..=FINGERS_MAX).contains(&list.len()) {
        let message = format!("{} fingers; announce 1 to {FINGERS_MAX}", list.len());
        return Err(unusable("fingers", message));
    }
    let person = |(index, finger): (usize, &AnnouncedFinger)| {
        let &AnnouncedFinger { width, stiffness, .. } = finger;
        for (member, value) in [("width", width), ("stiffness", stiffness)] {
            if !(0.25..=4.0).contains(&value) {
                let message = format!("{value} is no factor of a finger; 0.25 to 4 are taken");
                return Err(unusable(format!("fingers[{index}].{member}"), message));
            }
        }
        Ok(Person { width, stiffness })
    };
    list.iter().enumerate().map(person).collect()
}

/// A problem of the finger of this number: its message says which, where the hello names it.
#[must_use]
pub fn of_finger(hello: &Hello, number: usize, problem: Problem) -> Problem {
    let named = hello.fingers.as_ref().and_then(|fingers| fingers.get(number)?.name.as_ref());
    match named {
        Some(name) => {
            let message = format!("finger '{name}' (fingers[{number}]): {}", problem.message);
            Problem { message, ..problem }
        }
        None => problem,
    }
}

/// Two fingers whose samples at vertices are not as many.
pub(crate) fn other_vertices(
    hello: &Hello,
    number: usize,
    [first, other]: [Skin<'_>; 2],
) -> Problem {
    let [first, other] = [first, other].map(|skin| skin.atlas.vertex_count());
    let message = format!(
        "its atlas has {other} vertices, that of fingers[0] {first}, and samples at vertices were \
         asked for: ask for the layout \"map\", or open a session for each of these fingers"
    );
    of_finger(hello, number, unusable(format!("fingers[{number}].name"), message))
}

/// Where samples are.
pub(crate) fn layout(hello: &Hello) -> SampleLayout {
    hello.input_layout.unwrap_or_default()
}
