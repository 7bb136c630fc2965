//! The steps of a case.

use std::{
    env,
    time::{Duration, Instant},
};

use anyhow::{Context, Result, bail, ensure};
use papilla_client::frames::{Convention, Place};
use papilla_client::{
    Address, Contact, Frame, NetForce, PapillaError, Session, Skin, Status, atlas, sed,
};
use papilla_proto::{Hello, MAP_LEN, MAP_SIDE_PX, Window, atlas::Patch, contact::Pose};
use papilla_tests::{
    conformance::{
        depth,
        inputs::{self, Pressure, Vertices},
    },
    http::Request,
};
use serde::de::DeserializeOwned;
use serde_json::Value;
use tokio::{task::spawn_blocking, time};

use crate::checks::{check_answer, check_list, check_map, check_pair, check_problem, check_touch};

/// One case.
pub(crate) struct Run {
    server: String,
    pub(crate) patience: Duration,
    session: Option<Session>,
    /// Connections at the last move.
    moved: u64,
    /// For people.
    pub(crate) note: String,
}

pub(crate) fn member<T: DeserializeOwned>(step: &Value, name: &str) -> Result<T> {
    serde_json::from_value(step[name].clone()).with_context(|| name.to_owned())
}

pub(crate) async fn control(action: &str) -> Result<()> {
    let address = env::var("PAPILLA_CONTROL").context("PAPILLA_CONTROL")?;
    let address = address.trim_start_matches("http://");
    let answer = Request::post(&format!("/{action}"), Vec::new()).send(address).await?;
    ensure!(answer.status == 200, "the control refuses {action}");
    Ok(())
}

/// The pose, if it is the one due: its place within some micrometres, its quaternion up to the sign.
fn check_pose(engine: &str, found: Pose, due: Pose) -> Result<Pose> {
    let off = found.origin_mm.iter().zip(due.origin_mm).map(|(f, d)| (f - d).abs());
    let dot: f32 = found.quaternion.iter().zip(due.quaternion).map(|(f, d)| f * d).sum();
    let is_there = off.fold(0.0, f32::max) < 2e-3 && dot.abs() > 1.0 - 1e-6;
    ensure!(is_there, "{engine}: the object is at {found:?}, not {due:?}");
    Ok(found)
}

impl Run {
    pub(crate) fn new(timeout_s: f64) -> Result<Self> {
        let url = env::var("PAPILLA_URL").context("PAPILLA_URL")?;
        let patience = Duration::from_secs_f64(timeout_s);
        Ok(Self { server: url, patience, session: None, moved: 1, note: String::new() })
    }

    pub(crate) async fn step(&mut self, step: &Value) -> Result<()> {
        match step["do"].as_str().unwrap_or_default() {
            "address" => address(step).await,
            "token" => token(step),
            "silence" => self.silence(step).await,
            "hello" => self.hello(step).await,
            "frame" => self.frame(step).await,
            "burst" => self.burst(step).await,
            "reconnect" => self.reconnect(step).await,
            "move" => self.moved(step).await,
            "stay" => self.stayed(step).await,
            "http" => self.post(step).await,
            "rasterise" => self.rasterise(step).await,
            "contacts" => self.contacts(step).await,
            "touch" | "gaps" => self.touch(step).await,
            other => bail!("there is no step {other}"),
        }
    }

    pub(crate) fn session(&self) -> Result<&Session> {
        self.session.as_ref().context("no session is open")
    }

    async fn hello(&mut self, step: &Value) -> Result<()> {
        let hello: Hello = member(step, "hello")?;
        let opened = match &self.session {
            Some(session) => session.renew(hello).await.map(|_| None),
            None => Session::open(&self.server, hello).await.map(Some),
        };
        match opened {
            Err(PapillaError::Refused(problem)) => return check_problem(&step["expect"], &problem),
            Err(error) => return Err(error.into()),
            Ok(Some(session)) => {
                session.set_timeout(self.patience);
                self.session = Some(session);
            }
            Ok(None) => {}
        }
        ensure!(step["expect"]["status"] != "error", "the hello is not refused");
        for words in member::<Option<Vec<String>>>(&step["expect"], "warnings")?.unwrap_or_default()
        {
            self.told(&words)?;
        }
        let ready = serde_json::to_value(&*self.session()?.ready())?;
        for (name, due) in step["expect"]["ready"].as_object().into_iter().flatten() {
            ensure!(ready[name] == *due, "ready.{name} is {}, {due} is due", ready[name]);
        }
        Ok(())
    }

