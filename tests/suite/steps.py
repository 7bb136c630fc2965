"""The parts of the suite: `./test --fast`, `./test` and, beside it, `./test --all`.

Commands run from the repository's root with TARGET (cargo's target folder), BIN (what the tests
build) and PAPILLA_SERVER set. One build serves all of them, with what is optional turned on.
"""

import os
import shutil
import subprocess
import sys
from dataclasses import replace

from needs import (
    AS_ROOT,
    install_packages,
    install_slurm,
    no_buildah,
    no_cmake,
    no_display,
    no_godot4,
    no_haproxy,
    no_musl,
    no_nightly,
    no_onnxruntime,
    no_prometheus,
    no_qemu,
    no_slurm,
    no_validator,
    onnxruntime,
    packages_missing,
    slurm_missing,
)
from schedule import LIMIT_S, Step


def lints() -> dict[str, str]:
    """What makes cargo compile the workspace's own crates with clippy, warnings as errors.

    A pass of `cargo clippy` would check every dependency once more.
    """
    command = ["rustc", "--print", "sysroot"]
    sysroot = subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()
    driver = os.path.join(sysroot, "bin", "clippy-driver")
    if not os.path.exists(driver):
        sys.exit(f"clippy is not here ({driver}): rustup component add clippy")
    # As `cargo clippy -- -D warnings` passes it on.
    return {"RUSTC_WORKSPACE_WRAPPER": driver, "CLIPPY_ARGS": "-D__CLIPPY_HACKERY__warnings"}


# Turned on in the build that the tests share: traces, and the examples of docs/reference/clients/rust.md.
FEATURES = "--features papilla-server/otlp,papilla-client/guide"
# Tests that take five seconds and more: verification, hard cases, presses of whole fingers, the
# cards of all models, random poses. `./test` runs them in a part of their own.
SLOW = [
    "every_quick_row",
    "every_hard_case",
    "simulation::tests",
    "friction_is_that_of_finite_elements",
    "a_shipped_press_can_be_solved_again",
    "a_plate_is_pressed_once",
    "recorded_scenes_are_found_again",
    "any_pose_of_any_shape_is_answered",
    "a_body_on_a_straight_way_never_pulls_and_never_fades_silently",
    "no_element_folds",
    "every_mesh_is_well_shaped",
    "a_stopped_indentation_goes_on_to_the_same_bits",
    "the_card_tells_the_truth",
    "every_frame_is_accounted_for",
    "any_pose_is_answered_on_pixels",
    "any_move_is_answered",
    "five_hundred_flipped_bits",
    "a_slice_of_a_million_is_a_slice",
    "a_scene_and_a_dataset_show_a_state_alike",
    "an_interrupted_solve_keeps_the_states_that_are_done",
    "a_slow_reader_is_waited_for",
    "an_overloaded_service_renders_the_newest_frames",
    "nobody_waits_for_the_hard_frames_of_others",
    "a_search_for_a_net_force_has_one_budget",
    "a_scan_becomes_a_finger_that_is_pressed",
]
def fast() -> list[Step]:
    """Rust alone."""
    return [
        Step("format", "rustfmt", "cargo fmt --all --check"),
        Step(
            "documents",
            "links, lines and figures of the documents; the crates' picture",
            "python3 tests/suite/documents_test.py\n"
            "python3 tests/suite/documents.py\n"
            "python3 tests/suite/figures.py\n"
            "python3 tests/suite/crates.py",
            tests_min=13,
        ),
        Step(
            "build",
            "everything that the tests run, with clippy; its warnings are errors",
            f"cargo build --workspace --all-targets {FEATURES}",
            after=("format",),
            installs="cargo: crates (35 MB)",
        ),
        Step(
            "rust",
            "unit, property, differential and end-to-end tests of less than some seconds",
            f"cargo test --no-fail-fast --workspace --all-targets {FEATURES} -q -- "
            + " ".join(f"--skip {name}" for name in SLOW),
            after=("build",),
            tests_min=740,
        ),
        Step(
            "cycles",
            "no module imports itself in a circle, of Rust or of Python",
            "python3 tests/suite/imports_test.py\ntests/suite/cycles",
            tests_min=1,
        ),
        Step(
            "features",
            "third-party crates are compiled once, whichever program is built",
            "tests/suite/features.py",
            after=("build",),
        ),
        Step(
            "doc",
            "examples in the crates' documentation",
            f"cargo test --workspace --doc {FEATURES} -q -- --skip clients/rust/src/lib.rs",
            after=("build",),
            behind=("rust",),
            tests_min=17,
        ),
        Step(
            "examples",
            "the examples of the Rust libraries run, and print what is known of their answers",
            "tests/examples/run",
            after=("build",),
            tests_min=8,
        ),
        Step(
            "data",
            "the committed datasets and models are whole",
            'for m in data/*/manifest.json; do "$BIN/fe-datagen" dataset verify "$(dirname "$m")"; done\n'
            'for m in models/*.onnx; do "$BIN/model-export" check "$m" --atlas models/atlas.json; done',
            after=("build",),
        ),
    ]


