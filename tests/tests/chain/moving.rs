//! Sessions that go on elsewhere when the service asks for it, behind a balancer.

use std::{fs, net::SocketAddr, path::Path, sync::Arc};

use clap::Parser;
use papilla_client::{Frame, Session, Status};
use papilla_proto::{Hello, MAP_LEN, MAP_SIDE_PX, Resumption, Window};
use papilla_server::{Config, Server};
use papilla_tests::load::{self, Options};
use tokio::{
    io::copy_bidirectional,
    net::{TcpListener, TcpStream},
    sync::watch,
};

use crate::{scene::PRESSED, service::tiny_models};

/// Hands each new connection to the service that is named when it comes.
struct Balancer {
    address: String,
    to: Arc<watch::Sender<SocketAddr>>,
}

impl Balancer {
    async fn start(to: SocketAddr) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let address = listener.local_addr().unwrap().to_string();
        let to = Arc::new(watch::Sender::new(to));
        let now = Arc::clone(&to);
        tokio::spawn(async move {
            loop {
                let (mut near, _) = listener.accept().await.unwrap();
                let to = *now.borrow();
                tokio::spawn(async move {
                    let Ok(mut far) = TcpStream::connect(to).await else { return };
                    for stream in [&near, &far] {
                        stream.set_nodelay(true).unwrap();
                    }
                    let _ = copy_bidirectional(&mut near, &mut far).await;
                });
            }
        });
        Self { address, to }
    }
}

async fn service(models: &Path, reconnect_after_s: u64) -> Server {
    let keys = models.join("state.keys");
    fs::write(&keys, "a7".repeat(32)).unwrap();
    let config = Config {
        models: Some(models.to_owned()),
        calibration_ms: 1,
        reconnect_after_s,
        state_keys: Some(keys),
        ..Config::default()
    };
    papilla_server::start(&config).await.unwrap()
}

/// A press that moves and breathes, Pa.
fn press(step: u32) -> Vec<f32> {
    let at = |i: usize| [i % MAP_SIDE_PX, i / MAP_SIDE_PX].map(|k| k as f32 - 112.0);
    let height = 2000.0 * (1.2 + (0.8 * step as f32).sin());
    let pressure = |[x, y]: [f32; 2]| height * (1.0 - (x * x + y * y) / 900.0).max(0.0);
    (0..MAP_LEN).map(|i| pressure(at(i))).collect()
}

async fn render(session: &Session, step: u32) -> Vec<f32> {
    let pressure_pa = press(step);
    let frame = Frame {
        pressure_pa: &pressure_pa,
        window: Window::WHOLE,
        client_time_us: Some(11_111 * u64::from(step)),
        deadline_us: 0,
    };
    let answer = session.render(frame).await.unwrap();
    assert_eq!(answer.status, Status::Ok, "frame {step}");
    answer.map
}

#[tokio::test(flavor = "multi_thread")]
async fn a_client_leaves_a_draining_service_without_a_lost_frame() {
    let models = tiny_models(&PRESSED.atlas, &PRESSED.samples()[1]);
    let (one, other) = (service(models.path(), 0).await, service(models.path(), 0).await);
    let balancer = Balancer::start(one.address()).await;
    let hello = || Hello { effects: vec!["relaxation".to_owned()], ..Hello::default() };
    let moves = Session::open(&balancer.address, hello()).await.unwrap();
    let stays = Session::open(&other.address().to_string(), hello()).await.unwrap();
    let mut opened = moves.connections();
    for step in 1..=5 {
        assert!(render(&moves, step).await == render(&stays, step).await, "frame {step}");
    }
    balancer.to.send_replace(other.address());
    let draining = tokio::spawn(one.drain());
    let mut step = 5;
    while *opened.borrow_and_update() == 1 || step < 12 {
        step += 1;
        assert!(render(&moves, step).await == render(&stays, step).await, "frame {step}");
    }
    // It is gone as soon as nobody needs it.
    draining.await.unwrap().unwrap();
    assert_eq!(moves.ready().state, Some(Resumption::Resumed));
    step += 1;
    assert!(render(&moves, step).await == render(&stays, step).await, "frame {step}");
    assert_eq!(*opened.borrow(), 2);
}

#[tokio::test(flavor = "multi_thread")]
async fn load_follows_and_every_frame_is_answered() {
    let models = tiny_models(&PRESSED.atlas, &PRESSED.samples()[1]);
    let one = service(models.path(), 1).await;
    let address = one.address().to_string();
    let arguments = ["papilla-load", "--server", &address, "--follow", "--sessions", "2"];
    let more = ["--rate-hz", "20", "--duration-s", "4", "--drain-s", "60", "--budget-us", "0"];
    let options = Options::try_parse_from([&arguments[..], &more].concat()).unwrap();
    let report = load::run(&options).await.unwrap();
    assert_eq!(report.faults(), Vec::<String>::new(), "{report}");
    assert_eq!(report.ok + report.superseded, report.frames, "{report}");
    // Each is asked after two thirds to four thirds of a second.
    assert!(report.held_us.unwrap().count >= 4 && report.reopened == 0, "{report}");
    assert!(report.gap_us.is_some(), "{report}");
}
