"""What is broken on purpose, and the part of the short form that has to fail for it."""

from dataclasses import dataclass

CARGO = "cargo test --workspace {targets} $FEATURES -q -- {filter}"
TRAINER = (
    'cd model-export/trainer && "$TARGET/venv-trainer/bin/python" -m pytest -q -x '
    '-p no:cacheprovider {tests}'
)


@dataclass(frozen=True)
class Mutation:
    """`old` becomes `new` in `file`; `command` has to fail then, and to pass without."""

    what: str
    file: str
    old: str
    new: str
    command: str


def rust(targets: str, name_filter: str = "") -> str:
    return CARGO.format(targets=targets, filter=name_filter)


MUTATIONS = [
    Mutation(
        "a sign in the tangent of the neo-Hookean law",
        "crates/solid/src/neo_hookean.rs",
        "+ c29 * g[b][a]",
        "- c29 * g[b][a]",
        rust("--test verify"),
    ),
    Mutation(
        "SED from the wrong side of the interface",
        "crates/fem/src/mesh/recovery/mod.rs",
        "let owner = element_on_side(mesh, region);",
        "let owner = element_on_side(mesh, Region(1 - region.0.min(1)));",
        rust("--test mesh", "recovery::"),
    ),
    Mutation(
        "contact that leaves half of its curvature out of the tangent",
        "crates/fem/src/contact/mod.rs",
        "penalty * n[i] * n[j] - t * d.hessian[i][j]",
        "penalty * n[i] * n[j] - 0.5 * t * d.hessian[i][j]",
        rust("--test verify"),
    ),
    Mutation(
        "friction that sticks up to twice its bound",
        "crates/fem/src/contact/friction.rs",
        "if size <= s {",
        "if size <= 2.0 * s {",
        rust("--lib", "contact::friction::"),
    ),
    Mutation(
        "a frame that came while another was rendered is lost",
        "server/src/core/scheduler/slot.rs",
        "state.scheduled = state.waiting.is_some();\n        state.scheduled",
        "state.scheduled = false;\n        state.scheduled",
        rust("--lib", "scheduler::"),
    ),
    Mutation(
        "windows one row too low",
        "proto/src/window.rs",
        "let start = row * MAP_SIDE_PX;",
        "let start = (row + 1).min(MAP_SIDE_PX - 1) * MAP_SIDE_PX;",
        "cargo test -p papilla-proto -q window",
    ),
    Mutation(
        "u16 samples with the scale of u8",
        "proto/src/sample/mod.rs",
        "*value = f32::from(u16::from_le_bytes([b[0], b[1]])) * scale;",
        "*value = f32::from(u16::from_le_bytes([b[0], b[1]])) * scale * 257.0;",
        "cargo test -p papilla-proto -q sample",
    ),
    Mutation(
        "a sparse map that drops each row's last term",
        "crates/engine/src/sparse/map.rs",
        "let degree = rows().map(Iterator::count).max().unwrap_or(0);",
        "let degree = rows().map(Iterator::count).max().unwrap_or(0).max(2) - 1;",
        rust("--lib", "sparse"),
    ),
    Mutation(
        "a debugging macro left in the code",
        "proto/src/window.rs",
        "let start = row * MAP_SIDE_PX;",
        "let start = dbg!(row * MAP_SIDE_PX);",
        "cargo build -p papilla-proto",
    ),
    Mutation(
        "a loss that forgets the far field",
        "model-export/trainer/papilla_trainer/losses.py",
        "whole + far_weight * distant",
        "whole",
        TRAINER.format(tests="tests/test_map_training.py"),
    ),
    Mutation(
        "answers whose window has column and row swapped, in the Python client",
        "clients/python/papilla/wire.py",
        "(column, row, width, height),\n        client_time_us, total_us",
        "(row, column, width, height),\n        client_time_us, total_us",
        # As clients/test runs it, but on this checkout's package.
        "PYTHONPATH=clients/python clients/conformance/run python "
        '"$TARGET/venv-clients/bin/python" -m papilla.conformance',
    ),
    Mutation(
        "the page's raster with two corners of each triangle exchanged",
        "clients/web/src/raster.js",
        "out[pixels[n]] = weights[k] * values[corners[k]]\n        + weights[k + 1] * values[corners[k + 1]]",
        "out[pixels[n]] = weights[k] * values[corners[k + 1]]\n        + weights[k + 1] * values[corners[k]]",
        "cd tests/browser && node --test modules.test.mjs",
    ),
]