    async fn frame(&self, step: &Value) -> Result<()> {
        let map: Vec<f32> = member::<Pressure>(step, "pressure")?.draw(1.0, None);
        let window = match member::<Option<[u16; 4]>>(step, "window")? {
            Some([x, y, width, height]) => Window { x, y, width, height },
            None => Window::WHOLE,
        };
        let [x, y, width, height] =
            [window.x, window.y, window.width, window.height].map(usize::from);
        let at = |row: usize, column: usize| {
            let inside = row < MAP_SIDE_PX && column < MAP_SIDE_PX;
            if inside { map[row * MAP_SIDE_PX + column] } else { 0.0 }
        };
        let samples: Vec<f32> = (y..y + height)
            .flat_map(|row| (x..x + width).map(move |column| (row, column)))
            .map(|(r, c)| at(r, c))
            .collect();
        let client_time_us: Option<u64> = member(step, "client_time_us")?;
        let deadline_us = member::<Option<u32>>(step, "deadline_us")?.unwrap_or(0);
        let frame = Frame { pressure_pa: &samples, window, client_time_us, deadline_us };
        for attempt in (0..member::<Option<u32>>(step, "attempts")?.unwrap_or(1)).rev() {
            let answer = time::timeout(self.patience, self.session()?.render(frame)).await??;
            if answer.status == Status::Lost && attempt > 0 {
                continue;
            }
            let same = client_time_us.is_none_or(|time_us| time_us == answer.client_time_us);
            ensure!(same, "another client time comes back");
            return check_answer(&step["expect"], &answer);
        }
        bail!("no attempt")
    }

    async fn touch(&self, step: &Value) -> Result<()> {
        let finger = member::<Option<u8>>(step, "finger")?.unwrap_or(0);
        let net = member::<Option<[f32; 4]>>(step, "net")?;
        let net = net.map(|[x, y, z, force_n]| NetForce { direction: [x, y, z], force_n });
        let session = self.session()?;
        let outcome = if step["do"] == "gaps" {
            let (server, sphere) = (self.server.clone(), member(step, "sphere")?);
            let atlas = spawn_blocking(move || atlas(&server)).await??;
            let places = &atlas.patch(Patch::Skin).positions_mm;
            let mut depths: Vec<f32> = places.iter().map(|p| depth(*p, sphere)).collect();
            if let Some(velocity) = member::<Option<[f32; 3]>>(step, "velocity")? {
                depths.extend(places.iter().flat_map(|_| velocity));
            }
            session.send_gaps(finger, &depths, net)?
        } else {
            let pose = |[x, y, z, a, b, c, d]: [f32; 7]| Pose {
                origin_mm: [x, y, z],
                quaternion: [a, b, c, d],
            };
            let poses: Option<Vec<[f32; 7]>> = member(step, "poses")?;
            match poses {
                Some(poses) => {
                    let poses: Vec<Pose> = poses.into_iter().map(pose).collect();
                    if step["engines"].is_object() {
                        return self.placed(step, &poses).await;
                    }
                    session.send_poses(finger, &poses, net)?
                }
                None => session.send_not_tracked(finger)?,
            }
        };
        let answer = time::timeout(self.patience, outcome).await??;
        check_touch(&step["expect"], &answer, finger)
    }

