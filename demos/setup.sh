# What a machine needs before Lightloom builds and runs on it. Sourced by demos/run.sh, tests/run.sh and .ci/run.
# Each function returns at once where nothing is missing.

# Prints what is wrong and how to mend it, and ends the script.
fail() {
  printf 'error: %s\n' "$*" >&2
  exit 1
}

# install WHY PACKAGE…: installs Debian packages as root or through sudo, or says which ones are wanted.
install() {
  local why=$1 root=()
  shift
  command -v apt-get >/dev/null 2>&1 ||
    fail "$why; there is no apt-get here: install by your package manager what Debian calls: $*"
  if [ "$(id -u)" -ne 0 ]; then
    command -v sudo >/dev/null 2>&1 || fail "$why, and there is no sudo here; as root, run: apt-get install -y $*"
    root=(sudo)
  fi
  printf '%s: installing %s\n' "$why" "$*" >&2
  "${root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get update -qq >&2 ||
    printf 'warning: apt-get update failed; trying with the package lists at hand\n' >&2
  "${root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "$@" >&2 ||
    fail "$why, and apt-get could not install $*"
}

need_rust() {
  command -v cargo >/dev/null 2>&1 && return
  # rustup's default place, in a shell that has not read it yet.
  if [ -x "${CARGO_HOME:-$HOME/.cargo}/bin/cargo" ]; then
    PATH="${CARGO_HOME:-$HOME/.cargo}/bin:$PATH"
    export PATH
    return
  fi
  fail "no Rust toolchain (cargo) found; install it with:
  curl --proto '=https' --tlsv1.2 -sSf https://sh.rustup.rs | sh -s -- -y
then open a new shell, or: . \"\$HOME/.cargo/env\""
}

# The image difference FLIP is compiled from C++.
need_cxx() {
  local tool
  for tool in "${CXX:-c++}" g++ clang++; do
    if command -v "$tool" >/dev/null 2>&1; then
      command -v c++ >/dev/null 2>&1 || export CXX="$tool"
      return
    fi
  done
  case "$(uname -s)" in
    Linux) install "no C++ compiler found" g++ ;;
    Darwin) fail "no C++ compiler found; install Apple's with: xcode-select --install" ;;
    *) ;; # Windows: the toolchain finds Visual Studio's compiler without PATH
  esac
}

# Whether a Vulkan loader and at least one driver manifest are in place.
vulkan_present() {
  local loader dir
  loader=$( (ldconfig -p 2>/dev/null || /sbin/ldconfig -p 2>/dev/null || true) | grep -c 'libvulkan\.so\.1' || true)
  if [ "$loader" -eq 0 ]; then
    compgen -G '/usr/lib*/libvulkan.so.1' >/dev/null || compgen -G '/usr/lib/*/libvulkan.so.1' >/dev/null || return 1
  fi
  if [ -n "${VK_DRIVER_FILES:-}${VK_ICD_FILENAMES:-}" ]; then
    return 0
  fi
  for dir in /usr/share /etc /usr/local/share /usr/local/etc "${XDG_DATA_HOME:-$HOME/.local/share}" /run/opengl-driver/share; do
    compgen -G "$dir/vulkan/icd.d/*.json" >/dev/null && return 0
  done
  return 1
}

# A Vulkan device: on Linux, Mesa's software driver where there is none at all.
need_vulkan() {
  [ "$(uname -s)" = Linux ] || return 0
  # Without a display, Mesa's device-select layer has nothing to choose by and complains on stderr.
  if [ -z "${XDG_RUNTIME_DIR:-}${DISPLAY:-}" ]; then
    export NODEVICE_SELECT="${NODEVICE_SELECT:-1}"
  fi
  vulkan_present && return 0
  install "no Vulkan driver found" mesa-vulkan-drivers libvulkan1
}
