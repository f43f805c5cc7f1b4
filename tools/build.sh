# Sourced by tools/demo and tools/test, in the repository's root: configure and build a preset.
if command -v ccache >/dev/null; then # used when it is there, never required
  export CMAKE_C_COMPILER_LAUNCHER=ccache CMAKE_CXX_COMPILER_LAUNCHER=ccache
fi

configure() { # PRESET [CMAKE ARGUMENTS]
  local preset=$1
  shift
  echo "build: cmake --preset $preset $*"
  mkdir -p "build/$preset"
  if ! cmake --preset "$preset" "$@" >"build/$preset/configure.log" 2>&1; then
    cat "build/$preset/configure.log"
    echo "build: configuring failed" >&2
    return 1
  fi
}

build() { # PRESET [TARGETS]
  local preset=$1
  shift
  echo "build: compiling into build/$preset (on $(nproc) processors)"
  cmake --build "build/$preset" -j "$(nproc)" ${1:+--target "$@"}
}