    /// The objects where each engine says that they are.
    async fn placed(&self, step: &Value, due: &[Pose]) -> Result<()> {
        let engines = [
            ("right_handed", Convention::METRES, None),
            ("openxr", Convention::OPENXR, None),
            ("godot", Convention::OPENXR, Some([0.0, 0.0, -1.0])),
            ("unity", Convention::UNITY, None),
            ("unreal", Convention::UNREAL, None),
        ];
        ensure!(step["engines"].as_object().map(serde_json::Map::len) == Some(engines.len()));
        let place = |of: &Value| -> Result<Place> {
            let [x, y, z, a, b, c, d]: [f64; 7] = serde_json::from_value(of.clone())?;
            Ok(Place { at: [x, y, z], turn: [a, b, c, d] })
        };
        for (name, convention, up) in engines {
            let said = &step["engines"][name];
            let finger = place(&said["finger"])?;
            let mut poses = Vec::new();
            for (object, due) in said["objects"].as_array().context("objects")?.iter().zip(due) {
                let object = place(object)?;
                poses.push(check_pose(name, convention.pose(finger, object, 1.0)?, *due)?);
                if let Some(joints) = said.get("joints") {
                    let (distal, tip) = (place(&joints["distal"])?, place(&joints["tip"])?);
                    let inside_mm: f64 = member(joints, "inside_mm")?;
                    let tracked = convention.finger_of_joints(distal, tip, up, inside_mm)?;
                    check_pose(name, convention.pose(tracked, object, 1.0)?, *due)?;
                }
            }
            let outcome = self.session()?.send_poses(0, &poses, None)?;
            let answer = time::timeout(self.patience, outcome).await??;
            check_touch(&step["expect"], &answer, 0)?;
            let felt = convention.felt(finger, &answer.touch.context("no touch")?, 1.0)?;
            let wanted = &step["expect"]["engines"][name];
            for (member, found) in [
                ("force_n", felt.force_n),
                ("torque_n_m", felt.torque_n_m),
                ("centre", felt.centre),
            ] {
                check_list(member, &found.map(|v| v as f32), &wanted[member])?;
            }
        }
        Ok(())
    }

    async fn reconnect(&mut self, step: &Value) -> Result<()> {
        let mut opened = self.session()?.connections();
        let before = *opened.borrow_and_update();
        control("restart").await?;
        let begin = Instant::now();
        let within = Duration::from_secs_f64(member(step, "within_s")?);
        time::timeout(within, opened.wait_for(|opened| *opened > before)).await??;
        let seconds = begin.elapsed().as_secs_f64();
        self.note = format!(" (connected {seconds:.2} s after the server was back)");
        Ok(())
    }

    fn told(&self, words: &str) -> Result<()> {
        let told = self.session()?.warnings();
        ensure!(told.iter().any(|each| each.contains(words)), "{words}: {told:?}");
        Ok(())
    }

    /// The service stops, or dies, while frames wait for it.
    async fn silence(&self, step: &Value) -> Result<()> {
        let (session, how) = (self.session()?, member::<String>(step, "how")?);
        let map: Vec<f32> = member::<Pressure>(step, "pressure")?.draw(1.0, None);
        time::timeout(self.patience, session.render(&map)).await??;
        session.set_timeout(Duration::from_millis(member(step, "timeout_ms")?));
        let mut opened = session.connections();
        let before = *opened.borrow_and_update();
        control(&how).await?;
        let mut sent = Vec::new();
        for _ in 0..member::<usize>(step, "count")? {
            sent.push(session.send(&map)?);
            time::sleep(Duration::from_millis(50)).await;
        }
        let mut statuses = Vec::new();
        for outcome in sent {
            statuses.push(time::timeout(self.patience, outcome).await??.status);
        }
        let is_lost = statuses.last() == Some(&Status::Lost);
        let is_due = |s: &Status| matches!(s, Status::Lost | Status::Superseded { .. });
        ensure!(is_lost && statuses.iter().all(is_due), "{statuses:?}");
        self.told("no answer within")?;
        control(if how == "pause" { "resume" } else { "start" }).await?;
        session.set_timeout(self.patience);
        let within = Duration::from_secs_f64(member(step, "within_s")?);
        time::timeout(within, opened.wait_for(|opened| *opened > before)).await??;
        Ok(())
    }

    async fn moved(&mut self, step: &Value) -> Result<()> {
        let mut opened = self.session()?.connections();
        let within = Duration::from_secs_f64(member(step, "within_s")?);
        // It may have moved between the steps.
        let before = self.moved;
        let moved = opened.wait_for(|opened| *opened > before);
        self.moved = *time::timeout(within, moved).await??;
        Ok(())
    }

