//! What a scene is going to simulate and cost, before it runs.

use super::doubts;
use crate::forecast::{Forecast, SedError, better};
use crate::scene::effects::{EFFECTS, Effect};
use crate::scene::{Geometry, Output, Plan, Pressure, Scene};
use crate::simulation::Simulation;
use crate::simulation::body::SimulationError;
use crate::simulation::drive::Drive;
use serde::Serialize;
use std::path::PathBuf;
use std::time::Instant;

/// How a scene asks for the mesh that [`better`] gives.
pub const BETTER: &str = "with density = \"medium\", order = \"graded\" (the defaults)";

/// An effect that is simulated.
#[derive(Serialize)]
struct On {
    effect: &'static str,
    adds: &'static str,
    /// What it makes the solver assemble or store.
    state: usize,
    state_is: &'static str,
}

/// An effect that is left out.
#[derive(Serialize)]
struct Off {
    effect: &'static str,
    instead: &'static str,
    why: String,
    /// 0: it costs nothing.
    state: usize,
}

/// What a scene is going to simulate and cost.
#[derive(Serialize)]
pub struct Explanation {
    file: PathBuf,
    geometry: String,
    indenter: String,
    /// What was done to its meshes to make bodies of them.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    mended: Vec<String>,
    motion: String,
    /// What may be a mistake.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    doubts: Vec<String>,
    /// Written by `solve` beside `summary.json`.
    outputs: Vec<Output>,
    plan: Plan,
    simulated: Vec<On>,
    left_out: Vec<Off>,
    /// Mesh, pattern and symbolic factorization, measured; a solve does them too.
    setup_s: f64,
    forecast: Forecast,
    /// Error of SED at the interface on this mesh, relative L2, and where it was measured; absent for
    /// what is no fingertip.
    #[serde(skip_serializing_if = "Option::is_none")]
    sed_error: Option<(SedError, &'static str)>,
    /// The mesh to take instead; absent if this one's SED is good.
    #[serde(skip_serializing_if = "Option::is_none")]
    better_mesh: Option<BetterMesh>,
}

/// A mesh on which SED is known to be good, and what the scene costs there.
#[derive(Serialize)]
struct BetterMesh {
    geometry: Geometry,
    sed_error: Option<(SedError, &'static str)>,
    /// On one core.
    seconds: f64,
}

impl BetterMesh {
    /// `None` if the scene's mesh is good, or the scene cannot be meshed so.
    fn of(scene: &Scene) -> Option<Self> {
        let geometry = better(&scene.geometry)?;
        let other = Scene { geometry: geometry.clone(), ..scene.clone() };
        other.validate().ok()?;
        let setup = Simulation::new(&other).ok()?;
        let seconds = Forecast::new(&other, &setup).seconds.total;
        Some(Self { sed_error: SedError::of(&geometry), geometry, seconds })
    }
}

impl Explanation {
    /// Of a scene, which is set up for it; nothing is solved.
    ///
    /// # Errors
    /// As [`Simulation::new`].
    pub fn of(scene: &Scene) -> Result<Self, SimulationError> {
        let clock = Instant::now();
        let setup = Simulation::new(scene)?;
        let setup_s = clock.elapsed().as_secs_f64();
        let doubts = doubts(scene, &setup)?;
        let forecast = Forecast::new(scene, &setup);
        let state = |e: &Effect| (e.state)(&forecast.census);
        let (on, off): (Vec<_>, Vec<_>) = EFFECTS.into_iter().partition(|e| scene.has(e.name));
        let simulated = on.into_iter().map(|e| On {
            effect: e.name,
            adds: e.adds,
            state: state(e),
            state_is: e.state_is,
        });
        let left_out = off.into_iter().map(|e| Off {
            effect: e.name,
            instead: e.without,
            why: why_not(e, scene),
            state: state(e),
        });
        Ok(Self {
            file: scene.origin.path().to_owned(),
            geometry: table(&scene.geometry, "kind"),
            indenter: match &scene.pressure {
                Some(pressure) => pressed(pressure),
                None => table(&scene.indenter, "shape"),
            },
            mended: setup.approach.shape.mended(),
            motion: motion(scene, &setup.drive),
            doubts,
            outputs: Output::ALL.into_iter().filter(|&o| scene.writes(o)).collect(),
            simulated: simulated.chain(tension(&setup)).collect(),
            left_out: left_out.collect(),
            plan: setup.plan,
            setup_s,
            forecast,
            sed_error: SedError::of(&scene.geometry),
            better_mesh: BetterMesh::of(scene),
        })
    }

