//! Which dimension of a finger folds its mesh, and how far it may go.

use super::{Density, FingertipShapeError, Order, Parts, build, check_elements};
use crate::geometry::fingertip::FingertipShape;
use crate::mesh::quality;
use crate::tissue::Tissue;
use toml::{Table, Value};

/// Halvings of the way from the default to the value that folds the mesh.
const HALVINGS: u32 = 10;

/// What to say of a shape whose mesh has elements that are inside out.
pub(crate) fn blame(shape: &FingertipShape, parts: Parts) -> FingertipShapeError {
    if let Err(distorted @ FingertipShapeError::Distorted { .. }) = check_elements(shape)
        && (shape.offset.is_some() || shape.epidermis_map.is_some() || shape.dermis_map.is_some())
    {
        return distorted;
    }
    changed(shape)
        .into_iter()
        .find_map(|(field, index)| culprit(shape, parts, &field, index))
        .unwrap_or(FingertipShapeError::Inconsistent(
            "these dimensions fold the elements between skin and bone: change fewer of them at a time",
        ))
}

/// The numbers that differ from the default: their field, and which of a pair.
fn changed(shape: &FingertipShape) -> Vec<(String, Option<usize>)> {
    let (own, usual) = (table(shape), table(&FingertipShape::default()));
    let mut found = Vec::new();
    for (field, value) in own {
        match (value, &usual[&field]) {
            (Value::Array(own), Value::Array(usual)) => {
                let differ = (0..own.len()).filter(|&i| own[i] != usual[i]);
                found.extend(differ.map(|i| (field.clone(), Some(i))));
            }
            (own, usual) if own != *usual => found.push((field, None)),
            _ => {}
        }
    }
    found
}

/// The error that names `field`, if the mesh is sound with its default.
fn culprit(
    shape: &FingertipShape,
    parts: Parts,
    field: &str,
    index: Option<usize>,
) -> Option<FingertipShapeError> {
    let number = |shape: &FingertipShape| -> Option<f64> {
        let value = table(shape).remove(field)?;
        match index {
            Some(i) => value.as_array()?.get(i)?.as_float(),
            None => value.as_float(),
        }
    };
    let with = |value: f64| -> Option<FingertipShape> {
        let mut table = table(shape);
        let place = table.get_mut(field)?;
        match index {
            Some(i) => *place.as_array_mut()?.get_mut(i)? = Value::Float(value),
            None => *place = Value::Float(value),
        }
        let changed: FingertipShape = table.try_into().ok()?;
        let FingertipShape { offset, epidermis_map, dermis_map, .. } = shape.clone();
        Some(FingertipShape { offset, epidermis_map, dermis_map, ..changed })
    };
    let sound = |value: f64| with(value).is_some_and(|shape| is_sound(&shape, parts));
    let (value, usual) = (number(shape)?, number(&FingertipShape::default())?);
    if sound(value) || !sound(usual) {
        return None;
    }
    let (mut good, mut bad) = (usual, value);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (good + bad);
        *(if sound(middle) { &mut good } else { &mut bad }) = middle;
    }
    let field = index.map_or_else(|| field.to_owned(), |i| format!("{field}[{i}]"));
    Some(FingertipShapeError::Folds { field, value, limit: good, least: good > value })
}

fn table(shape: &FingertipShape) -> Table {
    Table::try_from(shape).unwrap_or_default()
}

/// Whether no element of the coarse even mesh is inside out.
fn is_sound(shape: &FingertipShape, parts: Parts) -> bool {
    build(shape, Density::Coarse, Order::Linear, parts, None).is_ok_and(|finger| {
        Tissue::ALL.iter().all(|t| quality::of(&finger.mesh, *t).scaled_jacobian_min > 0.0)
    })
}