def installs() -> list[Step]:
    """What the other parts need; these run beside the build."""
    return [
        Step(
            "packages",
            "Debian packages: CalculiX, Chromium, Godot 3, Mono, QEMU, Xvfb",
            install_packages(),
            installs=f"apt: {packages_missing() or 'nothing'} (56 s where measured)",
        ),
        Step(
            "python",
            "Python environments for the trainer, the clients and third-party clients",
            "tests/suite/environment trainer model-export/trainer/requirements.txt\n"
            "tests/suite/environment interop tests/interop/requirements.txt\n"
            "tests/suite/environment clients clients/python/requirements.txt ./clients/python",
            installs="pip: torch with the CUDA libraries that it does not start without (2.4 GB; 113 s where "
            "measured, from an empty cache)",
        ),
        Step(
            "node",
            "npm packages of the page, the web client and the glTF test",
            "for d in tests/browser clients/web tests/gltf; do\n"
            '  (cd "$d" && npm ci --no-audit --no-fund --silent)\ndone',
            installs="npm: 60 MB; 8 s where measured",
        ),
    ]


def full() -> list[Step]:
    """The trainer, the clients, third-party programs and the page."""
    client = "clients/test"
    return [
        Step(
            "slow",
            "tests of seconds: verification rows, hard cases, presses of whole fingers, models' cards",
            f"cargo test --no-fail-fast --workspace --lib --tests {FEATURES} -q -- "
            + " ".join(SLOW),
            after=("build",),
            tests_min=23,
        ),
        Step(
            "trainer",
            "the trainer's style and tests",
            "cd model-export/trainer\n"
            '"$TARGET/venv-trainer/bin/python" -m ruff check .\n'
            'FE_DATAGEN="$BIN/fe-datagen" MODEL_EXPORT="$BIN/model-export" '
            '"$TARGET/venv-trainer/bin/python" -m pytest -q -p no:cacheprovider '
            "--ignore=tests/test_teach.py",
            after=("build", "python"),
            tests_min=80,
        ),
        Step(
            "interop",
            "tritonclient, Prometheus' parser, Grafana's schema and PromQL against the service",
            "tests/interop/run",
            after=("build", "python"),
            tests_min=14,
        ),
        Step(
            "alerts",
            "the alert rules fire, and every panel of the dashboard shows something, in Prometheus itself",
            "deploy/prometheus/test",
            after=("build",),
            missing=no_prometheus,
            installs="apt: prometheus, unpacked and not installed (19 MB)",
        ),
        Step(
            "processors",
            "networks and contact on processors without AVX2, emulated",
            "tests/processors/run",
            after=("build", "packages"),
            missing=no_qemu,
        ),
        Step(
            "onnxruntime",
            "the engine's tests and the service's golden answers in ONNX Runtime",
            f"export ORT_DYLIB_PATH={onnxruntime()}\n"
            f"cargo test --workspace --test infer --test shipped --test library --test onnxruntime "
            f"{FEATURES},papilla-tests/ort -q",
            after=("build", "python"),
            behind=("rust",),
            tests_min=23,
            missing=no_onnxruntime,
        ),
        Step("client-python", "the Python client", f"{client} python", ("build", "python"), 139),
        Step(
            "wheel",
            "Papilla's wheel for Python: in process as by the service, to the bit",
            f"{client} wheel",
            after=("build", "python"),
            tests_min=60,
            installs="pip: maturin, numpy, websockets, matplotlib, pytest (80 MB)",
        ),
        Step("client-cpp", "the C++ client", f"{client} cpp", ("build", "packages"), 33),
        Step("client-c", "the native library from C and C++", f"{client} c", ("build", "packages"), 20),
        Step("client-rust", "the Rust client", f"{client} rust", ("build", "packages"), 33, ("doc",)),
        Step("client-web", "the web client", f"{client} web", ("build", "node", "packages"), 39),
        Step("client-unity", "the C# client in Mono", f"{client} unity", ("build", "packages"), 80),
        Step("godot-generated", "the Godot 4 add-on is what its source makes", "clients/hello/generate --check\nclients/godot/generate --check"),
        Step("client-godot3", "the Godot 3 add-on", f"{client} godot3", ("build", "packages"), 33),
        Step(
            "godot3-picture",
            "the Godot 3 example, drawn by a software renderer and looked at",
            f"{client} godot3-picture",
            after=("build", "packages"),
            missing=no_display,
        ),
        Step(
            "client-godot4",
            "the Godot 4 add-on",
            f"{client} godot4",
            ("build", "packages"),
            33,
            missing=no_godot4,
        ),
        Step(
            "client-packages",
            "wheel, npm package, Unity, Godot and Unreal folders, installed and used from there",
            "clients/packages-test python npm unity addons",
            after=("build", "python", "node"),
            tests_min=4,
        ),
        Step(
            "client-cmake",
            "find_package(Papilla) and pkg-config, installed and used from there",
            "clients/packages-test cmake",
            after=("build",),
            tests_min=1,
            missing=no_cmake,
        ),
        Step("client-gltf", "the atlas as glTF", f"{client} gltf", ("build", "node"), 1),
        Step(
            "docs-clients",
            "the clients' pages as written",
            "clients/docs-test",
            ("client-rust", "client-python", "client-cpp", "client-c"),
        ),
        Step(
            "guides",
            "the guides' commands as written, on the smoke campaign",
            "tests/guides/run",
            after=("build", "python"),
        ),
        Step(
            "calculix",
            "the same presses in CalculiX",
            f"cargo test --workspace --test calculix {FEATURES} -q -- --ignored",
            after=("build", "packages"),
            behind=("doc",),
            tests_min=1,
        ),
        Step(
            "page",
            "the page in headless Chromium",
            # On a busy core the drawing alone takes minutes.
            "run='clients/conformance/run --only-serve --timeout-s 1500'\n"
            "$run --no-contact page npm --prefix tests/browser test --silent\n"
            "$run page npm --prefix tests/browser run contact --silent",
            after=("build", "node", "packages"),
            tests_min=80,
        ),
    ]