    /// It was asked to move and could not, and says why.
    async fn stayed(&self, step: &Value) -> Result<()> {
        let (session, says) = (self.session()?, member::<String>(step, "says")?);
        let within = Duration::from_secs_f64(member(step, "within_s")?);
        let told = async {
            while self.told(&says).is_err() {
                time::sleep(Duration::from_millis(5)).await;
            }
        };
        time::timeout(within, told).await.with_context(|| format!("it does not say {says}"))?;
        ensure!(*session.connections().borrow() == self.moved, "it has moved");
        Ok(())
    }

    async fn post(&self, step: &Value) -> Result<()> {
        let (server, tier) = (self.server.clone(), member::<String>(step, "tier")?);
        let map = member::<Pressure>(step, "pressure")?.draw(1.0, None);
        match spawn_blocking(move || sed(&server, &map, Some(&tier))).await? {
            Err(PapillaError::Refused(problem)) => check_problem(&step["expect"], &problem),
            Err(error) => Err(error.into()),
            Ok(rendered) => {
                ensure!(step["expect"]["status"] == "ok", "the request is not refused");
                ensure!(step["expect"]["tier"] == rendered.tier, "the tier is {}", rendered.tier);
                check_map(&step["expect"], &rendered.sed_j_per_m3)
            }
        }
    }

    async fn rasterise(&self, step: &Value) -> Result<()> {
        let server = self.server.clone();
        let atlas = spawn_blocking(move || atlas(&server)).await??;
        let vertices: Vertices = member(step, "vertices")?;
        let values = vertices.values(&atlas.patch(Patch::Skin).positions_mm);
        let mut map = vec![0.0; MAP_LEN];
        Skin::new(&atlas).rasterise(&values, &mut map)?;
        check_map(&step["expect"], &map)
    }

    async fn contacts(&self, step: &Value) -> Result<()> {
        let server = self.server.clone();
        let skin = Skin::new(&spawn_blocking(move || atlas(&server)).await??);
        let contacts: Vec<inputs::Contact> = member(step, "contacts")?;
        let contact = |c: &inputs::Contact| match c.radius_mm {
            Some(radius_mm) => Contact { at_mm: c.at_mm, force_n: c.force_n, radius_mm },
            None => Contact::flat(c.at_mm, c.force_n),
        };
        let map_pa = skin.contacts(&contacts.iter().map(contact).collect::<Vec<_>>());
        if let Some(due) = step["expect"].get("force_n") {
            check_pair("the force", skin.force_n(&map_pa), due)?;
        }
        check_map(&step["expect"], &map_pa)
    }
}

async fn address(step: &Value) -> Result<()> {
    let text: String = member(step, "address")?;
    let expect = &step["expect"];
    if expect["status"] != "error" {
        let address: Address = text.parse()?;
        let found = [address.session(), address.http("/v1/atlas")];
        let same = expect["session"] == found[0] && expect["http"] == found[1];
        ensure!(same, "{text}: {found:?}");
        return Ok(());
    }
    let get = text.clone();
    let got = spawn_blocking(move || get_of(&get)).await?;
    for refused in [Session::open(&text, Hello::default()).await.err(), got] {
        let error = refused.with_context(|| format!("{text} is taken"))?;
        let says = error.to_string().contains(expect["says"].as_str().unwrap_or_default());
        let is_it = matches!(error, PapillaError::Address { .. });
        ensure!(is_it && says && expect["code"] == "bad_address", "{error}");
    }
    Ok(())
}

fn get_of(server: &str) -> Option<PapillaError> {
    papilla_client::get(server, "/v1/atlas").err()
}

fn token(step: &Value) -> Result<()> {
    let (token, expect) = (member::<String>(step, "token")?, &step["expect"]);
    let address: Address = "lab.example".parse()?;
    match address.clone().with_token(&token) {
        Ok(found) => {
            let due = address.with_token(&member::<String>(expect, "token")?)?;
            ensure!(found == due && !format!("{found:?}").contains(&token), "another token");
        }
        Err(PapillaError::Token) => ensure!(expect["code"] == "bad_token", "it is refused"),
        Err(error) => return Err(error.into()),
    }
    Ok(())
}