    /// The same for people.
    #[must_use]
    pub fn human(&self) -> String {
        let e = self;
        let mut text = format!(
            "{}\n  geometry  {}\n  indenter  {}{}\n  motion    {}\n  writes    {}\n\nsimulated\n",
            e.file.display(),
            e.geometry,
            e.indenter,
            e.mended.iter().map(|done| format!("\n            {done}")).collect::<String>(),
            e.motion,
            std::iter::once("summary")
                .chain(e.outputs.iter().map(|o| o.as_str()))
                .collect::<Vec<_>>()
                .join(", "),
        );
        for on in &e.simulated {
            text += &format!("  {:14} {} ({} {})\n", on.effect, on.adds, on.state, on.state_is);
        }
        text += "left out\n";
        for off in &e.left_out {
            text += &format!("  {:14} {} ({})\n", off.effect, off.instead, off.why);
        }
        let (f, c) = (&e.forecast, &e.forecast.census);
        let mib = |bytes: usize| bytes as f64 / f64::from(1 << 20);
        text += &format!(
            "\nunknowns       {}, {} elements, {} quadrature points, {} contact nodes\n\
             tangent        {} entries; factor {} entries, {:.1} Gflop\n\
             memory         {:.0} MiB; {:.0} more if a tangent is indefinite\n\
             work           about {:.0} equilibria, {:.0} Newton iterations, {:.0} factorizations\n",
            c.unknowns,
            c.elements,
            c.points,
            c.contact_nodes,
            c.tangent_entries,
            f.factor_entries,
            f.factor_flops / 1e9,
            mib(f.memory_bytes),
            mib(f.memory_indefinite_bytes),
            f.work.equilibria,
            f.work.newton_iterations,
            f.work.factorizations,
        );
        let s = &f.seconds;
        text += &format!(
            "seconds        about {:.1} on one core (elements {:.1}, factorization {:.1}, linear \
             solves {:.1}), after {:.1} of set-up",
            s.total, s.assembly, s.factorization, s.linear_solves, e.setup_s
        );
        if let Some((error, source)) = e.sed_error {
            text += &format!("\nerror of SED   {} ({source})", error.words());
        }
        if let Some(better) = &e.better_mesh {
            let words = better.sed_error.map_or_else(String::new, |(error, _)| error.words());
            text +=
                &format!("\n               {BETTER}: {words}, in about {:.1} s", better.seconds);
        }
        for doubt in &e.doubts {
            text += &format!("\ndoubt          {doubt}");
        }
        text
    }
}

/// The skin's tension, if it has one: materials give it, no effect.
fn tension(setup: &Simulation) -> Option<On> {
    let tension = setup.body.problem.tension.as_ref()?;
    Some(On {
        effect: "skin tension",
        adds: "skin that is stretched at rest, by materials.skin_tension_n_per_mm",
        state: tension.len(),
        state_is: "faces",
    })
}

/// Why an effect is left out, and what naming it would take.
fn why_not(effect: &Effect, scene: &Scene) -> String {
    let missing: Vec<_> = effect.needs.iter().filter(|n| !scene.has(n)).copied().collect();
    match (effect.fits)(scene) {
        Err(cannot) => format!("not named, nor possible as the scene stands: {cannot}"),
        Ok(()) if missing.is_empty() => "not named in effects".into(),
        Ok(()) => format!("not named in effects; it needs {} too", missing.join(", ")),
    }
}

/// A table of the scene in one line: its kind, then what is a number or a name.
fn table(table: &impl Serialize, kind: &str) -> String {
    // What was read from a file can be written.
    let value = serde_json::to_value(table).unwrap_or_default();
    let mut text = value[kind].as_str().unwrap_or_default().to_owned();
    for (key, value) in value.as_object().into_iter().flatten().filter(|(key, _)| *key != kind) {
        let tables = value.as_array().filter(|a| a.iter().any(serde_json::Value::is_object));
        match (value, tables) {
            (serde_json::Value::Object(_) | serde_json::Value::Null, _) => {}
            (_, Some(tables)) => text += &format!(", {} {key}", tables.len()),
            (serde_json::Value::String(name), _) => text += &format!(", {key} {name}"),
            _ => text += &format!(", {key} {value}"),
        }
    }
    text
}

/// What presses in place of an indenter.
fn pressed(pressure: &Pressure) -> String {
    match &pressure.file {
        Some(file) => format!("none; pressure of {}", file.display()),
        None => "none; pressure of a map that the program gave".into(),
    }
}

fn motion(scene: &Scene, drive: &Drive) -> String {
    let m = &scene.motion;
    let states = drive.len();
    if scene.pressure.is_some() {
        return format!("none; {states} stored shares of the pressure");
    }
    let to = match (m.depth_mm, m.force_n, &m.path) {
        (Some(depth), _, _) => format!("to {depth} mm"),
        (_, Some(force), _) => format!("to {force} N"),
        (_, _, Some(path)) => {
            format!("along {} points in {} s", path.len(), path.last().map_or(0.0, |p| p.time_s))
        }
        (None, None, None) => "nowhere".into(),
    };
    let [pitch, roll, yaw] = [m.pitch_deg, m.roll_deg, m.yaw_deg];
    format!("{to}, {states} stored states; pitch {pitch}, roll {roll}, yaw {yaw} degrees")
}
