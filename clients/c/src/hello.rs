//! What a session asks for: the protocol's hello, as far as C has a form for it.

use papilla_inside::read_hello;
use papilla_proto::{ErrorCode, Hello, Problem, RuntimeEffect, SampleType};

/// Reads the text of a hello. Samples are C's floats.
pub(crate) fn read(text: &str) -> Result<Hello, Problem> {
    let hello = read_hello(text)?;
    let other = |sample_type: Option<SampleType>| sample_type.is_some_and(|t| t != SampleType::F32);
    for (is_other, member) in [
        (other(Some(hello.sample_type)), "sample_type"),
        (other(hello.answer_sample_type), "answer_sample_type"),
    ] {
        if is_other {
            return Err(Problem::new(ErrorCode::WrongType, "samples are f32 here").at(member));
        }
    }
    if hello.pressure_scale_pa.is_some() {
        let message = "'pressure_scale_pa' is of a service; nothing waits or travels here";
        return Err(Problem::new(ErrorCode::BadJson, message).at("pressure_scale_pa"));
    }
    if hello.shear == Some(true) {
        let message = "the library answers no shear at vertices; a touch has its force";
        return Err(Problem::new(ErrorCode::BadContact, message).at("shear"));
    }
    if hello.displacement == Some(true) {
        let message = "the library answers no displacement at vertices";
        return Err(Problem::new(ErrorCode::BadContact, message).at("displacement"));
    }
    // An answer of the library is lists of f32, which spikes are not.
    if hello.effects.iter().any(|e| e.parse() == Ok(RuntimeEffect::Spikes)) {
        let message = "the library answers no spikes; 'afferents' gives firing rates";
        return Err(Problem::new(ErrorCode::UnknownEffect, message).at("effects"));
    }
    Ok(hello)
}
