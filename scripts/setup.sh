# Shared by `run` and `test`: what a fresh Debian 12 needs, and where builds go.
# Sourced, never run; expects `set -euo pipefail` and `root`, the checkout's folder.

cache="${CAUSEWAY_CACHE_DIR:-${XDG_CACHE_HOME:-$HOME/.cache}/causeway}"
# Outside the checkout: it stays clean, and all checkouts of one user share what is built.
export CARGO_TARGET_DIR="${CAUSEWAY_TARGET_DIR:-$cache/target}"

say() {
    printf 'causeway: %s\n' "$*" >&2
}

die() {
    say "$*"
    exit 1
}

as_root() {
    if [ "$(id -u)" -eq 0 ]; then
        "$@"
    elif command -v sudo >/dev/null; then
        sudo "$@"
    else
        die "this needs root or sudo: $*"
    fi
}

# install_packages PACKAGE...: installs those that are missing. Without apt-get it only says what is
# missing, as another system may have it under another name.
install_packages() {
    local missing=() package
    for package in "$@"; do
        # Anything but "installed" counts as missing, also a package that was removed again.
        if ! dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null | grep -qx installed; then
            missing+=("$package")
        fi
    done
    if [ "${#missing[@]}" -eq 0 ]; then
        return
    fi
    if ! command -v apt-get >/dev/null; then
        say "no apt-get here; make sure you have what Debian calls: ${missing[*]}"
        return
    fi
    say "installing ${missing[*]}"
    as_root apt-get update -qq
    as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends \
        "${missing[@]}" >/dev/null
}

need_rust() {
    if ! command -v cargo >/dev/null && [ -x "$HOME/.cargo/bin/cargo" ]; then
        PATH="$HOME/.cargo/bin:$PATH"
    fi
    command -v cargo >/dev/null || die "no Rust toolchain; install one from https://rustup.rs"
}

# What building and running need: a C compiler and linker, cmake and nasm for the JPEG encoder.
install_build_packages() {
    local packages=(cmake nasm pkg-config)
    command -v cc >/dev/null && command -v c++ >/dev/null || packages+=(build-essential)
    install_packages "${packages[@]}"
    need_rust
}

build_causeway() {
    say "building in $CARGO_TARGET_DIR (minutes the first time)"
    # In the checkout, as cargo looks for its .cargo/config.toml from where it is.
    (cd "$root" && cargo build --release --locked --quiet -p causeway)
}
