//! What a step found against what it was to find.

use anyhow::{Result, bail, ensure};
use papilla_client::{Answer, Status};
use papilla_proto::{ErrorEstimate, MAP_SIDE_PX, Problem};
use serde_json::{Value, json};

fn near(what: &str, found: f64, due: f64, tolerance: f64) -> Result<()> {
    // Not `off > tolerance`: NaN must fail.
    ensure!((found - due).abs() <= tolerance, "{what} is {found}, {due} +- {tolerance} is due");
    Ok(())
}

/// Compares a number with a pair of value and tolerance.
pub(crate) fn check_pair(what: &str, found: f64, pair: &Value) -> Result<()> {
    let number = |i: usize| pair[i].as_f64().unwrap_or(f64::NAN);
    near(what, found, number(0), number(1))
}

pub(crate) fn check_list(what: &str, found: &[f32], due: &Value) -> Result<()> {
    let due = due.as_array().map(Vec::as_slice).unwrap_or_default();
    ensure!(found.len() == due.len(), "{what}: {} values, {} are due", found.len(), due.len());
    for (i, (&found, due)) in found.iter().zip(due).enumerate() {
        check_pair(&format!("{what} {i}"), f64::from(found), due)?;
    }
    Ok(())
}

/// Compares how wrong an answer says that it may be: what is `null` is infinite.
fn check_errors(expect: &Value, answer: &Answer) -> Result<()> {
    let Some(due) = expect["error_estimate"].as_array() else { return Ok(()) };
    let ErrorEstimate { sed, force } = answer.error_estimate;
    let found = [sed.median, sed.p90, force.median, force.p90];
    ensure!(due.len() == found.len(), "{} errors are due", due.len());
    for (i, (found, due)) in found.into_iter().zip(due).enumerate() {
        let what = format!("error_estimate {i}");
        match due {
            Value::Null => ensure!(found == f32::INFINITY, "{what} is {found}, infinity is due"),
            pair => check_pair(&what, f64::from(found), pair)?,
        }
    }
    Ok(())
}

pub(crate) fn check_map(expect: &Value, map: &[f32]) -> Result<()> {
    for pixel in expect["pixels"].as_array().into_iter().flatten() {
        let at = |i: usize| pixel[i].as_u64().unwrap_or(u64::MAX) as usize;
        let number = |i: usize| pixel[i].as_f64().unwrap_or(f64::NAN);
        let found = map.get(at(0) * MAP_SIDE_PX + at(1)).copied().unwrap_or(f32::NAN);
        near(&format!("pixel {}, {}", at(0), at(1)), f64::from(found), number(2), number(3))?;
    }
    if let Some(due) = expect.get("sum") {
        check_pair("the sum", map.iter().copied().map(f64::from).sum(), due)?;
    }
    if let Some(due) = expect.get("max") {
        check_pair("the maximum", map.iter().copied().map(f64::from).fold(0.0, f64::max), due)?;
    }
    Ok(())
}

pub(crate) fn check_problem(expect: &Value, problem: &Problem) -> Result<()> {
    let code = problem.code.as_str();
    ensure!(expect["status"] == "error", "refused: {problem}");
    ensure!(expect["code"] == code, "the code is {code}, {} is due", expect["code"]);
    if let Some(due) = expect.get("field") {
        ensure!(*due == json!(problem.field), "the field is {:?}", problem.field);
    }
    Ok(())
}

pub(crate) fn check_answer(expect: &Value, answer: &Answer) -> Result<()> {
    let status = match &answer.status {
        Status::Ok => "ok",
        Status::Superseded { .. } => "superseded",
        Status::Late => "late",
        Status::Stale => "stale",
        Status::Error(problem) => return check_problem(expect, problem),
        Status::Lost => "lost",
    };
    let due = expect.get("status").and_then(Value::as_str).unwrap_or("ok");
    ensure!(status == due, "the status is {status}, {due} is due");
    if status != "ok" {
        return Ok(());
    }
    let parts = u64::from(answer.queue_us) + u64::from(answer.infer_us);
    ensure!(parts <= u64::from(answer.total_us), "parts take longer than the whole");
    if let Some(due) = expect.get("tier") {
        ensure!(*due == json!(answer.tier), "the tier is {}", answer.tier);
    }
    if let Some(due) = expect["flags"].as_array() {
        let found = [
            ("out_of_range", answer.out_of_range),
            ("no_contact", answer.no_contact),
            ("unfamiliar", answer.unfamiliar),
            ("cut_off", answer.cut_off),
            ("not_tracked", answer.not_tracked),
            ("coarse_clock", answer.coarse_clock),
        ];
        for (name, is_set) in found {
            ensure!(is_set == due.contains(&json!(name)), "the flag {name} is {is_set}");
        }
    }
    if let Some(due) = expect.get("window") {
        let w = answer.window;
        ensure!(*due == json!([w.x, w.y, w.width, w.height]), "the window is {w:?}");
    }
    if expect.get("map") == Some(&json!(false)) {
        ensure!(answer.map.is_empty(), "the answer carries a map");
    } else {
        check_map(expect, &answer.map)?;
    }
    if let Some(due) = expect.get("summary") {
        let Some(summary) = &answer.summary else { bail!("there is no summary") };
        let bytes = summary.encode();
        let values: Vec<f32> =
            bytes.as_chunks().0.iter().map(|four| f32::from_le_bytes(*four)).collect();
        check_list("summary", &values, due)?;
    }
    match expect.get("rates") {
        Some(due) => check_map(due, answer.rates_hz()?)?,
        None => ensure!(answer.rates_hz().is_err(), "the answer carries rates"),
    }
    for (name, found) in [
        ("points", &answer.points),
        ("point_rates", &answer.point_rates_hz),
        ("actuators", &answer.actuators),
    ] {
        if let Some(due) = expect.get(name) {
            check_list(name, found, due)?;
        }
    }
    check_errors(expect, answer)
}

pub(crate) fn check_touch(expect: &Value, answer: &Answer, finger: u8) -> Result<()> {
    if let Status::Error(problem) = &answer.status {
        return check_problem(expect, problem);
    }
    ensure!(expect["status"] != "error", "the frame is not refused");
    ensure!(answer.is_ok() && answer.finger == finger, "{answer:?}");
    let Some(touch) = answer.touch else { bail!("the answer carries no touch") };
    let all = touch.encode();
    let numbers: Vec<f32> = all.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect();
    check_list("touch", &numbers[..15], &expect["touch"])?;
    if let Some(due) = expect.get("pressure_sum") {
        check_pair("the pressure", answer.pressure_pa.iter().map(|p| f64::from(*p)).sum(), due)?;
    }
    let flags: Vec<&str> = [("no_contact", answer.no_contact), ("not_tracked", answer.not_tracked)]
        .into_iter()
        .filter_map(|(name, on)| on.then_some(name))
        .collect();
    ensure!(expect["flags"] == json!(flags), "flags are {flags:?}");
    ensure!(!answer.out_of_range && !answer.unsettled, "{answer:?}");
    check_errors(expect, answer)
}
