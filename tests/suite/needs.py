"""What parts of the suite need beyond the Rust toolchain: how it is installed, and whether it is there."""

import importlib.util
import os
import shutil
import subprocess
from pathlib import Path

# Debian's packages, by the program or file that shows that they are there.
PACKAGES = {
    "ccx": "calculix-ccx",
    "chromium": "chromium",
    "g++": "g++",
    "cmake": "cmake",
    "pkg-config": "pkg-config",
    "godot3-server": "godot3-server",
    # The same with a window, for the picture of the example. xvfb only recommends xauth, and xvfb-run needs it.
    "godot3": "godot3",
    "xvfb-run": "xvfb",
    "xauth": "xauth",
    "qemu-x86_64": "qemu-user",
    "mcs": "mono-mcs",
    "mono": "mono-runtime",
    "unshare": "util-linux",
    "ip": "iproute2",
    "/usr/share/i18n/locales/tr_TR": "locales",
    "/usr/lib/cli/Newtonsoft.Json-5.0/Newtonsoft.Json.dll": "libnewtonsoft-json5.0-cil "
    "libmono-system-numerics4.0-cil libmono-system-runtime4.0-cil",
}
AS_ROOT = 'as_root() { if [ "$(id -u)" = 0 ]; then "$@"; else sudo "$@"; fi; };'


def packages_missing() -> str:
    """Debian packages that are not here yet, in one line."""
    missing = [package for name, package in PACKAGES.items() if not (shutil.which(name) or os.path.exists(name))]
    # Debian parts from its Python what `python3 -m venv` needs.
    if importlib.util.find_spec("ensurepip") is None:
        missing.append("python3-venv")
    return " ".join(missing)


def install_packages() -> str:
    missing = packages_missing()
    if not missing:
        return "echo 'nothing to install'"
    options = "-y -qq --no-install-recommends"
    return f"{AS_ROOT} as_root apt-get update -qq; as_root apt-get install {options} {missing}"


def no_display() -> str | None:
    missing = [package for name, package in (("godot3", "godot3"), ("xvfb-run", "xvfb"), ("xauth", "xauth")) if not shutil.which(name)]
    return f"no Godot 3 that draws, or no display for it: apt install {' '.join(missing)}" if missing else None


def no_godot4() -> str | None:
    if os.environ.get("GODOT4") or shutil.which("godot4") or shutil.which("godot"):
        return None
    return "no Godot 4 here: set GODOT4 to its program"


def onnxruntime() -> str:
    """The library in the trainer's environment, for bash."""
    return '"$(ls "$TARGET"/venv-trainer/lib/python3*/site-packages/onnxruntime/capi/libonnxruntime.so.*)"'


def no_onnxruntime() -> str | None:
    target = Path(os.environ.get("CARGO_TARGET_DIR", "target"))
    if any(target.glob("venv-trainer/lib/python3*/site-packages/onnxruntime/capi/libonnxruntime.so.*")):
        return None
    return "no ONNX Runtime here: pip could not install it"


def no_prometheus() -> str | None:
    if shutil.which("promtool") or (shutil.which("apt-get") and shutil.which("dpkg")):
        return None
    return "no promtool here, and no apt-get to fetch it"


def no_musl() -> str | None:
    if os.geteuid() == 0 and shutil.which("musl-gcc") and shutil.which("dpkg"):
        return None
    return "needs root, dpkg and musl-gcc: apt install musl-tools"


def no_buildah() -> str | None:
    return no_musl() or (None if shutil.which("buildah") else "no buildah here: apt install buildah uidmap")


def no_cmake() -> str | None:
    there = shutil.which("cmake") and shutil.which("pkg-config")
    return None if there else "no CMake and pkg-config here: apt install cmake pkg-config"


def no_qemu() -> str | None:
    if os.uname().machine != "x86_64":
        return "the program is for another kind of processor here"
    return None if shutil.which("qemu-x86_64") else "no qemu-x86_64 here: apt install qemu-user"


def no_haproxy() -> str | None:
    # Debian has its daemons where a user's shell may not look.
    if shutil.which("haproxy", path=os.environ["PATH"] + ":/usr/sbin"):
        return None
    return "no haproxy here: apt-get install haproxy"


def no_validator() -> str | None:
    target = Path(os.environ.get("CARGO_TARGET_DIR", "target"))
    if (target / "venv-kubernetes/bin/kubernetes-validate").exists():
        return None
    return "no kubernetes-validate here: pip could not install it"


def slurm_missing() -> bool:
    return not all(shutil.which(name, path=f"{os.environ['PATH']}:/usr/sbin") for name in ("slurmctld", "munged"))


def install_slurm() -> str:
    if not slurm_missing():
        return ":"
    return f"{AS_ROOT} as_root apt-get install -y -qq --no-install-recommends slurm-wlm munge"


def no_slurm() -> str | None:
    if slurm_missing() and not shutil.which("apt-get"):
        return "no slurmctld and munged here, and no apt-get to install slurm-wlm and munge"
    if os.geteuid() != 0 and not shutil.which("sudo"):
        return "a cluster of namespaces needs root"
    unshared = ["unshare", "--net", "--uts", "--mount", "--pid", "--fork", "true"]
    sudo = [] if os.geteuid() == 0 else ["sudo", "-n"]
    if subprocess.run([*sudo, *unshared], capture_output=True, check=False).returncode != 0:
        return "no namespaces may be made here"
    return None


def no_nightly() -> str | None:
    command = ["rustup", "run", "nightly", "rustc", "--version"]
    if shutil.which("rustup") and subprocess.run(command, capture_output=True, check=False).returncode == 0:
        return None
    return "no nightly compiler here: rustup toolchain install nightly"