def long() -> list[Step]:
    """The long forms, beside `full`."""
    return [
        Step(
            "teach",
            "a finger of one's own is taught: from its file over presses to a network, interrupted on the way",
            "cd model-export/trainer\n"
            'FE_DATAGEN="$BIN/fe-datagen" MODEL_EXPORT="$BIN/model-export" '
            '"$TARGET/venv-trainer/bin/python" -m pytest -q -p no:cacheprovider tests/test_teach.py',
            after=("build", "python"),
            tests_min=4,
        ),
        Step(
            "release",
            "what `cargo run --release` builds, and a look at all it would serve",
            # As a user builds it: without clippy as the compiler.
            "env -u RUSTC_WORKSPACE_WRAPPER -u CLIPPY_ARGS cargo build --release\n"
            '"$TARGET/release/papilla-server" check',
            behind=("doc",),
        ),
        Step(
            "debian",
            "the Debian package, installed, started, upgraded and purged",
            "deploy/debian/test",
            behind=("release",),
            tests_min=32,
            missing=no_musl,
        ),
        Step(
            "container",
            "the image FROM scratch, built without root, and a map rendered in it",
            "deploy/container/test",
            behind=("debian",),
            tests_min=1,
            missing=no_buildah,
        ),
        Step(
            "archive",
            "the release archive, made twice, unpacked and used",
            "deploy/release/test",
            behind=("container",),
            tests_min=5,
            missing=no_musl,
        ),
        Step(
            "balancer-installs",
            "HAProxy and a validator of Kubernetes files, where they can be had",
            f"{AS_ROOT} command -v haproxy /usr/sbin/haproxy || "
            "as_root apt-get install -y -qq --no-install-recommends haproxy || true\n"
            "command -v nginx /usr/sbin/nginx || "
            "as_root apt-get install -y -qq --no-install-recommends nginx-light || true\n"
            "tests/suite/environment kubernetes deploy/kubernetes/requirements.txt || true",
            behind=("release",),
            installs="apt: haproxy, nginx-light; pip: kubernetes-validate (142 MB)",
        ),
        Step(
            "balancer",
            "HAProxy over three services, one drained every ten seconds, one killed; a service below a path",
            "env -u RUSTC_WORKSPACE_WRAPPER -u CLIPPY_ARGS cargo build --release -p papilla-tests --bins\n"
            'PATH="$PATH:/usr/sbin" tests/balancer/run\n'
            'PATH="$PATH:/usr/sbin" tests/balancer/path',
            after=("balancer-installs",),
            missing=no_haproxy,
        ),
        Step(
            "kubernetes",
            "deploy/kubernetes against the schemas of its resources",
            '"$TARGET/venv-kubernetes/bin/kubernetes-validate" --strict deploy/kubernetes/papilla.yaml',
            after=("balancer-installs",),
            missing=no_validator,
        ),
        Step(
            "rust-long",
            "tests marked long, every variant of every hard case among them",
            f"cargo test --workspace --all-targets {FEATURES} -q -- --ignored --skip started_by"
            " --skip calculix_agrees",
            after=("build",),
            behind=("doc",),
            tests_min=3,
        ),
        Step(
            "verify",
            "every verification row",
            '"$BIN/fe-datagen" verify',
            after=("build",),
            behind=("rust-long",),
        ),
        Step(
            "stability-long",
            "hard cases on finer meshes",
            '"$BIN/fe-datagen" stability --long',
            after=("build",),
            behind=("verify",),
        ),
        Step(
            "calculix-long",
            "every simulation in CalculiX",
            '"$BIN/papilla-studies" calculix',
            after=("build", "packages"),
            behind=("stability-long",),
        ),
        Step(
            "sanitizers",
            "the C++ client under the thread, address and undefined-behaviour sanitizers, the native library "
            "under the last two",
            "clients/test cpp-sanitizers c-sanitizers",
            after=("client-cpp", "client-c"),
            tests_min=54,
        ),
        Step(
            "mujoco",
            "friction in the loop with MuJoCo: a ball rests, a block is held for ten seconds, then slips",
            "clients/test mujoco",
            after=("wheel",),
            tests_min=5,
            installs="pip: mujoco (8 MB)",
        ),
        Step(
            "client-crates",
            "the Rust client and what it is built on, compiled from their packages",
            "env -u RUSTC_WORKSPACE_WRAPPER -u CLIPPY_ARGS clients/packages-test crates",
            behind=("doc",),
            tests_min=1,
        ),
        Step(
            "slurm",
            "a campaign on a Slurm cluster in namespaces: preemptions, a lost node, a full disk",
            f"{install_slurm()}\n{AS_ROOT} as_root env BIN=\"$BIN\" tests/slurm/run",
            after=("packages", "build"),
            tests_min=15,
            installs="apt: slurm-wlm munge" if slurm_missing() else "",
            missing=no_slurm,
        ),
        Step(
            "deny",
            "licences, sources, duplicates and advisories of all crates",
            "tests/suite/deny",
            behind=("doc",),
        ),
        Step(
            "mutations",
            "the short form fails for each of twelve mutations",
            "tests/mutations/run",
            after=("build", "python"),
            behind=("calculix-long",),
            tests_min=12,
            limit_s=4 * LIMIT_S,
        ),
        Step(
            "reconnects",
            "10 000 reconnects",
            f"PAPILLA_RECONNECTS=10000 cargo test --workspace --test service {FEATURES} -q -- clients_come",
            after=("build",),
            behind=("rust-long",),
            tests_min=1,
        ),
        Step(
            "fuzz",
            "every reader of outside bytes, ten minutes",
            "env -u RUSTC_WORKSPACE_WRAPPER -u CLIPPY_ARGS tests/fuzz/run",
            behind=("mutations",),
            missing=no_nightly,
        ),
    ]


def extent(name: str) -> list[Step]:
    """All steps of `fast`, `full` or `all`, in the order in which they are started."""
    form, documents, build, *checks = fast()
    if name == "fast":
        return fast()
    if shutil.which("c++") is None:
        # One of the crates compiles C++.
        build = replace(build, after=(*build.after, "packages"))
    steps = [form, documents, build, *installs(), *checks, *full()]
    return steps + long() if name == "all" else steps
